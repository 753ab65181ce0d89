"""The measurement of the arm on one real scene: plan, physics and verdict."""

from functools import partial

from agent.evaluating import spoken_scenes
from agent.evaluating_arm import _built, _rates
from structdiffusion.evaluation_scenes import draw_evaluation_scenes
from structdiffusion.geometric import GeometricPlanner
from structdiffusion.objects.libraries import load_objects


def test_a_scene_is_built_and_judged():
    models = [model for model in load_objects("ycb") if model.category in ("cup", "can")]
    scenes = spoken_scenes(list(draw_evaluation_scenes(models, 1, shapes=("line",), seed=2)), heard=False)
    row = partial(_built, 8)(GeometricPlanner(), scenes[0])
    assert row["structure"] == "line" and row["words"]
    # Whatever the arm achieves, the row may not claim more than happened.
    assert row["planned"] or row["trouble"]
    assert row["placed"] <= len(row["objects"])
    assert not row["stands"] or (row["planned"] and row["placed"] == len(row["objects"]) and not row["failed_checks"])
    assert _rates([row])["stands"]["count"] == int(row["stands"])

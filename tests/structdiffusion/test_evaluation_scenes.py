import numpy as np
import pytest

from structdiffusion.evaluation_scenes import draw_evaluation_scenes
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.scenes import SceneError

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]


@pytest.fixture(scope="module")
def scenes():
    return list(draw_evaluation_scenes(MODELS, 2, shapes=("line", "tower"), seed=3))


def test_scenes_follow_from_the_seed_and_can_be_solved(scenes):
    assert [(scene.structure, scene.number) for scene in scenes] == [
        ("line", 0), ("line", 1), ("tower", 0), ("tower", 1),
    ]
    again = list(draw_evaluation_scenes(MODELS, 1, shapes=("tower",), seed=3))[0]
    assert again.spec == scenes[2].spec
    np.testing.assert_array_equal(again.drawn.world_from_initial, scenes[2].drawn.world_from_initial)
    first, second = scenes[2].observed(), again.observed()
    np.testing.assert_array_equal(first.objects[0].points, second.objects[0].points)
    assert len(first.objects) == again.drawn.count
    assert again.planning_seed == scenes[2].planning_seed != scenes[3].planning_seed
    assert again.verdict(again.drawn.reference_goal_from_initial()).success
    other = list(draw_evaluation_scenes(MODELS, 1, shapes=("tower",), seed=4))[0]
    assert not np.array_equal(other.drawn.world_from_initial, again.drawn.world_from_initial)


def test_a_seed_gives_the_scenes_that_it_always_gave(scenes):
    """Published numbers name a seed: it must go on to mean the same scenes, and the same noise in them."""
    line, tower = scenes[1], scenes[2]
    assert str(line.spec) == "shape line, size medium, x_position right, y_position bottom, rotation west"
    assert [model.name for model in line.drawn.models] == ["can_0_001", "can_0_002", "block_0_002"]
    assert (line.drawn.count, line.draw, tower.drawn.count, tower.draw) == (2, 0, 4, 0)
    np.testing.assert_allclose(
        line.drawn.world_from_initial[:, :2, 3],
        [[0.31098, -0.13682], [0.53012, 0.270555], [0.332779, 0.192476]],
        atol=1e-5,
    )
    np.testing.assert_allclose(line.observed().objects[0].centroid, [0.302442, -0.132816, 0.099721], atol=1e-4)
    np.testing.assert_allclose(tower.observed().objects[0].centroid, [0.506401, 0.054172, 0.043994], atol=1e-4)


def test_no_scene_can_be_drawn_from_nothing():
    with pytest.raises(SceneError, match="no table setting in 100 draws from 9 objects"):
        list(draw_evaluation_scenes(MODELS, 1, shapes=("table setting",)))


def test_scenes_drawn_in_a_pool_are_those_drawn_alone(scenes):
    pooled = list(draw_evaluation_scenes(MODELS, 2, shapes=("line", "tower"), seed=3, workers=2))
    for one, other in zip(scenes, pooled, strict=True):
        assert (one.spec, one.draw) == (other.spec, other.draw)
        np.testing.assert_array_equal(one.drawn.world_from_initial, other.drawn.world_from_initial)

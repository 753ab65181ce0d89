"""Samples of the diffusion model are judged as the evaluation judges them."""

import numpy as np
import pytest

from agent.training.judged_proposals import DISTURBED, PROPOSER, SAMPLES, generate_judged, judged
from structdiffusion.benchmark.scenes import draw_evaluation_scene
from structdiffusion.data.demonstrations import save_library
from structdiffusion.data.npz_files import read_arrays
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.models.outcome.loss import judged_scenes
from structdiffusion.objects.libraries import load_objects
from structdiffusion.planners.factory import load_planner


@pytest.fixture(scope="module")
def models():
    return load_objects("validation")


def test_samples_are_right_where_the_evaluation_lets_them_stand(models):
    """On the table letting go changes little: all but a few of a line's samples get the evaluation's verdict."""
    scene = draw_evaluation_scene(models, "line", 1, seed=3)
    found = judged(scene, load_planner(PROPOSER), {model.name: place for place, model in enumerate(models)})
    assert len(found["right"]) == SAMPLES + DISTURBED and 0 < found["right"].sum() < len(found["right"])
    count = int(found["count"])
    motions = [[pose_from_xyz_yaw(*one) for one in row[:count]] for row in found["motions"]]
    verdicts = [scene.verdict(np.array(row)).success for row in motions[:SAMPLES:2] + motions[SAMPLES::12]]
    said = [*found["right"][:SAMPLES:2], *found["right"][SAMPLES::12]]
    assert np.mean(np.array(verdicts) == np.array(said)) >= 0.85


def test_shards_are_written_once_and_can_be_learned_from(models, tmp_path, monkeypatch):
    monkeypatch.setattr("agent.training.judged_proposals.SHARD_SCENES", 2)
    save_library(models, tmp_path)
    assert list(generate_judged(models, tmp_path, 2, seed=3)) == [(0, 1), (1, 1)]
    (shard,) = tmp_path.glob("judged_*.npz")
    written = shard.stat().st_mtime_ns
    assert list(generate_judged(models, tmp_path, 2, seed=3)) == [(1, 1)] and shard.stat().st_mtime_ns == written
    columns = read_arrays(shard)
    assert columns["motions"].shape == (2, SAMPLES + DISTURBED, 12, 4) and columns["right"].dtype == bool
    scenes = list(judged_scenes(tmp_path))
    assert [scene.nouns.shape[1] for scene in scenes] == columns["count"].tolist()

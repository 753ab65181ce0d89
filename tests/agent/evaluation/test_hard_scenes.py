"""Hard scenes: objects are stacked, touch or hide each other as their condition says, and the bag has what was seen."""

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.evaluation.hard_scenes import KINDS, SIDES, _settled, condition_of, hard_scene
from agent.evaluation.recorded_masks import RecordingJob, record_job
from agent.recordings.load import read_recording
from agent.synthetic_tables.sensors import SENSORS
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import SceneError, draw_scene
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.objects.libraries import load_objects


@pytest.fixture(scope="module")
def drawn():
    blocks = [model for model in load_objects("procedural") if model.category in ("block", "can")]
    return draw_scene(blocks, StructureSpec("line"), np.random.default_rng(2), count=3, distractors=0)


@pytest.fixture(scope="module")
def stacked(drawn):
    return hard_scene(drawn, condition_of(0, KINDS.index("stacked")), np.random.default_rng(0))


def test_all_kinds_sides_and_sensors_come_in_turn():
    found = [condition_of(structure, number) for structure in range(4) for number in range(15)]
    for kind in KINDS:
        own = [one for one in found if one.kind == kind]
        assert {one.side for one in own} == set(SIDES) and {one.sensor for one in own} == set(SENSORS)
        assert 12 <= len(own) <= 16
    assert min(sum(one.side == side for one in found) for side in SIDES) >= 12


def test_of_a_stack_one_object_stands_on_another(drawn, stacked):
    poses, masks = stacked.world_from_initial, stacked.view.masks
    up = np.flatnonzero(poses[:, 2, 3] > 0.01)
    (under,) = [k for k in range(3) if k not in up and np.linalg.norm(poses[k, :2, 3] - poses[up[0], :2, 3]) < 0.05]
    assert len(up) == 1 and poses[up[0], 2, 3] == pytest.approx(drawn.models[under].height, abs=0.003)
    assert masks.shape == (3, 480, 640) and masks.sum(axis=(1, 2)).min() >= 400
    assert not masks.sum(axis=0).max() > 1 and np.isfinite(stacked.view.depth[masks.any(axis=0)]).all()


def test_what_touches_is_less_than_two_millimetres_apart(drawn):
    scene = hard_scene(drawn, condition_of(0, KINDS.index("touching")), np.random.default_rng(1))
    outlines = [
        turned(model.footprint, math.atan2(pose[1, 0], pose[0, 0])) + pose[:2, 3]
        for model, pose in zip(drawn.models, scene.world_from_initial, strict=True)
    ]
    assert min(clear_gap(outlines[a], outlines[b]) for a in range(3) for b in range(a)) < 0.002


def test_objects_that_are_inside_each_other_are_no_scene(drawn):
    poses = drawn.world_from_initial.copy()
    poses[1, :3, 3] = poses[0, :3, 3]
    with pytest.raises(SceneError, match="does not stay"):
        _settled(drawn, poses)


def test_the_bag_holds_what_the_sensor_measured_from_its_side(drawn, stacked, tmp_path):
    job = RecordingJob("line", 0, 5, replace(drawn, world_from_initial=stacked.world_from_initial), stacked)
    recording = record_job(job, "procedural", 5, tmp_path)
    frame = read_recording(recording.bag).frame
    depth = stacked.view.depth
    both = np.isfinite(depth) & np.isfinite(frame.points[..., 2])
    assert both.sum() > 0.95 * np.isfinite(depth).sum()
    np.testing.assert_allclose(frame.points[both][:, 2], depth[both], atol=0.001)
    np.testing.assert_array_equal(frame.color, stacked.view.color)
    assert [int(mask.sum()) for mask in recording.masks.values()] == stacked.view.masks.sum(axis=(1, 2)).tolist()

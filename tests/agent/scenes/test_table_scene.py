"""The table that a conversation works on: what is remembered of a look, who takes part, and how it is put back."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.controller import ArmDriver
from agent.scenes.files import write_scene
from agent.scenes.random_scenes import assortment
from agent.scenes.sources import DrawnSource, FileSource
from agent.scenes.table_scene import TableScene
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.objects.procedural import procedural_object, procedural_objects
from structdiffusion.simulation.visible_points import ObservationError

BLOCKS = [procedural_object("block", index) for index in range(3)]
FOLDED = arm_model(DEFAULT_MODEL).folded
UPON = BLOCKS[0].height
OFF = pose_from_xyz_yaw(0.45, 0.1, -1.0, 0.0)


@pytest.fixture(scope="module")
def source() -> DrawnSource:
    return DrawnSource("procedural")


@pytest.fixture
def stacked() -> Iterator[TableScene]:
    """Three blocks, the second on the first, of which the third is a distractor."""
    poses = [pose_from_xyz_yaw(0.45, -0.1, 0.0, 0.0), pose_from_xyz_yaw(0.45, -0.1, UPON, 0.3)]
    poses.append(pose_from_xyz_yaw(0.45, 0.2, 0.0, 0.0))
    with TableScene(BLOCKS, np.array(poses), 2, np.random.default_rng(0)) as table:
        yield table


def cloud_of(table: TableScene, name: str):
    scene = table.look()
    return next(cloud for cloud in (*scene.objects, *scene.distractors) if cloud.name == name)


def test_a_look_shows_what_each_object_stands_on(stacked):
    scene = stacked.look()
    assert [cloud.name for cloud in scene.objects] == ["block 1", "block 2"]
    assert [cloud.name for cloud in scene.distractors] == ["block 3"]
    assert [cloud.bottom for cloud in (*scene.objects, *scene.distractors)] == [0.0, pytest.approx(UPON), 0.0]


def test_what_was_only_moved_keeps_the_cloud_of_its_first_look(stacked):
    seen = cloud_of(stacked, "block 2")
    start = stacked.poses()["block 2"]
    goal = pose_from_xyz_yaw(0.3, 0.0, 0.0, 1.0)
    stacked.world.set_pose(1, goal)
    now = cloud_of(stacked, "block 2")
    expected = transform_points(goal @ np.linalg.inv(start), seen.points)
    np.testing.assert_allclose(now.points, expected, atol=1e-6)
    assert now.points.dtype == np.float32 and now.bottom == 0.0
    np.testing.assert_array_equal(now.colors, seen.colors)
    stacked.world.set_pose(1, start)  # and back again: it stands on the first block as before
    assert cloud_of(stacked, "block 2").bottom == pytest.approx(UPON, abs=1e-6)


def test_what_is_hidden_now_is_still_known(stacked):
    """The camera cannot see a die under a cup; what was seen before needs no second look."""
    stacked.look()
    over = pose_from_xyz_yaw(0.45, 0.2, 0.0, 0.0)
    for index, name in ((0, "block 1"), (1, "block 2")):
        stacked.world.set_pose(index, over)  # all three in one place: at most one of them can be seen whole
        assert len(cloud_of(stacked, name).points) > 200
    assert len(cloud_of(stacked, "block 3").points) > 200


def test_what_was_never_seen_and_takes_part_has_to_be_seen():
    cup, die = procedural_object("can", 0), procedural_object("can", 1)
    inside = [pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.0)] * 2
    with TableScene([cup, die], np.array(inside), 2, np.random.default_rng(0)) as table:
        with pytest.raises(ObservationError, match="fewer than 20 points of the can 2"):
            table.look()
        table.involve(["can 1"])
        scene = table.look()
        assert [cloud.name for cloud in scene.objects] == ["can 1"] and scene.distractors == ()


def test_what_fell_over_is_looked_at_anew(stacked):
    seen = cloud_of(stacked, "block 3")
    lying = pose_from_xyz_yaw(0.45, 0.2, 0.04, 0.0)
    lying[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    stacked.world.set_pose(2, lying)
    stacked.world.settle()
    assert tilt_between(stacked.world.pose(2), lying) < math.radians(5)
    anew = cloud_of(stacked, "block 3")
    assert anew.points.shape != seen.points.shape or not np.allclose(anew.points, seen.points)
    assert anew.bottom == 0.0
    width = np.ptp(np.concatenate(BLOCKS[2].hulls)[:, 1])  # is its height now
    assert anew.points[:, 2].max() == pytest.approx(width, abs=0.01)
    # And that is what is remembered from now on.
    np.testing.assert_allclose(cloud_of(stacked, "block 3").points, anew.points, atol=1e-6)


def test_what_fell_off_is_left_out(stacked):
    assert stacked.fallen == ()
    stacked.look()
    for index in (0, 2):
        stacked.world.set_pose(index, OFF)
    assert stacked.fallen == ("block 1", "block 3")
    scene = stacked.look()
    assert [cloud.name for cloud in scene.objects] == ["block 2"] and scene.distractors == ()


def test_those_that_take_part_come_first(stacked):
    before = stacked.poses()
    stacked.look()
    stacked.involve(["block 3", "block 2"])
    assert stacked.names == stacked.display_names == ("block 2", "block 3", "block 1") and stacked.count == 2
    assert [model.name for model in stacked.models] == [BLOCKS[i].name for i in (1, 2, 0)]
    assert list(stacked.world.models) == list(stacked.models)
    positions = [before[name][:3, 3] for name in stacked.names]
    np.testing.assert_allclose(stacked.world_from_initial[:, :3, 3], positions, atol=1e-12)
    assert all(np.allclose(stacked.poses()[name], pose, atol=1e-6) for name, pose in before.items())
    scene = stacked.look()
    assert [cloud.name for cloud in scene.objects] == ["block 2", "block 3"]
    assert [cloud.name for cloud in scene.distractors] == ["block 1"]
    for cloud in (*scene.objects, *scene.distractors):
        assert np.linalg.norm(cloud.centroid[:2] - before[cloud.name][:2, 3]) < 0.04
    stacked.involve(["block 2", "block 1", "block 3"])
    assert stacked.names == ("block 1", "block 2", "block 3") and stacked.count == 3


def test_an_unknown_name_is_named_and_changes_nothing(stacked):
    with pytest.raises(KeyError, match="there is no 'mug'; there are: block 1, block 2, block 3"):
        stacked.involve(["block 3", "mug"])
    assert stacked.names == ("block 1", "block 2", "block 3") and stacked.count == 2


def test_putting_back_names_what_had_moved_and_folds_the_arm(stacked):
    before = stacked.poses()
    assert stacked.put_back(before) == ()
    nudged = before["block 1"].copy()
    nudged[0, 3] += 0.001  # how things settle while others are moved
    stacked.world.set_pose(0, nudged)
    stacked.world.set_pose(2, OFF)
    stacked.involve(["block 3"])  # by name, however the objects are counted
    stacked.arm.teleport(FOLDED + 0.2)
    assert stacked.put_back(before) == ("block 3",)
    assert all(np.allclose(stacked.poses()[name], pose, atol=1e-6) for name, pose in before.items())
    np.testing.assert_allclose(stacked.arm.configuration(), FOLDED, atol=1e-6)
    stacked.world.step(0.5)
    np.testing.assert_allclose(stacked.arm.configuration(), FOLDED, atol=0.01)  # and it stays folded
    assert stacked.put_back(before) == ()  # at rest: nothing moved meanwhile


def test_putting_back_takes_what_the_arm_holds_out_of_its_hand(stacked):
    before = stacked.poses()
    stacked.world.set_pose(1, pose_from_xyz_yaw(0.3, 0.0, 0.2, 0.0))
    ArmDriver(stacked.world, stacked.arm).take(stacked.world.bodies[1])
    assert stacked.put_back(before) == ("block 2",) and stacked.arm.held is None
    stacked.arm.command(FOLDED + 0.3)  # a hand that still held it would take it along
    stacked.world.step(1.0)
    assert np.abs(stacked.arm.configuration() - FOLDED).max() > 0.2
    assert stacked.put_back(before) == ()


def test_an_assortment_has_cups_and_cans_and_two_of_another_noun_in_turn():
    library, further = procedural_objects(count=120, seed=0), set()
    for turn in range(4):
        drawn = assortment(library, np.random.default_rng(turn), turn)
        nouns = [model.category for model in drawn.models]
        assert nouns[:7] == ["cup"] * 4 + ["can"] * 3 and nouns[7] == nouns[8] and len(nouns) == 9
        further.add(nouns[7])
    assert len(further) == 4
    again = assortment(library, np.random.default_rng(2), 2)
    same = assortment(library, np.random.default_rng(2), 2)
    assert [model.name for model in again.models] == [model.name for model in same.models]


def test_without_cups_and_cans_there_is_still_a_table_to_talk_about():
    library = procedural_objects(count=34, seed=0)  # two of each kind
    drawn = assortment(library, np.random.default_rng(0))
    assert len(drawn.models) > 2 and drawn.count == len(drawn.models) - 1


def test_on_a_table_that_is_set_out_everything_takes_part_and_is_at_rest(source):
    with source.set_out(seed=3) as table:
        poses = table.poses()
        assert table.count == len(table.names) == len(poses) and table.fallen == ()
        scene = table.look()
        assert tuple(cloud.name for cloud in scene.objects) == table.names and scene.distractors == ()
        table.world.step(0.5)
        assert table.put_back(poses) == ()
    with source.set_out(seed=3) as again:
        assert again.names == table.names
        np.testing.assert_array_equal(list(again.poses().values()), list(poses.values()))


@pytest.mark.parametrize("reordered", [False, True])
def test_a_stack_that_was_saved_is_a_stack_when_it_is_loaded(tmp_path, source, stacked, reordered):
    if reordered:
        stacked.involve(["block 2", "block 3"])
    file = tmp_path / "stack.yaml"
    write_scene(source.saved(stacked, tmp_path), file)
    with FileSource(file).set_out(seed=0) as cache:
        assert sorted(cache.names) == sorted(stacked.names)
        for name, pose in stacked.poses().items():
            np.testing.assert_allclose(cache.poses()[name], pose, atol=1e-5)
        bottoms = {cloud.name: cloud.bottom for cloud in cache.look().objects}
    assert bottoms == {"block 1": 0.0, "block 2": pytest.approx(UPON, abs=1e-4), "block 3": 0.0}

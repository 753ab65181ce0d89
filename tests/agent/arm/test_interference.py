"""What a person does to the objects on the table, in physics: where everything is before and after."""

import math

import numpy as np
import pytest

from agent.arm.interference import AWAY, Interference, keep_away
from agent.arm.simulated_arm import SimulatedArm
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw, tilt_between
from structdiffusion.objects.blocks import block_objects
from structdiffusion.simulation.world import FALLEN, TIME_STEP, TabletopWorld

BLOCKS = {model.name: model for model in block_objects()}
PILLAR, CUBE, SLAB, POST = (BLOCKS[name] for name in ("pillar_red", "cube_50_green", "slab_blue", "post_yellow"))
PLACES = [pose_from_xyz_yaw(0.5, y, 0.0, 0.0) for y in (-0.25, -0.05, 0.15)]
GOAL = pose_from_xyz_yaw(0.6, 0.0, 0.0, 0.3)


@pytest.fixture
def table():
    with TabletopWorld([PILLAR, CUBE, SLAB], PLACES) as world:
        yield world


def acts(world, seed=0):
    names = ["pillar", "cube", "slab", "new block"]
    return Interference(world, SimulatedArm(world.client), names, np.random.default_rng(seed))


def done(world, deed):
    """Run physics until a deed is done and everything rests; return the event that tells of it."""
    while True:
        world.step(TIME_STEP)
        try:
            next(deed)
        except StopIteration as end:
            world.settle()
            return end.value


def moves(world):
    """The ways (N, 2) that the first objects have gone, and their tilts."""
    now = world.poses()[: len(PLACES)]
    ways = np.array([pose[:2, 3] - start[:2, 3] for pose, start in zip(now, PLACES)])
    return np.linalg.norm(ways, axis=1), [tilt_between(pose, start) for pose, start in zip(now, PLACES)]


@pytest.mark.parametrize("seed", range(3))
def test_a_push_moves_one_object_by_3_to_8_cm_and_nothing_else(table, seed):
    told = done(table, acts(table, seed).push([0, 1, 2], None))
    ways, tilts = moves(table)
    assert 0.028 < ways[told.object] < 0.082 and np.delete(ways, told.object).max() < 0.002
    assert max(tilts) < 0.05 and told.detail == f"was pushed by {100 * ways[told.object]:.1f} cm"
    assert not table.table.overhang(np.array([pose[:2, 3] for pose in table.poses()]))


def test_what_is_removed_is_gone_for_good(table):
    told = done(table, acts(table).remove([1], None))
    assert (told.disturbance, told.object, told.name) == ("remove", 1, "cube")
    assert table.pose(1)[2, 3] < FALLEN
    assert table.bodies[1] not in table.look().segmentation
    still = table.pose(1)
    table.step(1.0)
    assert np.allclose(table.pose(1), still)


def test_an_added_object_stands_where_another_is_to_go(table):
    spare = keep_away(table, POST)
    assert np.allclose(table.pose(spare), AWAY) and table.bodies[spare] not in table.look().segmentation
    told = done(table, acts(table).add(spare, {1: GOAL}, None))
    assert told.object is None and told.detail == "was put where cube is to go"
    assert np.allclose(table.pose(spare)[:3, 3], GOAL[:3, 3], atol=0.003)
    assert table.bodies[spare] in table.look().segmentation
    assert moves(table)[0].max() < 0.002


def test_an_added_object_goes_on_top_where_the_next_of_a_tower_is_to_go(table):
    spare = keep_away(table, BLOCKS["cube_35_red"])
    on_the_cube, too_high = PLACES[1].copy(), PLACES[1].copy()
    on_the_cube[2, 3], too_high[2, 3] = CUBE.height, 2 * CUBE.height
    assert acts(table).add(spare, {0: too_high}, None) is None  # what is below it is not there yet
    assert acts(table).add(spare, {0: PLACES[1]}, None) is None  # something stands there
    done(table, acts(table).add(spare, {0: on_the_cube}, None))
    assert abs(table.pose(spare)[2, 3] - CUBE.height) < 0.003


def test_a_tall_object_is_laid_on_its_side(table):
    assert PILLAR.tall and not CUBE.tall
    told = done(table, acts(table).topple([0, 1, 2], None))
    ways, tilts = moves(table)
    assert told.object == 0 and abs(tilts[0] - math.pi / 2) < 0.1 and max(tilts[1:]) < 0.05
    assert ways[1:].max() < 0.002 and table.pose(0)[2, 3] > FALLEN
    assert acts(table).topple([0, 1, 2], None) is None  # it lies already


def test_two_objects_change_places(table):
    told = done(table, acts(table).swap([0, 1], None))
    assert told.detail == "has changed places with cube"
    assert np.allclose(table.pose(0)[:2, 3], PLACES[1][:2, 3], atol=0.002)
    assert np.allclose(table.pose(1)[:2, 3], PLACES[0][:2, 3], atol=0.002)
    assert acts(table).swap([0], None) is None


@pytest.mark.parametrize("hold", ["weld", "friction"])
def test_the_hand_opens_and_its_driver_does_not_know(table, hold):
    arm = SimulatedArm(table.client)
    arm.hold_by(hold)
    pose = np.eye(4)
    pose[:3, 3] = arm.world_from_ee()[:3, 3] - (0.0, 0.0, 0.15)  # in the air, clear of the fingers
    table.set_pose(1, pose)
    someone = Interference(table, arm, ["pillar", "cube", "slab"], np.random.default_rng(0))
    arm.take(table.bodies[1])
    told = done(table, someone.drop(1))
    assert told.disturbance == "drop" and arm.held == table.bodies[1]
    assert table.pose(1)[2, 3] < pose[2, 3] - 0.05
    assert someone.drop(2) is None  # it stands on the table


def test_nothing_is_done_where_the_arm_is_or_without_a_free_way():
    walls = [pose_from_xyz_yaw(0.5 + x, y, 0.0, 0.0) for x, y in ((0.06, 0.0), (-0.06, 0.0), (0.0, 0.06), (0.0, -0.06))]
    with TabletopWorld([BLOCKS["cube_50_red"]] * 5, [pose_from_xyz_yaw(0.5, 0.0, 0.0, 0.0), *walls]) as world:
        assert acts(world).push([0], None) is None
    with TabletopWorld([CUBE], [PLACES[1]]) as world:
        arm = SimulatedArm(world.client)
        hand = arm.world_from_ee()
        world.set_pose(0, pose_from_xyz_rpy(hand[:3, 3], (0.0, 0.0, 0.0)))
        world.step(TIME_STEP)
        assert Interference(world, arm, ["cube"], np.random.default_rng(0)).remove([0], None) is None


def test_what_carries_another_is_left_alone():
    above = PLACES[1].copy()
    above[2, 3] = SLAB.height
    with TabletopWorld([SLAB, CUBE], [PLACES[1], above]) as world:
        world.settle()
        assert acts(world).push([0], None) is None and acts(world).remove([0], None) is None
        assert acts(world).remove([1], None) is not None and acts(world).push([1], None) is None

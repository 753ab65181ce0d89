"""Pick and place in physics, from what the camera saw."""

import math

import numpy as np
import pytest

from agent.arm.events import Picked, Placed, Planned, PlanFailed
from agent.arm.executor import build_structure
from agent.arm.kinematics import FOLDED, JacoArm
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.tabletop import TabletopWorld


def build(kinds, poses, goals, seed=0, distractors=0):
    """Events of a build, the poses at the end, and the goals' poses; `goals` are (x, y, z, turn) per object."""
    rng = np.random.default_rng(seed)
    models = [procedural_object(kind, index) for index, kind in enumerate(kinds)]
    initial = [pose_from_xyz_yaw(x, y, 0.0, yaw) for x, y, yaw in poses]
    with TabletopWorld(models, initial) as world:
        arm = JacoArm(world.client)
        world.settle()
        count = len(kinds) - distractors
        scene = world.observe(rng, range(count), range(count, len(kinds)))
        start = world.poses()[:count]
        goal_poses = []
        for pose, (x, y, z, turn) in zip(start, goals):
            goal = pose_from_xyz_yaw(x, y, z, turn)
            goal[:3, :3] = goal[:3, :3] @ pose[:3, :3]
            goal_poses.append(goal)
        motions = np.array([goal @ np.linalg.inv(pose) for goal, pose in zip(goal_poses, start)])
        events = list(build_structure(world, arm, scene, [Arrangement(motions)], rng=rng))
        world.step(2.0)
        assert np.abs(np.sin((arm.configuration() - FOLDED) / 2)).max() < 0.05
        return events, world.poses()[:count], goal_poses


@pytest.mark.parametrize("kind", ["can", "cup", "box", "fork", "bowl"])
def test_pick_and_place(kind):
    events, poses, goals = build([kind], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)])
    assert [type(event) for event in events if not type(event).__name__.endswith("Failed")] == [Planned, Picked, Placed]
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03
    assert poses[0][2, 2] > math.cos(math.radians(15))
    placed = events[-1]
    assert placed.position_error_m < 0.03 and placed.to_dict()["kind"] == "placed"


def test_stacking_and_moving_aside():
    box = procedural_object("block", 0)
    # The second block starts where the tower is to be built.
    events, poses, goals = build(
        ["block", "can"], [(0.4, 0.2, 0.0), (0.45, -0.1, 0.0)], [(0.45, -0.1, 0.0, 0.0), (0.45, -0.1, box.height, 0.0)]
    )
    placed = [event for event in events if isinstance(event, Placed)]
    assert [(event.object, event.aside) for event in placed] == [(1, True), (0, False), (1, False)]
    assert poses[1][2, 3] == pytest.approx(box.height, abs=0.005)
    assert all(np.linalg.norm(pose[:2, 3] - goal[:2, 3]) < 0.03 for pose, goal in zip(poses, goals))


def test_an_unreachable_goal_moves_nothing():
    events, poses, _ = build(["can"], [(0.42, -0.15, 0.0)], [(1.6, 0.0, 0.0, 0.0)])
    assert [type(event) for event in events] == [PlanFailed]
    assert events[0].object == 0 and "reach" in events[0].reason
    assert poses[0][:2, 3] == pytest.approx((0.42, -0.15), abs=0.002)


def test_unknown_hold():
    with pytest.raises(ValueError, match="weld, friction"):
        next(build_structure(None, None, None, [], rng=np.random.default_rng(0), hold="glue"))

"""Pick and place in physics, from what the camera saw."""

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.arm.arm_model import arm_model
from agent.arm.events import Picked, PickFailed, Placed, PlanFailed, Planned
from agent.arm.executor import build_structure
from agent.arm.kinematics import Kinematics
from agent.arm.plan_selection import plan_structure
from agent.arm.simulated_arm import SimulatedArm
from agent.scenes.table_scene import TableScene
from structdiffusion.evaluation_protocol import MAX_DISPLACEMENT
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TABLE, TabletopWorld


def build(kinds, poses, goals, seed=0, distractors=0, kinematics=Kinematics(), hold="weld"):
    """Events of a build, the poses at the end, and the goals' poses; `goals` are (x, y, z, turn) per object."""
    rng = np.random.default_rng(seed)
    models = [procedural_object(kind, index) for index, kind in enumerate(kinds)]
    initial = [pose_from_xyz_yaw(x, y, 0.0, yaw) for x, y, yaw in poses]
    with TabletopWorld(models, initial) as world:
        arm = SimulatedArm(world.client, kinematics)
        arm.hold_by(hold)
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
        assert np.abs(np.sin((arm.configuration() - kinematics.folded) / 2)).max() < 0.05
        return events, world.poses()[:count], goal_poses


@pytest.mark.parametrize(
    "kind, hold",
    [*((kind, "weld") for kind in ("can", "fork", "bowl")),
     *((kind, "friction") for kind in ("jar", "cup", "box", "fork", "bowl", "candle"))],
)  # fmt: skip
def test_pick_and_place(kind, hold):
    events, poses, goals = build([kind], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)], hold=hold)
    assert [type(event) for event in events if not type(event).__name__.endswith("Failed")] == [Planned, Picked, Placed]
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03
    assert poses[0][2, 2] > math.cos(math.radians(15))
    placed = events[-1]
    assert placed.position_error_m < 0.03 and placed.to_dict()["kind"] == "placed"


def test_the_tips_fold_around_a_can_too_wide_to_be_pinched():
    """By friction alone, and lifted: with stiff tips the fingers press it out of the hand."""
    can = procedural_object("can", 27)
    start, goal = (pose_from_xyz_yaw(0.45, y, 0.0, 0.0) for y in (-0.15, 0.1))
    assert np.ptp(can.footprint, axis=0).min() > 0.1
    with TabletopWorld([can], [start]) as world:
        arm = SimulatedArm(world.client)
        scene = world.observe(np.random.default_rng(0))
        arrangement = Arrangement((goal @ np.linalg.inv(start))[None])
        events = list(build_structure(world, arm, scene, [arrangement], rng=np.random.default_rng(0)))
        assert [event.hold for event in events if isinstance(event, Picked)] == ["friction"]
        assert np.linalg.norm(world.pose(0)[:3, 3] - goal[:3, 3]) < 0.02
        assert arm.tip_angles() == pytest.approx(np.zeros(3), abs=0.02)  # they stretch again when the hand opens


@pytest.mark.parametrize(
    "name, height, yaw", [("j2n6s300", 0.0, 90.0), ("j2n6s300", -0.12, 60.0), ("j2s6s300", 0.08, 90.0)]
)
def test_pick_and_place_with_the_other_arms_mounted_elsewhere(name, height, yaw):
    kinematics = Kinematics(arm_model(name), pose_from_xyz_yaw(0.0, 0.0, height, math.radians(yaw)))
    events, poses, goals = build(["can"], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)], kinematics=kinematics)
    assert [type(event) for event in events if not type(event).__name__.endswith("Failed")] == [Planned, Picked, Placed]
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03 and poses[0][2, 2] > math.cos(math.radians(15))


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


def test_a_tower_is_taken_down_into_a_line():
    """From the top, with the bottoms that were seen: the upper blocks end on the table."""
    models = [procedural_object("block", index) for index in (0, 2, 1)]
    bottoms = np.concatenate(([0.0], np.cumsum([model.height for model in models])))
    stack = np.array([pose_from_xyz_yaw(0.45, -0.2, float(z), 0.0) for z in bottoms[:3]])
    goals = np.array([pose_from_xyz_yaw(0.45, 0.16 * k, 0.0, 0.0) for k in range(3)])
    with TableScene(models, stack, 3, np.random.default_rng(0)) as table:
        table.world.settle()
        scene = table.look()
        assert [cloud.bottom for cloud in scene.objects] == pytest.approx(bottoms[:3], abs=0.002)
        arrangement = Arrangement(goals @ np.linalg.inv(stack))
        planned, *_ = plan_structure(scene, [arrangement], rng=np.random.default_rng(3))
        built = list(build_structure(table.world, table.arm, scene, [arrangement], rng=np.random.default_rng(3)))
        assert isinstance(planned, Planned) and replace(planned, seconds=0.0) == replace(built[0], seconds=0.0)
        assert planned.order == (2, 1, 0)
        # Of the lower blocks the camera saw two faces, from which the rest has to be guessed.
        assert not [event for event in built if isinstance(event, PickFailed)]
        assert [event.object for event in built if isinstance(event, Placed)] == [2, 1, 0]
        table.world.step(0.5)
        for pose, goal in zip(table.world.poses(), goals, strict=True):
            assert np.linalg.norm(pose[:3, 3] - goal[:3, 3]) < MAX_DISPLACEMENT and pose[2, 3] == pytest.approx(
                0.0, abs=0.003
            )
        assert table.world.supports() == [(TABLE,)] * 3
        assert [cloud.bottom for cloud in table.look().objects] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("fallen", [False, True])
def test_what_was_pushed_from_its_place_is_put_back(fallen):
    """Somebody pushes the first block away once the second has been placed; what fell off the table is left alone."""
    models = [procedural_object("block", index) for index in range(2)]
    start = np.array([pose_from_xyz_yaw(0.4, y, 0.0, 0.0) for y in (-0.25, -0.05)])
    goals = np.array([pose_from_xyz_yaw(0.55, y, 0.0, 0.0) for y in (0.0, 0.2)])
    pushed = pose_from_xyz_yaw(0.4, 0.3, -0.5 if fallen else 0.0, 0.0)
    with TableScene(models, start, 2, np.random.default_rng(0)) as table:
        scene, placed = table.look(), []
        work = build_structure(
            table.world, table.arm, scene, [Arrangement(goals @ np.linalg.inv(start))], rng=np.random.default_rng(0)
        )
        for event in work:
            if isinstance(event, Placed):
                placed.append(event.object)
                if len(placed) == 2:
                    table.world.set_pose(placed[0], pushed)
        assert len(set(placed[:2])) == 2 and placed[2:] == ([] if fallen else placed[:1])
        ends = np.array(table.world.poses())[:, :3, 3]
        wrong = np.linalg.norm(ends - goals[:, :3, 3], axis=1) > 0.03
        assert wrong[placed[0]] == fallen and not wrong[placed[1]]

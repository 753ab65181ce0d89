"""An arm stands as it was recorded, and a build leads it from there."""

import math

import numpy as np
import pytest

from agent.arm.arm_model import arm_model
from agent.arm.build_listeners import BuildListeners
from agent.arm.controller import ArmDriver
from agent.arm.events import Placed
from agent.arm.executor import build_structure
from agent.arm.jaco_hand import FINGER_OPEN, FINGERS
from agent.arm.motion_planner import PlanningScene
from agent.arm.recorded_state import standing
from agent.arm.recovery import is_folded, leave_start
from agent.arm.state import ArmState
from agent.errors import BadInput
from agent.scenes.table_scene import TableScene
from agent.scenes.workcell import Workcell
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement, Table

HOME = (4.8046852, 2.92482, 1.002, 4.2031852, 1.4458, 1.3233)  # of the j2n6s300, by its maker


def recorded(*angles: float, **others: float) -> ArmState:
    return ArmState("j2n6s300", {**{f"joint_{k}": angle for k, angle in enumerate(angles, 1)}, **others}, "j2n6s300_")


def test_names_and_windings_become_a_configuration():
    wound = np.array(HOME) + 2 * math.pi * np.array([3, 0, -1, -2, 0, 0])
    found = standing(recorded(*wound, joint_finger_1=1.0, joint_finger_2=0.5, joint_finger_3=0.0))
    model = arm_model("j2n6s300")
    assert (found.joints >= model.lower).all() and (found.joints <= model.upper).all()
    np.testing.assert_allclose(found.joints + found.wound, wound)
    np.testing.assert_allclose(found.wound / (2 * math.pi), np.round(found.wound / (2 * math.pi)))
    np.testing.assert_allclose(found.joints[1:3], HOME[1:3])  # a joint with limits may be told a turn off too
    np.testing.assert_array_equal(found.fingers, (1.0, 0.5, 0.0))
    assert found.notes == ()


def test_what_is_within_the_limits_stays_as_it_is():
    found = standing(recorded(*HOME))
    np.testing.assert_array_equal(found.joints, HOME)
    assert not found.wound.any()
    np.testing.assert_array_equal(found.fingers, [FINGER_OPEN] * 3)
    assert found.notes == (f"the recording does not have {', '.join(FINGERS)}: taken to be open",)


def test_an_encoder_may_report_a_little_beyond_a_limit():
    fingers = {"joint_finger_1": -0.01, "joint_finger_2": 0.2, "joint_finger_3": 0.2}
    found = standing(recorded(4.8, 0.81, 1.0, 4.2, 1.4, 1.3, **fingers))
    assert found.joints[1] == 0.8203
    assert found.fingers[0] == 0.0
    assert found.notes[0] == "joint_2 was recorded at 0.8100 rad, beyond its limit: taken to stand at 0.8203 rad"
    assert "joint_finger_1" in found.notes[1]


def test_what_cannot_be_is_refused():
    with pytest.raises(BadInput, match="joint_2 stands at 0.5000 rad; legal: 0.8203 to 5.4629 rad"):
        standing(recorded(4.8, 0.5, 1.0, 4.2, 1.4, 1.3))
    with pytest.raises(BadInput, match="how joint_6 of its j2n6s300 stood; needed: joint_1, "):
        standing(recorded(*HOME[:5]))
    with pytest.raises(BadInput, match="joint_finger_2 stands at 3.0000 rad; legal: 0.0000 to 1.5100 rad"):
        standing(recorded(*HOME, joint_finger_2=3.0))


def test_a_build_leads_the_arm_from_where_it_stood():
    """The forearm hangs over the table, the fingers are half closed, and the hand is lower than a block beside it."""
    models = [procedural_object("block", 1)]
    start, goal = pose_from_xyz_yaw(0.42, -0.15, 0.0, 0.3), pose_from_xyz_yaw(0.47, 0.15, 0.0, 0.3)
    state = recorded(*HOME, joint_finger_1=0.8, joint_finger_2=0.8, joint_finger_3=0.8)
    base = pose_from_xyz_yaw(0.0, 0.0, 0.05, math.pi / 2)
    workcell = Workcell(arm=state, world_from_base=base)
    with TableScene(models, start[None], 1, np.random.default_rng(0), workcell) as table:
        arm = table.arm
        np.testing.assert_allclose(arm.configuration(), HOME, atol=1e-9)
        np.testing.assert_allclose(arm.finger_angles(), [0.8] * 3, atol=1e-9)
        assert arm.world_from_ee() == pytest.approx(base @ _home_from_base(), abs=1e-3)
        assert not table.tidy_up()
        picture = table.picture("opposite")
        scene, first = table.look(), []
        arrangement = Arrangement((goal @ np.linalg.inv(start))[None])
        listeners = BuildListeners(on_step=lambda: first.append(arm.configuration()))
        work = build_structure(
            table.world, arm, scene, [arrangement], rng=np.random.default_rng(0), listeners=listeners
        )
        assert isinstance(list(work)[-1], Placed)
        assert np.abs(first[0] - HOME).max() < 0.01
        assert np.linalg.norm(table.world.pose(0)[:2, 3] - goal[:2, 3]) < 0.03
        assert (table.picture("opposite") != picture).any()
        table.put_back({"block": start})
        np.testing.assert_allclose(arm.configuration(), arm.kinematics.folded, atol=1e-9)


def test_an_arm_that_stands_lower_than_the_table_around_it_moves_freely():
    """What was measured of the table is a rectangle, and it reaches to where the arm stands."""
    base = pose_from_xyz_yaw(0.0, 0.0, -0.25, math.pi / 2)
    models, poses = [procedural_object("block", 1)], pose_from_xyz_yaw(0.5, -0.3, 0.0, 0.0)[None]
    around = Workcell(ground=Table(-0.5, 0.9, -0.6, 0.6), arm=recorded(*HOME), world_from_base=base)
    with TableScene(models, poses, 1, np.random.default_rng(0), around) as table:
        table.world.step(0.5)
        np.testing.assert_allclose(table.arm.configuration(), HOME, atol=0.005)
        table.arm.teleport(np.array(HOME) + (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        table.arm.command(np.array(HOME))
        table.world.step(4.0)
        np.testing.assert_allclose(table.arm.configuration(), HOME, atol=0.005)


def test_a_closed_hand_opens_where_it_must():
    """Fully closed fingers overlap each other, and no motion is free of that; the arm is led back all the same."""
    state = recorded(*HOME, **dict.fromkeys(FINGERS, 1.4))
    models, poses = [procedural_object("block", 1)], pose_from_xyz_yaw(0.5, -0.3, 0.0, 0.0)[None]
    with TableScene(models, poses, 1, np.random.default_rng(0), Workcell(arm=state)) as table:
        driver = ArmDriver(table.world, table.arm)
        with PlanningScene(np.random.default_rng(0), table.arm.kinematics) as scene:
            leave_start(driver, scene)
        assert is_folded(table.arm)
        assert table.arm.finger_angles() == pytest.approx([FINGER_OPEN] * 3, abs=0.05)


def _home_from_base() -> np.ndarray:
    return arm_model("j2n6s300").link_poses({f"joint_{k}": angle for k, angle in enumerate(HOME, 1)})["end_effector"]

"""The plan of one object among others: nothing else is touched, also while the fingers close."""

import numpy as np
import pytest

from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ObjectPlanner
from agent.arm.reachability import TOUCHING
from structdiffusion.geometry import pose_from_xyz_yaw
from tests.agent.arm.test_task_planner import block


@pytest.mark.parametrize("distance", (0.08, 0.10))
def test_closing_fingers_do_not_come_down_on_what_lies_beside(distance):
    """The tips of wide open fingers move down by 1 cm while they close."""
    clouds = [block((0.45, 0.0), (0.065, 0.065, 0.06))]
    clouds += [block((0.45, y), (0.16, 0.05, 0.02)) for y in (-distance, distance)]
    with PlanningScene(np.random.default_rng(0)) as scene:
        planner = ObjectPlanner(scene, np.random.default_rng(1))
        plan, reason = planner.object(0, clouds, [], [0.0] * 3, pose_from_xyz_yaw(0.0, -0.3, 0.0, 0.0))
        assert plan is not None, reason
        planner.set_out(clouds, [], [0.0] * 3)
        scene.remove_obstacle(0)
        for angle in np.linspace(plan.grasp.opening, plan.grasp.closing, 20):
            scene.set_fingers([angle] * 3)
            assert not scene.collides(plan.approach[-1], 0.0, floor=TOUCHING), angle

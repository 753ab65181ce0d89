"""Grasps that failed are remembered on the object, wherever it is moved."""

from types import SimpleNamespace

import numpy as np
import pytest

from agent.arm.grasps import Grasp, hand_pose
from agent.arm.placement_rules import PlacementRules
from agent.arm.work_planner import WorkPlanner
from structdiffusion.completion.surface import completed_scene
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TabletopWorld


@pytest.fixture
def work():
    """Return a function that makes the planner of the work on one thing, and the eyes that it uses."""

    def made(kind):
        with TabletopWorld([procedural_object(kind, 0)], [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0)]) as world:
            scene = completed_scene(world.observe(np.random.default_rng(0)))
        cloud = np.asarray(scene.objects[0].points, dtype=np.float64)
        eyes = SimpleNamespace(scene=scene, count=1, motions=[np.eye(4)], gone=set(), unclear=set(), clouds=[cloud])
        eyes.solid = lambda index: transform_points(eyes.motions[index], cloud)
        return WorkPlanner(eyes, SimpleNamespace(rules=PlacementRules()), [Arrangement(np.eye(4)[None])], 0, None), eyes

    return made


def grasp_of(pose):
    return Grasp(pose, 0.05, 0.5, 0.8, "across", 1.0)


def test_a_grasp_that_failed_is_avoided_where_the_object_is_now(work):
    planner, eyes = work("box")
    grasp = grasp_of(hand_pose((0.4, 0.0, 0.1), 0.3))
    moved = pose_from_xyz_yaw(0.1, 0.05, 0.0, 0.8)
    taken_along = grasp_of(moved @ grasp.world_from_ee)
    planner.remember_failed(0, grasp)
    assert planner.has_failed(0, grasp) and not planner.has_failed(0, taken_along)
    eyes.motions[0] = moved
    assert planner.has_failed(0, taken_along) and not planner.has_failed(0, grasp)


@pytest.mark.parametrize("kind, alike", [("can", True), ("box", False)])
def test_what_slips_off_something_round_slips_from_every_side(work, kind, alike):
    planner, _ = work(kind)
    planner.remember_failed(0, grasp_of(hand_pose((0.4, 0.0, 0.1), 0.3)))
    assert planner.has_failed(0, grasp_of(hand_pose((0.4, 0.0, 0.1), 1.3))) == alike
    assert not planner.has_failed(0, grasp_of(hand_pose((0.4, 0.0, 0.12), 0.3)))

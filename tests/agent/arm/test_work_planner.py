"""Grasps that failed are remembered on the object, wherever it is moved."""

from types import SimpleNamespace

import numpy as np

from agent.arm.grasps import Grasp, hand_pose
from agent.arm.placement_rules import PlacementRules
from agent.arm.work_planner import WorkPlanner
from structdiffusion.completion.surface import completed_scene
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TabletopWorld


def test_a_grasp_that_failed_is_avoided_where_the_object_is_now():
    with TabletopWorld([procedural_object("box", 0)], [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0)]) as world:
        scene = completed_scene(world.observe(np.random.default_rng(0)))
    eyes = SimpleNamespace(
        scene=scene, count=1, motions=[np.eye(4)], gone=set(), unclear=set(),
        clouds=[np.asarray(scene.objects[0].points, dtype=np.float64)],
    )  # fmt: skip
    work = WorkPlanner(eyes, SimpleNamespace(rules=PlacementRules()), [Arrangement(np.eye(4)[None])], 0, None)
    grasp = Grasp(hand_pose((0.4, 0.0, 0.1), 0.3), 0.05, 0.5, 0.8, "across", 1.0)
    moved = pose_from_xyz_yaw(0.1, 0.05, 0.0, 0.8)
    taken_along = Grasp(moved @ grasp.world_from_ee, 0.05, 0.5, 0.8, "across", 1.0)
    work.remember_failed(0, grasp)
    assert work.has_failed(0, grasp) and not work.has_failed(0, taken_along)
    eyes.motions[0] = moved
    assert work.has_failed(0, taken_along) and not work.has_failed(0, grasp)

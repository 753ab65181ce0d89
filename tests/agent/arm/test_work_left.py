"""What is left of a build is planned by what the camera has measured of what stands."""

from types import SimpleNamespace

import numpy as np
import pytest

from agent.arm.eyes import Eyes
from agent.arm.placement_rules import PlacementRules
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.work_left import LARGEST_CORRECTION
from agent.arm.work_planner import Step, WorkPlanner
from structdiffusion.completion.surface import completed_scene
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TABLE, TabletopWorld

GOAL = (0.5, 0.1)


@pytest.fixture
def stack():
    """Two blocks of which one is to stand on the other, and a function that puts the lower one beside its goal."""
    models = [procedural_object("block", index) for index in range(2)]
    height = models[0].height
    with TabletopWorld(models, [pose_from_xyz_yaw(0.35, y, 0.0, 0.0) for y in (-0.2, -0.3)]) as world:
        world.settle()
        goals = np.array([pose_from_xyz_yaw(*GOAL, z, 0.0) for z in (0.0, height)])
        motions = goals @ np.linalg.inv(np.array(world.poses()))
        scene = world.observe(np.random.default_rng(0))
        eyes = Eyes(world, SimulatedArm(world.client), scene, completed_scene(scene), np.random.default_rng(1))
        work = WorkPlanner(eyes, SimpleNamespace(rules=PlacementRules()), [Arrangement(motions)], 0, None)

        def put(x, y):
            world.set_pose(0, pose_from_xyz_yaw(GOAL[0] + x, GOAL[1] + y, 0.0, 0.0))
            world.settle()
            eyes.look({0: motions[0]})
            work.watch.place(0, motions[0], TABLE)
            work.count_placement(0, False, False)

        yield work, motions, put


def test_the_next_one_goes_over_the_measured_place_of_the_last(stack):
    work, motions, put = stack
    np.testing.assert_array_equal(work.goal(1), motions[1])
    put(0.004, -0.004)  # less than what counts as moved
    off = work.goal(1)[:3, 3] - motions[1][:3, 3]
    np.testing.assert_allclose(off, (0.004, -0.004, 0.0), atol=0.0025)
    put(0.0, 0.03)
    assert np.linalg.norm(work.goal(1)[:2, 3] - motions[1][:2, 3]) == pytest.approx(LARGEST_CORRECTION)


@pytest.mark.parametrize("off, left", [(0.01, {1}), (0.03, {0, 1})])
def test_what_stands_too_far_off_is_placed_again_before_anything_is_put_onto_it(stack, off, left):
    work, _, put = stack
    put(0.0, off)
    assert work._not_done() == left


def test_nothing_is_put_onto_what_was_only_set_aside(stack):
    work, _, put = stack
    put(0.0, 0.0)
    assert work.missing_support(Step(1)) == ""
    work.count_placement(0, aside=True, uprighted=False)
    assert work.missing_support(Step(1)).endswith("on which it was to stand, is not in place")

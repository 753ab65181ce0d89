"""Poses of known bodies from the points of a picture."""

import math

import numpy as np
import pytest

from agent.arm.registration import explained, fit_together, free_turns, guesses_from_points, judge
from agent.arm.sight import Sight
from agent.arm.tracked_shape import tracked_shape
from structdiffusion.geometry import pose_from_xyz_yaw, yaw_of
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld

PLACES = [pose_from_xyz_yaw(0.4, 0.1, 0.0, 0.3), pose_from_xyz_yaw(0.5, -0.15, 0.0, 0.0)]


@pytest.fixture(scope="module")
def seen():
    """The shapes of a box and a mug, and a picture of both."""
    rng = np.random.default_rng(0)
    with TabletopWorld([procedural_object("box", 0), procedural_object("mug", 1)], PLACES) as world:
        scene = world.observe(rng)
        shapes = [tracked_shape(cloud, scene.world_from_camera) for cloud in scene.objects]
        return shapes, Sight(world.look(rng), Table())


def test_fits_from_near_guesses(seen):
    shapes, sight = seen
    offset = pose_from_xyz_yaw(0.012, -0.01, 0.0, 0.0)
    guesses = [offset @ shape.world_from_shape @ pose_from_xyz_yaw(0, 0, 0, 0.2) for shape in shapes]
    fits = fit_together(sight, shapes, guesses, [free_turns(*each) for each in zip(shapes, guesses)])
    for fit, shape in zip(fits, shapes):
        assert np.linalg.norm((fit.world_from_shape - shape.world_from_shape)[:3, 3]) < 0.004
        assert abs(yaw_of(fit.world_from_shape)) < 0.06 and fit.residual < 0.003 and fit.evidence.share > 0.9
    left = ~explained(sight, shapes, [fit.world_from_shape for fit in fits])
    assert left.mean() < 0.05


def test_guesses_from_nothing_but_points(seen):
    shapes, sight = seen
    shape = shapes[1]
    middle = shape.world_from_shape[:2, 3]
    points = sight.points[np.linalg.norm(sight.points[:, :2] - middle, axis=1) < 0.09]
    far = pose_from_xyz_yaw(0.0, 0.3, 0.0, 0.0) @ shape.world_from_shape
    guesses = guesses_from_points(shape, points, far, lying=False, count=3)
    assert min(np.linalg.norm(guess[:2, 3] - middle) for guess in guesses) < 0.015
    assert all(guess[2, 2] == pytest.approx(1.0) for guess in guesses)
    assert min(abs(yaw_of(guess)) for guess in guesses) < math.radians(31)


def test_judging_does_not_move(seen):
    shapes, sight = seen
    fit = judge(sight, shapes[0], shapes[0].world_from_shape)
    assert np.array_equal(fit.world_from_shape, shapes[0].world_from_shape) and len(fit.points) > 100
    away = judge(sight, shapes[0], pose_from_xyz_yaw(0.0, 0.25, 0.0, 0.0) @ shapes[0].world_from_shape)
    assert not len(away.points) and math.isinf(away.residual)

"""What one picture says about a supposed body."""

from dataclasses import replace

import numpy as np
import pytest

from agent.arm.sight import Sight, of_palette
from agent.arm.tracked_shape import tracked_shape
from structdiffusion.geometry import pose_from_xyz_yaw, raised
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld


@pytest.fixture(scope="module")
def can():
    """A can's shape, and a picture of it."""
    rng = np.random.default_rng(0)
    with TabletopWorld([procedural_object("can", 0)], [pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.0)]) as world:
        scene = world.observe(rng)
        return tracked_shape(scene.objects[0], scene.world_from_camera), world.look(rng)


def test_what_stands_on_the_table_is_found(can):
    shape, picture = can
    sight = Sight(picture, Table())
    middle = shape.world_from_shape[:2, 3]
    assert np.quantile(np.linalg.norm(sight.points[:, :2] - middle, axis=1), 0.97) < shape.radius + 0.01
    assert of_palette(sight.features, shape.palette).mean() > 0.95
    assert len(sight.points) == len(sight.pixels) > 100


def test_evidence_is_for_against_or_none(can):
    shape, picture = can
    sight, there = Sight(picture, Table()), shape.world_from_shape
    assert sight.evidence(shape, there).share > 0.95
    beside = pose_from_xyz_yaw(0.0, 0.2, 0.0, 0.0) @ there
    assert sight.evidence(shape, beside).share == 0.0 and sight.evidence(shape, beside).refuted_share > 0.9
    assert sight.empty(shape, beside).any()
    below = sight.evidence(shape, raised(there, -0.3))
    assert below.supported + below.refuted < 0.1 * below.hidden  # behind the table's surface


def test_another_color_is_evidence_against(can):
    shape, picture = can
    blue = replace(picture, color=np.broadcast_to(np.array([0, 0, 255], dtype=np.uint8), picture.color.shape))
    assert Sight(blue, Table()).evidence(shape, shape.world_from_shape).share == 0.0


def test_a_picture_of_nothing(can):
    shape, picture = can
    nothing = np.full_like(picture.points, np.nan)
    sight = Sight(replace(picture, depth=nothing[..., 0], points=nothing), Table())
    assert not len(sight.points)
    evidence = sight.evidence(shape, shape.world_from_shape)
    assert evidence.supported == evidence.refuted == 0 < evidence.hidden

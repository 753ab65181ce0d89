"""Bodies as the tracker knows them, from what the camera saw of procedural objects."""

import numpy as np
import pytest

from agent.arm.tracked_shape import SAMPLES, color_features, tracked_shape
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import ObjectCloud
from structdiffusion.simulation.world import TabletopWorld


def seen(kind, index=0):
    """The shape of an object in the middle of the table, and its model."""
    model = procedural_object(kind, index)
    with TabletopWorld([model], [pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.4)]) as world:
        scene = world.observe(np.random.default_rng(0))
    return tracked_shape(scene.objects[0], scene.world_from_camera), model


@pytest.mark.parametrize("kind, rounded", [("can", True), ("cup", True), ("box", False), ("mug", False)])
def test_a_shape_is_what_was_seen(kind, rounded):
    shape, model = seen(kind)
    assert shape.rounded == rounded and shape.height == pytest.approx(model.height, abs=0.004)
    assert np.linalg.norm(shape.world_from_shape[:2, 3] - (0.45, 0.0)) < 0.02 and shape.world_from_shape[2, 3] == 0.0
    assert SAMPLES / 3 < len(shape.samples) <= 2 * SAMPLES
    assert np.allclose(np.linalg.norm(shape.normals, axis=1), 1.0, atol=1e-5)
    assert np.abs(shape.distances(shape.samples)[0]).max() < 0.002
    own = color_features(np.round(255 * np.array(model.color)).astype(np.uint8))
    assert np.linalg.norm(shape.palette - own, axis=1).min() < 0.03


def test_distances_have_a_sign_and_know_edges():
    shape, _ = seen("block")
    side, top = np.abs(shape.samples[:, :2]).max(), shape.height
    points = np.array([[0.0, 0.0, top / 2], [0.0, 0.0, top + 0.01], [side + 0.1, 0.0, top]])
    inside, above, beside = shape.distances(points)[0]
    assert inside < -0.01 and above == pytest.approx(0.01, abs=0.002) and beside > 0.05


def test_a_point_of_an_inner_wall_counts_from_the_inside():
    shape, _ = seen("bowl")
    eye = np.array([0.0, 0.0, 1.0])
    wall = shape.samples[(shape.normals[:, 2] > 0.2) & (shape.samples[:, 2] > shape.height / 2)]
    assert len(wall) > 20
    behind = wall - 0.006 * np.array([0.0, 0.0, 1.0])  # just under the wall, as seen from above
    distance, plane = shape.distances_seen(behind, eye)
    assert np.median(distance) < 0.0 and (shape.planes[plane] @ np.append(eye, 1.0) > 0).mean() > 0.9


def test_flat_and_colorless_clouds_have_a_shape():
    grid = np.stack(np.meshgrid(np.linspace(-0.03, 0.03, 20), np.linspace(-0.01, 0.01, 10)), axis=-1).reshape(-1, 2)
    points = np.column_stack((grid + (0.4, 0.1), np.zeros(len(grid)))).astype(np.float32)
    shape = tracked_shape(ObjectCloud("sheet", "sheet", points), None)
    assert len(shape.samples) and not len(shape.palette) and shape.height < 0.005

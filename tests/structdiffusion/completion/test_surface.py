import numpy as np
import pytest

from structdiffusion.completion.surface import completed_points, completed_scene
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import ObjectCloud
from structdiffusion.simulation.world import TabletopWorld


@pytest.mark.parametrize("kind", ["bottle", "can", "box"])
def test_the_middle_of_a_completed_cloud_is_that_of_the_object(kind):
    """The seen side alone is up to a radius nearer to the camera."""
    model = procedural_object(kind, 3)
    with TabletopWorld([model], [pose_from_xyz_yaw(0.45, 0.1, 0.0, 0.4)]) as world:
        scene = world.observe(np.random.default_rng(0))
        true = world.pose(0)[:2, 3]
    points = completed_scene(scene).objects[0].points
    seen = scene.objects[0].points
    np.testing.assert_array_equal(points[: len(seen)], seen)
    middles = [0.5 * (each[:, :2].min(axis=0) + each[:, :2].max(axis=0)) for each in (seen, points)]
    off = [np.linalg.norm(middle - true) for middle in middles]
    assert off[1] < 0.008 and off[1] < off[0] + 0.002


def test_without_a_camera_nothing_is_hidden():
    model = procedural_object("can", 0)
    with TabletopWorld([model], [pose_from_xyz_yaw(0.45, 0.1, 0.0, 0.0)]) as world:
        cloud = world.observe(np.random.default_rng(0)).objects[0]
    assert len(completed_points(cloud, None)) == len(cloud.points)


@pytest.mark.parametrize("yaw", np.deg2rad([0, 20, 45, 70]))
@pytest.mark.parametrize("size", [(0.08, 0.08), (0.12, 0.06)])
def test_two_faces_of_a_covered_box_tell_which_way_it_stands(yaw, size):
    """Around an equal-sided corner, a rectangle across it is as small as the one along its faces."""
    steps = np.arange(0.0, 1.0, 0.02)
    faces = [(share * size[0], 0.0, z) for share in steps for z in 0.08 * steps]
    faces += [(0.0, share * size[1], z) for share in steps for z in 0.08 * steps]
    noise = np.random.default_rng(0).normal(0.0, 0.001, (len(faces), 3))
    points = transform_points(pose_from_xyz_yaw(0.45, 0.1, 0.0, yaw), np.array(faces) + noise)
    cloud = ObjectCloud("box", "box", points.astype(np.float32))
    camera = pose_from_xyz_yaw(-0.5, 0.0, 1.0, 0.0)
    body = transform_points(
        np.linalg.inv(pose_from_xyz_yaw(0.45, 0.1, 0.0, yaw)), completed_points(cloud, camera, covered=True)
    )
    np.testing.assert_allclose(np.ptp(body[:, :2], axis=0), size, atol=0.01)

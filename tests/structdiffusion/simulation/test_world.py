import math
import subprocess
import sys
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.objects import rigid_body
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.rigid_body import mass_properties, shape_file, solid_content
from structdiffusion.objects.solids import assemble, box, frustum, shell
from structdiffusion.simulation.depth_camera import DepthCamera, measured_depth
from structdiffusion.simulation.visible_points import ObservationError
from structdiffusion.simulation.world import TABLE, TabletopWorld

ROOT = Path(__file__).parents[3]


def solid(category: str, *parts: np.ndarray, density: float = 600.0) -> ObjectModel:
    return assemble(
        category,
        category,
        parts,
        density=density,
        friction=0.6,
        color=(0.8, 0.2, 0.2),
        source="procedural",
        rng=np.random.default_rng(0),
    )


def block(length: float, width: float, height: float, category: str = "block") -> ObjectModel:
    return solid(category, box(length, width, 0.0, height))


def vessel(radius: float = 0.05, height: float = 0.09) -> ObjectModel:
    return solid("cup", frustum(radius, radius, 0, 0.005), *shell([(radius, 0.0), (radius, height)], 0.005))


def at(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    return pose_from_xyz_yaw(x, y, z, yaw)


def test_mass_properties_of_a_box_and_of_its_halves():
    whole = mass_properties([box(0.2, 0.1, 0.0, 0.06, x=0.3)], 1.2)
    halves = mass_properties([box(0.1, 0.1, 0.0, 0.06, x=0.25), box(0.1, 0.1, 0.0, 0.06, x=0.35)], 1.2)
    for found in (whole, halves):
        assert found.volume == pytest.approx(0.2 * 0.1 * 0.06)
        np.testing.assert_allclose(found.object_from_inertial[:3, 3], (0.3, 0.0, 0.03), atol=1e-9)
        expected = 0.1 * np.array([0.1**2 + 0.06**2, 0.2**2 + 0.06**2, 0.2**2 + 0.1**2])
        np.testing.assert_allclose(np.sort(found.inertia), np.sort(expected), rtol=1e-9)
        assert np.linalg.det(found.object_from_inertial[:3, :3]) == pytest.approx(1.0)


def test_shape_files_are_named_by_content_and_the_oldest_go(monkeypatch):
    monkeypatch.setattr(rigid_body, "_shapes", OrderedDict())
    monkeypatch.setattr(rigid_body, "_MOST_SHAPES", 2)
    heights = (0.91, 0.92, 0.91, 0.93)
    files = [shape_file(solid_content([box(0.1, 0.1, 0, height)])) for height in heights]
    assert files[0] == files[2] and len(set(files)) == 3
    assert [path.exists() for path in files] == [True, False, True, True]  # what was used last stays
    assert shape_file(solid_content([box(0.1, 0.1, 0, 0.92)])).exists()  # and what went comes back


def test_shape_files_go_with_their_process():
    program = (
        "from structdiffusion.objects.rigid_body import shape_file, solid_content; import numpy as np; "
        "print(shape_file(solid_content([np.eye(4)[:, :3]])))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith(".obj") and not Path(done.stdout.strip()).parent.exists()


def test_poses_are_those_of_the_object_frame():
    lopsided = solid("lamp", box(0.12, 0.08, 0.0, 0.02), box(0.02, 0.03, 0.02, 0.2, x=0.04, y=-0.02))
    tilted = at(0.4, 0.1, 0.3, 0.7)
    tilted[:3, :3] = tilted[:3, :3] @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    with TabletopWorld([lopsided, lopsided], [tilted, at(0.5, -0.2, 0.0, 2.0)]) as world:
        np.testing.assert_allclose(world.pose(0), tilted, atol=1e-6)
        np.testing.assert_allclose(world.poses()[1], at(0.5, -0.2, 0.0, 2.0), atol=1e-6)
        corners = transform_points(tilted, np.concatenate(lopsided.hulls))
        lowest = corners[:, 2].min()
        assert world.clearances(0, reach=1.0)[TABLE] == pytest.approx(lowest, abs=1e-4)
        world.step(0.5)
        np.testing.assert_allclose(world.pose(1), at(0.5, -0.2, 0.0, 2.0), atol=1e-3)


def test_a_vessel_of_convex_parts_stays_hollow():
    with TabletopWorld([vessel(), block(0.02, 0.02, 0.03)], [at(0.45, 0.0), at(0.45, 0.01, 0.12)]) as world:
        world.settle()
        dropped = world.pose(1)
        assert dropped[2, 3] == pytest.approx(0.005, abs=0.002)
        assert tilt_between(dropped, np.eye(4)) < math.radians(3)
        assert world.supports() == [(TABLE,), (0,)]


def test_clearances_are_right_to_a_tenth_of_a_millimetre():
    models = [block(0.1, 0.1, 0.05), block(0.06, 0.06, 0.04)]
    with TabletopWorld(models, [at(0.4, 0.0), at(0.4, 0.085)]) as world:
        assert world.clearances(1) == pytest.approx({0: 0.005, TABLE: 0.0}, abs=1e-4)
        world.set_pose(1, at(0.4, 0.0, 0.047))
        assert world.clearances(1) == pytest.approx({0: -0.003}, abs=1e-4)


def test_things_beyond_the_edge_fall_and_cans_do_not_roll_forever():
    can = solid("can", frustum(0.033, 0.033, 0.0, 0.1))
    lying = at(0.45, 0.0, 0.033)
    lying[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    with TabletopWorld([block(0.05, 0.05, 0.05), can], [at(0.45, 0.48), lying]) as world:
        world.step(1.5)
        assert world.centers_of_mass()[0, 2] < -0.1
        assert world.speeds()[0][1] < 0.01


def test_what_is_held_stays_until_it_is_freed():
    with TabletopWorld([block(0.05, 0.05, 0.05)] * 2, [at(0.4, 0.0, 0.2), at(0.4, 0.2, 0.2)]) as world:
        world.hold(0)
        world.settle(0.5)
        assert world.held == [0] and np.allclose(world.pose(0), at(0.4, 0.0, 0.2)) and world.pose(1)[2, 3] < 0.01
        world.reorder([1, 0])
        assert world.held == [1]
        world.free(world.bodies[1])
        world.settle(0.5)
        assert world.held == [] and world.pose(1)[2, 3] < 0.01


def test_worlds_live_side_by_side():
    with TabletopWorld([block(0.05, 0.05, 0.05)], [at(0.45, 0.0)]) as first, TabletopWorld() as second:
        assert first.client != second.client
        assert (len(first.poses()), len(second.poses())) == (1, 0)
    with pytest.raises(ValueError, match="1 objects need as many poses, got 0"):
        TabletopWorld([block(0.05, 0.05, 0.05)], [])


def test_exact_pictures_lie_on_true_surfaces():
    size = np.array([0.06, 0.1, 0.08])
    pose = at(0.5, 0.2, 0.0, 0.4)
    with TabletopWorld([block(*size)], [pose]) as world:
        image = world.look()
        seen = image.points[image.segmentation == world.bodies[0]]
        local = transform_points(np.linalg.inv(pose), seen) - (0, 0, size[2] / 2)
        # Distance to the surface of a box, from inside and outside alike.
        off = np.abs(np.abs(local) - size / 2)
        assert len(seen) > 500
        assert off.min(axis=1).max() < 0.002
        assert (np.abs(local) < size / 2 + 0.002).all()
        top = image.points[image.segmentation == world.table_body]
        assert np.percentile(np.abs(top[:, 2]), 95) < 0.001
        assert top[:, 1].min() == pytest.approx(-0.45, abs=0.004)
        assert top[:, 1].max() == pytest.approx(0.45, abs=0.004)


def test_the_middle_and_left_of_the_picture():
    with TabletopWorld() as world:
        camera, image = world.camera, world.look()
        middle = image.points[239:241, 319:321].mean(axis=(0, 1))
        np.testing.assert_allclose(middle, (0.45, 0.0, 0.0), atol=0.002)
        left, far = camera.pixels(np.array([[0.45, 0.3, 0.0], [0.7, 0.0, 0.0]]))
        assert left[0] < 320 and left[1] == pytest.approx(240)
        assert far[1] < 240 and far[0] == pytest.approx(320)
        # The whole table is in view.
        corners = camera.pixels(np.array([[x, y, 0.1] for x in (0.18, 0.72) for y in (-0.45, 0.45)]))
        assert (corners > 0).all() and (corners < (camera.width, camera.height)).all()
        np.testing.assert_allclose(camera.pixels(image.points[200, 250]), (250.5, 200.5), atol=1e-6)


def test_noise_grows_with_distance_and_drops_pixels():
    rng = np.random.default_rng(0)
    near, far = (measured_depth(np.full((200, 200), d), rng) - d for d in (0.4, 1.4))
    assert np.nanstd(near) == pytest.approx(0.0012, rel=0.05)
    assert np.nanstd(far) == pytest.approx(0.0031, rel=0.05)
    assert np.isnan(near).mean() == pytest.approx(0.01, abs=0.003)


def test_what_is_measured_without_shadows_is_what_a_picture_measures():
    models = [procedural_object(kind, 0) for kind in ("mug", "box")]
    with TabletopWorld(models, [pose_from_xyz_yaw(0.45, y, 0.0, 0.3) for y in (-0.05, 0.05)]) as world:
        picture = world.look(np.random.default_rng(1))
        depth, points = world.measure(np.random.default_rng(1))
        np.testing.assert_array_equal(depth, picture.depth)
        np.testing.assert_array_equal(points, picture.points)


def test_observe_gives_a_named_partial_scene():
    mug = procedural_object("mug", 0)
    models = [mug, mug, procedural_object("bottle", 0)]
    poses = [at(0.4, 0.2), at(0.4, -0.2), at(0.6, 0.0)]
    with TabletopWorld(models, poses) as world:
        scene = world.observe(np.random.default_rng(1), distractors=[2])
        again = world.observe(np.random.default_rng(1), distractors=[2])
    assert [cloud.name for cloud in scene.objects] == ["mug 1", "mug 2"]
    assert [cloud.name for cloud in scene.distractors] == ["bottle"]
    for cloud, pose in zip(scene.objects, poses):
        assert cloud.points.dtype == np.float32 and cloud.colors.shape == cloud.points.shape
        assert 200 < len(cloud.points) <= 1024
        assert np.linalg.norm(cloud.centroid[:2] - pose[:2, 3]) < 0.04
        assert cloud.points[:, 2].min() > -0.02 and cloud.points[:, 2].max() < mug.height + 0.02
    np.testing.assert_array_equal(scene.objects[0].points, again.objects[0].points)
    assert scene.color.shape == (480, 640, 3)


def test_an_object_that_hides_is_named():
    models = [block(0.03, 0.03, 0.03, "die"), vessel(0.05, 0.09)]
    over = at(0.45, 0.0, 0.09)
    over[:3, :3] = np.diag((1.0, -1.0, -1.0))
    with TabletopWorld(models, [at(0.45, 0.0), over]) as world:
        with pytest.raises(ObservationError, match="fewer than 20 points of the die"):
            world.observe(np.random.default_rng(0))
        scene = world.observe(np.random.default_rng(0), objects=[1], distractors=[0])
        assert [cloud.name for cloud in scene.objects] == ["cup"] and scene.distractors == ()


def test_pictures_from_every_side():
    with TabletopWorld([block(0.1, 0.1, 0.1)], [at(0.45, 0.2)]) as world:
        for view in ("robot", "beside", "top", "opposite"):
            assert world.picture(view, width=160, height=120).shape == (120, 160, 3)
        left = {view: _column_of_red(world.picture(view)) for view in ("robot", "beside")}
        with pytest.raises(ValueError, match="unknown view 'side'; legal views: robot, beside, top, opposite"):
            world.picture("side")
    with TabletopWorld([block(0.1, 0.1, 0.1)], [at(0.45, -0.2)]) as world:
        for view, column in left.items():  # left is left where the speaker looks from
            assert column < _column_of_red(world.picture(view)) - 50


def _column_of_red(picture: np.ndarray) -> float:
    return float((picture[..., 0].astype(int) - picture[..., 2] > 80).nonzero()[1].mean())


def test_a_camera_of_another_size_sees_the_same_points():
    small = DepthCamera(width=320, height=240)
    with TabletopWorld(camera=small) as world:
        points = world.look().points
        np.testing.assert_allclose(points[119:121, 159:161].mean(axis=(0, 1)), (0.45, 0, 0), atol=0.003)


def test_objects_counted_anew_keep_their_places():
    lopsided = solid("lamp", box(0.12, 0.08, 0.0, 0.02), box(0.02, 0.03, 0.02, 0.2, x=0.04, y=-0.02))
    models = [block(0.06, 0.06, 0.06), lopsided, vessel()]
    poses = [at(0.3, -0.2), at(0.45, 0.0, 0.0, 0.8), at(0.6, 0.2)]
    with TabletopWorld(models, poses) as world:
        bodies = list(world.bodies)
        world.reorder([1, 2, 0])
        assert world.bodies == [bodies[1], bodies[2], bodies[0]] and world.models[2] is models[0]
        np.testing.assert_allclose(world.poses(), [poses[1], poses[2], poses[0]], atol=1e-6)
        world.set_pose(0, at(0.3, 0.3))
        np.testing.assert_allclose(world.pose(0), at(0.3, 0.3), atol=1e-6)
        assert [cloud.name for cloud in world.observe(np.random.default_rng(0)).objects] == ["lamp", "cup", "block"]
        for wrong in ([0, 1], [0, 0, 1], [1, 2, 3]):
            with pytest.raises(ValueError, match="not a permutation of 3 objects"):
                world.reorder(wrong)

"""The frame of a cloud: organised clouds give their camera exactly, others show what is up."""

import math

import numpy as np
import pytest

from agent.recordings.cloud_frame import camera_of_picture, frame_of_cloud, table_height
from structdiffusion.geometry import transform_points


def look_at(place, target):
    """The pose (4, 4) of an optical frame at `place` that looks at `target`, upright."""
    ahead = np.subtract(target, place) / np.linalg.norm(np.subtract(target, place))
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array((0.0, -1.0, 0.0))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.column_stack((right, np.cross(ahead, right), ahead)), place
    return pose


def picture_of_table(world_from_camera, height=60, width=80, noise=0.0, table=0.0):
    """A table of 1.2 m x 1.2 m at a height with two boxes on it, seen by a pinhole camera: (H, W, 3), optical frame."""
    rows, columns = np.mgrid[:height, :width]
    focal = 70.0
    rays = np.stack(((columns - width / 2) / focal, (rows - height / 2) / focal, np.ones_like(rows)), axis=-1)
    in_world = rays @ world_from_camera[:3, :3].T
    eye = world_from_camera[:3, 3]
    depth = np.full((height, width), np.inf)
    boxes = [
        ((-0.6, 0.6), (-0.6, 0.6), table),
        ((-0.2, -0.05), (-0.1, 0.1), table + 0.1),
        ((0.1, 0.2), (0.1, 0.3), table + 0.2),
    ]
    for (x0, x1), (y0, y1), top in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (top - eye[2]) / in_world[..., 2]
        hit = eye + t[..., None] * in_world
        inside = (t > 0) & (hit[..., 0] > x0) & (hit[..., 0] < x1) & (hit[..., 1] > y0) & (hit[..., 1] < y1)
        depth = np.where(inside & (t < depth), t, depth)
    depth[~np.isfinite(depth)] = np.nan
    if noise:
        depth = depth + np.random.default_rng(0).normal(0, noise, depth.shape)
    return rays * depth[..., None]


VIEWS = [look_at((-0.9, 0.2, 0.8), (0, 0, 0)), look_at((0.6, -0.8, 0.6), (0, 0.1, 0)), look_at((0, 0, 1.2), (0, 0, 0))]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_an_organised_cloud_gives_its_camera(view, noise):
    points = transform_points(view, picture_of_table(view, noise=noise).reshape(-1, 3)).reshape(60, 80, 3)
    pose = camera_of_picture(points)
    assert np.linalg.norm(pose[:3, 3] - view[:3, 3]) < (1e-6 if not noise else 0.02)
    turn = math.acos(min(1.0, (np.trace(pose[:3, :3].T @ view[:3, :3]) - 1) / 2))
    assert turn < (1e-4 if not noise else 0.02)
    found = frame_of_cloud(points, "base_link")
    assert found.exact and "'base_link'" in found.note


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_a_cloud_in_its_optical_frame_is_left_alone(view, noise):
    points = picture_of_table(view, noise=noise)
    assert frame_of_cloud(points) is None
    assert frame_of_cloud(points.reshape(1, -1, 3)) is None


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("table", [0.0, 0.73, -0.2])
def test_an_unorganised_cloud_with_z_up_is_told_by_what_stands_on_its_table(view, table):
    shifted = view.copy()
    shifted[2, 3] += table
    points = transform_points(shifted, picture_of_table(shifted, noise=0.002, table=table).reshape(-1, 3))
    found = frame_of_cloud(points[None], "world")
    assert not found.exact and "z up" in found.note and f"z {table:.2f}"[:-1] in found.note
    seen = transform_points(np.linalg.inv(found.cloud_from_camera), points[np.isfinite(points).all(axis=1)])
    assert (seen[:, 2] > 0).mean() > 0.99
    level = found.cloud_from_camera[:3, :3]
    assert np.linalg.det(level) == pytest.approx(1.0) and level[2, 1] < 0  # the picture's down is down


def test_a_floor_below_does_not_pass_for_what_carries_the_objects():
    rng = np.random.default_rng(0)
    z = np.concatenate((rng.normal(0, 0.003, 9000), rng.normal(0.72, 0.003, 4000), rng.uniform(0.72, 0.85, 800)))
    points = np.column_stack((rng.uniform(-0.5, 0.5, (len(z), 2)), z))
    assert table_height(points) == pytest.approx(0.72, abs=0.02)


@pytest.mark.parametrize("degrees", [12, 25, 45])
def test_a_slice_of_a_steep_table_is_not_level(degrees):
    rng = np.random.default_rng(0)
    flat = np.column_stack((rng.uniform(-0.15, 0.15, (8000, 2)), rng.normal(0, 0.002, 8000)))
    mug = np.column_stack((rng.normal(0, 0.02, (3000, 2)), rng.uniform(0, 0.1, 3000)))
    angle = math.radians(degrees)
    turn = np.array(((1, 0, 0), (0, math.cos(angle), -math.sin(angle)), (0, math.sin(angle), math.cos(angle))))
    assert table_height(np.concatenate((flat, mug)) @ turn.T + (0, 0, 0.8)) is None


def test_a_cloud_in_the_frame_of_a_cameras_body_is_turned():
    view = VIEWS[0]
    optical = picture_of_table(view).reshape(-1, 3)
    body = optical[:, [2, 0, 1]] * (1, -1, -1)
    tilted = body[None]
    assert np.nanmin(tilted[..., 2]) < 0
    found = frame_of_cloud(tilted, "camera_link")
    back = transform_points(np.linalg.inv(found.cloud_from_camera), body)
    np.testing.assert_allclose(back, optical, atol=1e-9)


def test_too_few_points_say_nothing():
    assert frame_of_cloud(np.full((4, 5, 3), np.nan)) is None

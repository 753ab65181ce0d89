import math

import numpy as np
import pytest
import torch

from structdiffusion.geometry import (
    HEADING_OF_ROTATION,
    lengths,
    matrix_from_quaternion,
    pose_from_position_quaternion,
    pose_from_xyz_rpy,
    pose_from_xyz_yaw,
    quaternion_from_matrix,
    tilt_between,
    transform_points,
    wrap_angle,
    yaw_of,
)
from structdiffusion.rotations import rotation_from_6d, rotation_to_6d


def test_any_six_numbers_give_a_rotation():
    six = torch.randn(500, 6, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    matrix = rotation_from_6d(six)
    eye = torch.eye(3, dtype=torch.float64).expand(500, 3, 3)
    torch.testing.assert_close(matrix @ matrix.transpose(1, 2), eye, atol=1e-12, rtol=0)
    torch.testing.assert_close(torch.linalg.det(matrix), torch.ones(500, dtype=torch.float64))


def test_six_numbers_keep_the_rotation_and_lose_lengths_and_skew():
    generator = torch.Generator().manual_seed(1)
    matrix = rotation_from_6d(torch.randn(100, 6, generator=generator, dtype=torch.float64))
    torch.testing.assert_close(rotation_from_6d(rotation_to_6d(matrix)), matrix)
    skewed = torch.cat((3.0 * matrix[..., :, 0], 0.5 * matrix[..., :, 1] + 7.0 * matrix[..., :, 0]), dim=-1)
    torch.testing.assert_close(rotation_from_6d(skewed), matrix)


def test_quaternions_round_trip_even_for_half_turns():
    rng = np.random.default_rng(2)
    quaternions = rng.standard_normal((200, 4))
    # Half turns about each axis, where naive formulas divide by zero.
    quaternions = np.concatenate((quaternions, np.eye(4), [[1, 1, 0, 1e-9], [0, 1, -1, 0]]))
    for quaternion in quaternions:
        matrix = matrix_from_quaternion(quaternion)
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
        found = quaternion_from_matrix(matrix)
        unit = quaternion / np.linalg.norm(quaternion)
        assert abs(found @ unit) == pytest.approx(1.0, abs=1e-12)  # q and -q are the same rotation


def test_a_quaternion_turns_as_its_axis_and_angle_say():
    half = math.radians(60) / 2
    pose = pose_from_position_quaternion([1.0, 2.0, 3.0], [0.0, 0.0, math.sin(half), math.cos(half)])
    np.testing.assert_allclose(pose, pose_from_xyz_yaw(1.0, 2.0, 3.0, math.radians(60)), atol=1e-12)


def test_roll_pitch_and_yaw_turn_about_the_fixed_axes_in_that_order():
    roll, pitch, yaw = 0.4, -1.1, 2.5
    about_x = pose_from_position_quaternion([0, 0, 0], [math.sin(roll / 2), 0, 0, math.cos(roll / 2)])
    about_y = pose_from_position_quaternion([0, 0, 0], [0, math.sin(pitch / 2), 0, math.cos(pitch / 2)])
    found = pose_from_xyz_rpy([1.0, 2.0, 3.0], [roll, pitch, yaw])
    np.testing.assert_allclose(found, pose_from_xyz_yaw(1.0, 2.0, 3.0, yaw) @ about_y @ about_x, atol=1e-12)
    np.testing.assert_array_equal(pose_from_xyz_rpy([1, 2, 3], [0, 0, yaw]), pose_from_xyz_yaw(1, 2, 3, yaw))


def test_transforms_take_points_between_frames():
    world_from_cup = pose_from_xyz_yaw(0.5, 0.2, 0.1, math.pi / 2)
    np.testing.assert_allclose(transform_points(world_from_cup, np.array([[0.1, 0.0, 0.0]])), [[0.5, 0.3, 0.1]])
    points = np.random.default_rng(3).standard_normal((4, 5, 3))
    there = transform_points(world_from_cup, points)
    np.testing.assert_allclose(transform_points(np.linalg.inv(world_from_cup), there), points, atol=1e-12)


@pytest.mark.parametrize("yaw", [-3.1, -math.pi / 2, 0.0, 1.0, 3.1])
def test_yaw_and_wrapping(yaw):
    assert yaw_of(pose_from_xyz_yaw(0.1, 0.2, 0.3, yaw)) == pytest.approx(yaw)
    for turns in (-2, 1, 3):
        assert wrap_angle(yaw + 2 * math.pi * turns) == pytest.approx(yaw)


def test_headings_are_those_of_the_evaluation_protocol():
    compass = {"north": (1, 0), "west": (0, 1), "south": (-1, 0), "east": (0, -1)}
    for name, (x, y) in compass.items():
        heading = HEADING_OF_ROTATION[name]
        assert (math.cos(heading), math.sin(heading)) == pytest.approx((x, y), abs=1e-12)


def test_tilt_ignores_the_turn_about_the_vertical():
    tilt = math.radians(20)
    tilted = np.array([[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]])
    turned = pose_from_xyz_yaw(0, 0, 0, 1.3)[:3, :3] @ tilted
    assert tilt_between(turned, np.eye(3)) == pytest.approx(tilt)
    assert tilt_between(turned, turned) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("width", [1, 2, 3])
def test_lengths_are_those_of_numpy_to_the_bit(kind, width):
    vectors = np.random.default_rng(0).normal(size=(40, 50, width)).astype(kind)
    vectors[3, 4, 0] = np.nan
    found = lengths(vectors)
    assert found.dtype == kind and np.array_equal(found, np.linalg.norm(vectors, axis=-1), equal_nan=True)

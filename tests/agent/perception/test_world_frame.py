"""Where the arm is taken to stand when nothing says so: at the side from which it reaches most objects."""

import numpy as np
import pytest

from agent.perception.world_frame import base_from_camera, world_frame
from agent.recordings.recording import DepthFrame, Recording
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table

NOTHING = Recording("table", DepthFrame(np.zeros((1, 1, 3), np.float32)))  # neither tf nor a pose by hand


def frames_of(places, level_from_camera=None):
    level_from_camera = np.eye(4) if level_from_camera is None else level_from_camera
    found = world_frame(NOTHING, level_from_camera, np.array(places, float))
    level = np.column_stack((places, np.zeros(len(places))))
    world = transform_points(found.world_from_camera @ np.linalg.inv(level_from_camera), level)
    return found, world


def reached(world):
    reach = Table()
    inside = (
        (world[:, 0] >= reach.x_min - 1e-9)
        & (world[:, 0] <= reach.x_max + 1e-9)
        & (np.abs(world[:, 1]) <= reach.y_max + 1e-9)
    )
    return int(inside.sum())


def test_objects_near_each_other_are_reached_from_the_cameras_side():
    found, world = frames_of([(1.0, 0.1), (1.2, -0.2), (1.3, 0.3)])
    assert reached(world) == 3 and "camera's direction of view" in found.notes[0]
    np.testing.assert_allclose(world[1, :2] - world[0, :2], (0.2, -0.3), atol=1e-9)  # x stays the view's


@pytest.mark.parametrize("sign", [1, -1])
def test_objects_in_a_row_away_from_the_camera_are_reached_from_a_side(sign):
    places = [(0.5 + 0.2 * number, 0.02 * sign * number) for number in range(5)]
    found, world = frames_of(places)
    assert reached(world) == 5
    assert (
        "right side" in found.notes[0] and "5 of 5 objects" in found.notes[0] and "it would reach 3" in found.notes[0]
    )
    assert np.all(np.diff(world[:, 1]) < 0)  # from its right side, what is far from the camera is on the arm's right


def test_the_camera_may_stand_anywhere():
    places = np.array([(0.5, 0.0), (0.8, 0.1), (1.1, 0.0), (1.3, 0.1)])
    _, expected = frames_of(places)
    _, world = frames_of(places, pose_from_xyz_yaw(0.4, -0.3, 0.9, 0.7))
    np.testing.assert_allclose(world, expected, atol=1e-9)


def test_distances_stay_and_up_stays_up():
    rng = np.random.default_rng(0)
    for _ in range(20):
        places = rng.uniform(-0.8, 0.8, (6, 2))
        found, world = frames_of(places)
        apart = np.linalg.norm(world[:, None] - world[None], axis=2)
        np.testing.assert_allclose(apart, np.linalg.norm(places[:, None] - places[None], axis=2), atol=1e-9)
        np.testing.assert_allclose(found.world_from_camera[2, :3], (0, 0, 1), atol=1e-9)


def test_no_side_reaches_more_than_the_one_that_is_taken():
    rng = np.random.default_rng(1)
    for _ in range(20):
        places = rng.uniform(-0.6, 0.6, (7, 2))
        _, world = frames_of(places)
        for quarters in range(4):
            turned = transform_points(
                pose_from_xyz_yaw(0, 0, 0, quarters * np.pi / 2), np.column_stack((places, np.zeros(7)))
            )
            middle = (turned[:, :2].min(axis=0) + turned[:, :2].max(axis=0)) / 2
            there = turned + np.append(np.array((0.45, 0.0)) - middle, 0.0)
            clear = np.linalg.norm(there[:, :2], axis=1).min() > 0.2
            assert reached(world) >= reached(there) or not clear


def test_the_base_stands_on_no_object():
    places = [(0.0, 0.0), (0.45, 0.0), (0.5, 0.1), (0.6, -0.1), (0.9, 0.0), (1.1, 0.1), (0.4, 0.8), (0.5, -0.9)]
    _, world = frames_of(places)
    assert np.linalg.norm(world[:, :2], axis=1).min() >= 0.2 - 1e-9


def test_nothing_is_known_of_the_base_without_tf_and_pose():
    assert base_from_camera(NOTHING) is None

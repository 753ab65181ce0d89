"""Which plane is the table: between it and the floor, what is seen beside the table counts nothing."""

import numpy as np
import pytest

from agent.perception.table_plane import table_plane

# Camera frame: x right, y down, z forward. The world's: x away from the camera, z up, the camera at its origin.
CAMERA_FROM_WORLD = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
DOWN = np.deg2rad(38.0)
TABLE, FLOOR, STAND = 0.62, 1.05, 0.45  # m below the camera; the stand of an arm is higher than the table


def seen(table, stand, floor=(-3.0, 3.0)):
    """Return points (P, 3), camera frame, of a table's corner, a stand's top and side, and the floor beyond them."""
    x, y = np.meshgrid(np.linspace(-0.62, 0.62, 320), np.linspace(-0.48, 0.48, 240))
    rays = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
    pitch = np.array([
        [1.0, 0.0, 0.0],
        [0.0, np.cos(DOWN), np.sin(DOWN)],
        [0.0, -np.sin(DOWN), np.cos(DOWN)],
    ])  # fmt: skip
    ways = (rays @ pitch.T) @ CAMERA_FROM_WORLD
    away = np.full(len(ways), np.inf)
    for height, inside in ((FLOOR, lambda p: np.abs(p[:, 0]) < floor[1]), (TABLE, table), (STAND, stand)):
        with np.errstate(divide="ignore"):
            length = np.where(ways[:, 2] < 0, -height / ways[:, 2], np.inf)
        at = ways * np.where(np.isfinite(length), length, 0.0)[:, None]
        nearer = np.isfinite(length) & inside(at) & (length < away)
        away[nearer] = length[nearer]
    known = np.isfinite(away)
    return (rays * away[:, None])[known]


def corner(p):
    """A table with a corner toward the right and its far edge running away to the left."""
    turned = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
    along = p[:, :2] @ turned.T
    return (along[:, 0] < 0.95) & (along[:, 1] > -0.35)


def nothing(p):
    return np.zeros(len(p), dtype=bool)


@pytest.mark.parametrize("stand", [nothing, lambda p: np.hypot(p[:, 0] - 1.05, p[:, 1] - 0.5) < 0.12])
def test_an_empty_table_seen_across_its_corner_is_none_of_the_floor(stand):
    points = seen(corner, stand)
    below = np.linalg.norm(points, axis=1) > 1.6
    things = below & (np.random.default_rng(0).random(len(points)) < 0.02)  # on the floor: it is not empty
    points = (points * np.where(things, 0.95, 1.0)[:, None]).astype(np.float32)
    assert table_plane(points).level_from_camera[2, 3] == pytest.approx(TABLE, abs=0.005)


def test_a_floor_alone_is_a_table_if_it_is_near_enough():
    points = seen(nothing, nothing).astype(np.float32)
    assert table_plane(points).level_from_camera[2, 3] == pytest.approx(FLOOR, abs=0.005)


def test_a_slice_through_what_stands_on_a_table_is_no_table():
    """A heap's slice 8 cm above the table is as level as the table, but the table is seen through it."""
    points = seen(lambda p: np.abs(p[:, 1]) < 0.5, nothing)
    heap = np.random.default_rng(1).random(len(points)) < 0.05
    raised = points * np.where(heap, 1.0 - 0.08 / TABLE, 1.0)[:, None]
    assert table_plane(raised.astype(np.float32)).level_from_camera[2, 3] == pytest.approx(TABLE, abs=0.01)

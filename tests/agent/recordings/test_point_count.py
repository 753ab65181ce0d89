"""Large measurements are reduced to as many points as perception needs, and larger ones are refused."""

import numpy as np
import pytest

from agent.errors import BadInput
from agent.recordings.point_cloud_files import read_cloud
from agent.recordings.point_count import with_fewer_points
from agent.recordings.recording import DepthFrame


def test_an_ordinary_measurement_stays_as_it_is():
    frame = DepthFrame(np.ones((480, 640, 3), np.float32))
    assert with_fewer_points(frame) == (frame, "")


def test_a_large_picture_loses_rows_and_columns():
    rows, columns = np.mgrid[:1200, :1944].astype(np.float32)
    points = np.stack((columns, rows, np.ones_like(rows)), axis=-1)
    color = np.stack((rows % 256, columns % 256, rows % 7), axis=-1).astype(np.uint8)
    lens = np.array([[1000.0, 0, 971], [0, 1000, 599], [0, 0, 1]])
    small, note = with_fewer_points(DepthFrame(points, color, intrinsics=lens))
    assert small.points.shape == (600, 972, 3) and "every second was used" in note
    np.testing.assert_array_equal(small.points[5, 7], (14, 10, 1))
    np.testing.assert_array_equal(small.color[5, 7], color[10, 14])
    np.testing.assert_allclose(small.intrinsics[:2, 2], (485.5, 299.5))


def test_a_large_cloud_keeps_one_measured_point_in_each_cube():
    rng = np.random.default_rng(0)
    points = np.column_stack((rng.uniform(0, 1, (900_000, 2)), rng.normal(0, 1e-3, 900_000))).astype(np.float32)
    color = (points * 255).clip(0, 255).astype(np.uint8)
    points[::1000] = np.nan
    small, note = with_fewer_points(DepthFrame(points[None], color[None]))
    kept = small.points[0]
    assert 100_000 < len(kept) <= 400_000 and note.startswith("of 900000 points")
    assert np.isfinite(kept).all() and set(map(bytes, kept[:200])) <= set(map(bytes, points))
    np.testing.assert_array_equal(small.color[0], (kept * 255).clip(0, 255).astype(np.uint8))
    # No part of the table is lost.
    seen = np.histogram2d(kept[:, 0], kept[:, 1], bins=20, range=((0, 1), (0, 1)))[0]
    assert seen.min() > 0.5 * seen.mean()


def test_a_cloud_beyond_the_limit_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "huge.pcd"
    path.write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 30000000\nHEIGHT 1\nPOINTS 30000000\n"
        "DATA binary\n"
    )
    with pytest.raises(BadInput, match="claims 30000000 points; at most 20000000 are read"):
        read_cloud(path)

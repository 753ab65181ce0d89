"""Unorganised clouds get back the pixels of the picture that they were made of, where they have any."""

import numpy as np
import pytest

from agent.recordings.cloud_picture import UNORGANISED, as_picture
from agent.recordings.other_formats import read_other
from agent.recordings.recording import DepthFrame

FOCAL, WIDTH, HEIGHT = 410.0, 160, 120
LENS = np.array([[FOCAL, 0.0, 79.5], [0.0, FOCAL, 59.5], [0.0, 0.0, 1.0]])


@pytest.fixture
def picture():
    """A picture of a slope with a step, and with holes."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    depth = 0.8 + 0.002 * rows - 0.1 * ((columns > 60) & (rows > 50))
    depth[(rows * columns) % 11 == 5] = np.nan
    points = np.stack(((columns - 79.5) / FOCAL * depth, (rows - 59.5) / FOCAL * depth, depth), axis=-1)
    return points.astype(np.float32)


def in_one_row(points, seed=0):
    """Return the measured points (1, P, 3) in any order, with their numbers as colours."""
    flat = points.reshape(-1, 3)
    kept = np.random.default_rng(seed).permutation(np.flatnonzero(np.isfinite(flat).all(axis=1)))
    colors = np.stack((kept % 256, kept // 256, kept * 0), axis=1).astype(np.uint8)
    return DepthFrame(flat[None, kept], colors[None])


def test_the_pixels_and_the_lens_are_found_and_no_point_is_lost(picture):
    found, note = as_picture(in_one_row(picture))
    np.testing.assert_array_equal(found.points, picture)
    np.testing.assert_allclose(found.intrinsics, LENS, atol=0.01)
    low, high, _ = np.moveaxis(found.color.astype(int), -1, 0)
    numbers = low + 256 * high
    there = np.isfinite(picture[..., 2])
    assert (numbers[there] == np.arange(HEIGHT * WIDTH).reshape(HEIGHT, WIDTH)[there]).all()
    assert note.endswith("it is a picture of 160 x 120 pixels with a focal length of 410 pixels")


def test_points_on_no_pixels_and_pictures_stay_as_they_are(picture):
    rng = np.random.default_rng(0)
    elsewhere = DepthFrame(rng.uniform(-0.3, 0.3, (1, 5000, 3)).astype(np.float32) + np.float32((0, 0, 1)))
    turned = DepthFrame(in_one_row(picture).points @ np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], np.float32).T)
    few = DepthFrame(in_one_row(picture).points[:, :500])
    for frame in (elsewhere, turned, few, DepthFrame(picture)):
        found, note = as_picture(frame)
        assert found is frame and note == ""


def test_a_file_without_rows_is_read_as_a_picture_or_says_that_it_is_none(picture, tmp_path):
    def written(points):
        lines = "\n".join(" ".join(f"{value:.6f}" for value in point) for point in points[0].tolist())
        head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        count = points.shape[1]
        path = tmp_path / "cloud.pcd"
        path.write_text(f"{head}WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA ascii\n{lines}\n")
        return read_other(path)

    read = written(in_one_row(picture).points)
    assert read.frame.points.shape == picture.shape and read.frame.intrinsics is not None
    assert any("a picture of 160 x 120 pixels" in note for note in read.notes)
    blurred = in_one_row(picture).points + np.random.default_rng(1).normal(0, 0.002, (1, 1, 3)).astype(np.float32)
    noise = np.random.default_rng(2).normal(0, 0.002, blurred.shape).astype(np.float32)
    read = written(blurred + noise)
    assert not read.frame.organised and UNORGANISED in read.notes

"""Bayer mosaics: a smooth picture behind the four filters comes back as it was."""

import numpy as np
import pytest

from agent.recordings.bayer import MOSAICS
from agent.recordings.image_decoding import color_picture
from tests.agent.recordings.test_image_decoding import raw

# The colour (red 0, green 1, blue 2) of the first two pixels of the first two rows, as ROS names them.
LETTERS = {"bayer_rggb": "rggb", "bayer_bggr": "bggr", "bayer_gbrg": "gbrg", "bayer_grbg": "grbg"}


def behind(picture, letters):
    """What each pixel measures of a picture (H, W, 3) behind its filter."""
    mosaic = np.empty(picture.shape[:2], picture.dtype)
    for number, letter in enumerate(letters):
        row, column = divmod(number, 2)
        mosaic[row::2, column::2] = picture[row::2, column::2, "rgb".index(letter)]
    return mosaic


@pytest.fixture
def smooth():
    rows, columns = np.mgrid[:30, :41]
    return np.stack((40 + 5 * rows, 250 - 4 * columns, 30 + 2 * rows + 3 * columns), axis=-1).astype(np.uint8)


@pytest.mark.parametrize("name", sorted(MOSAICS))
def test_one_color_is_the_same_everywhere(name):
    picture = np.broadcast_to(np.array((200, 120, 30), np.uint8), (7, 9, 3))
    np.testing.assert_array_equal(color_picture(raw(behind(picture, LETTERS[name]), f"{name}8")), picture)


@pytest.mark.parametrize("name", sorted(MOSAICS))
@pytest.mark.parametrize("bits", [8, 16])
def test_a_slope_comes_back(name, bits, smooth):
    mosaic = behind(smooth, LETTERS[name])
    if bits == 16:
        mosaic = mosaic.astype(np.uint16) << 8
    found = color_picture(raw(mosaic, f"{name}{bits}")).astype(int)
    assert np.abs(found - smooth)[1:-1, 1:-1].max() <= 1
    assert np.abs(found - smooth).max() <= 6  # the borders have neighbours on one side only

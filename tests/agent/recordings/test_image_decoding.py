"""Pictures out of messages: every encoding, padded, of either byte order, compressed, and broken."""

import io
import zlib
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput
from agent.recordings.image_decoding import (
    color_picture,
    compressed_color,
    compressed_size,
    stored_compressed_depths,
    stored_depths,
)
from tests.agent.recordings.bag_making import HEIGHT, WIDTH, colors, depths, quantised_header


def raw(pixels, encoding, big_endian=False, pad=0):
    if big_endian:
        pixels = pixels.astype(pixels.dtype.newbyteorder(">"))
    rows = np.frombuffer(np.ascontiguousarray(pixels).tobytes(), np.uint8).reshape(len(pixels), -1)
    data = np.hstack((rows, np.full((len(rows), pad), 0xEE, np.uint8)))
    return SimpleNamespace(
        height=pixels.shape[0], width=pixels.shape[1], encoding=encoding, is_bigendian=int(big_endian),
        step=data.shape[1], data=data.ravel(),
    )  # fmt: skip


def compressed(pixels, kind, message_format="", before=b""):
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, kind)
    return SimpleNamespace(format=message_format, data=np.frombuffer(before + buffer.getvalue(), np.uint8))


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("pad", [0, 5])
@pytest.mark.parametrize(("encoding", "unit"), [("16UC1", 1000), ("mono16", 1000), ("32FC1", 1)])
def test_depths_are_metres_with_nan_for_nothing(encoding, unit, big_endian, pad):
    depth = depths() * unit
    depth[3, 4] = 0
    message = raw(depth.astype("f4" if unit == 1 else "u2"), encoding, big_endian, pad)
    read = stored_depths(message).metres()
    assert read.dtype == np.float32 and np.isnan(read[3, 4])
    expected = depths()
    expected[3, 4] = np.nan
    np.testing.assert_allclose(read, expected, atol=1e-6)


def test_a_float_depth_that_is_infinite_or_negative_is_nothing():
    depth = depths().astype("f4")
    depth[0, :3] = np.inf, -1, np.nan
    assert np.isnan(stored_depths(raw(depth, "32FC1")).metres()[0, :4]).tolist() == [True, True, True, False]


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("rgb8", (0, 1, 2)), ("bgr8", (2, 1, 0)), ("8UC3", (2, 1, 0)), ("rgba8", (0, 1, 2, 0)), ("bgra8", (2, 1, 0, 0))],
)
@pytest.mark.parametrize("pad", [0, 3])
def test_colours_come_back_from_every_order_of_channels(encoding, order, pad):
    np.testing.assert_array_equal(color_picture(raw(colors()[..., order], encoding, pad=pad)), colors())


def test_grey_and_wide_colours_are_eight_bits_of_three():
    grey = colors()[..., 0]
    np.testing.assert_array_equal(color_picture(raw(grey, "mono8")), np.repeat(grey[..., None], 3, axis=2))
    wide = colors().astype(np.uint16) << 8 | 17
    np.testing.assert_array_equal(color_picture(raw(wide, "rgb16", big_endian=True)), colors())


@pytest.mark.parametrize("encoding", ["yuv422", "yuv422_yuy2"])
def test_yuv_keeps_the_colour_of_pairs(encoding):
    rgb = np.repeat(colors()[:, ::2], 2, axis=1)  # pairs share their colour, so nothing is lost but rounding
    r, g, b = rgb.astype(float).transpose(2, 0, 1)
    y = 0.299 * r + 0.587 * g + 0.114 * b
    u, v = 128 + 0.564334 * (b - y), 128 + 0.713267 * (r - y)
    part = np.where(np.arange(WIDTH) % 2 == 0, u, v)
    pairs = np.stack((part, y) if encoding == "yuv422" else (y, part), axis=-1)
    read = color_picture(raw(np.clip(np.rint(pairs), 0, 255).astype(np.uint8), encoding))
    assert np.abs(read.astype(int) - rgb).max() <= 3


def test_compressed_colours_are_those_of_the_picture():
    np.testing.assert_array_equal(compressed_color(compressed(colors(), "PNG")), colors())
    smooth = np.full((HEIGHT, WIDTH, 3), (200, 40, 90), np.uint8)
    assert np.abs(compressed_color(compressed(smooth, "JPEG")).astype(int) - smooth).max() < 6
    assert compressed_size(compressed(smooth, "JPEG")) == (WIDTH, HEIGHT)


def test_compressed_depths_with_and_without_the_header_are_the_same():
    millimetres = np.rint(depths() * 1000).astype(np.uint16)
    millimetres[1, 1] = 0
    plain = stored_compressed_depths(compressed(millimetres, "PNG", "16UC1; png compressed")).metres()
    headed = compressed(millimetres, "PNG", "16UC1; compressedDepth", quantised_header())
    np.testing.assert_array_equal(stored_compressed_depths(headed).metres(), plain)
    assert np.isnan(plain[1, 1]) and np.nanmax(np.abs(plain - depths())) < 1e-6
    assert compressed_size(headed) == (WIDTH, HEIGHT)


def test_quantised_float_depths_are_undone():
    a = 100.0 * (100.0 + 1)  # as compressed_depth_image_transport computes them, for 100 levels at 100 m
    b = 1.0 - a / 10.0
    inverse = np.rint(a / depths() + b).astype(np.uint16)
    inverse[2, 2] = 0
    read = stored_compressed_depths(
        compressed(inverse, "PNG", "32FC1; compressedDepth png", quantised_header(a, b))
    ).metres()
    assert np.isnan(read[2, 2]) and np.nanmax(np.abs(read - depths())) < 1e-3


@pytest.mark.parametrize(
    ("read", "message", "said"),
    [
        (stored_depths, raw(colors(), "rgb8"), "'rgb8' holds no depths; legal: 16UC1, mono16, 32FC1"),
        (color_picture, raw(colors()[..., 0], "bayer_xyzw8"), "'bayer_xyzw8' cannot be used for colour"),
        (color_picture, raw(colors()[..., 0], "rgb8"), "needs"),
        (color_picture, raw(colors()[:, :39, :2], "yuv422"), "come in pairs"),
        (compressed_color, SimpleNamespace(format="jpeg", data=np.arange(99, dtype=np.uint8)), "neither JPEG nor PNG"),
        (stored_compressed_depths, compressed(colors(), "PNG", "16UC1; compressedDepth"), "legal: 16 bits of grey"),
        (
            stored_compressed_depths,
            SimpleNamespace(format="16UC1; compressedDepth rvl", data=np.zeros(99, np.uint8)),
            "claims 0 x 0 pixels",
        ),
        (stored_compressed_depths, SimpleNamespace(format="", data=np.zeros(0, np.uint8)), "neither a PNG nor RVL"),
    ],
)
def test_what_is_no_such_picture_is_refused(read, message, said):
    with pytest.raises(BadInput, match=said):
        read(message)


@pytest.mark.parametrize(
    "fields", [{"height": 0}, {"width": 0}, {"step": 3}, {"height": 31}, {"width": 2**31, "height": 2**31, "step": 0}]
)
def test_a_picture_that_contradicts_itself_is_refused(fields):
    message = raw(depths().astype("f4"), "32FC1")
    vars(message).update(fields)
    with pytest.raises(BadInput, match="needs|has none"):
        stored_depths(message).metres()


def test_a_cut_or_boastful_compressed_picture_is_refused():
    message = compressed(colors(), "PNG")
    message.data = message.data[: len(message.data) // 2]
    with pytest.raises(BadInput, match="damaged"):
        compressed_color(message)
    boast = compressed(colors(), "PNG").data.copy()
    for side in (10_000, 13_000, 100_000, 2_000_000_000):  # Pillow itself refuses the last two, and warns at the second
        boast[16:24] = np.frombuffer(side.to_bytes(4, "big") * 2, np.uint8)  # width and height in the header
        boast[29:33] = np.frombuffer(zlib.crc32(boast[12:29].tobytes()).to_bytes(4, "big"), np.uint8)
        for read in (compressed_color, stored_compressed_depths, compressed_size):
            with pytest.raises(BadInput, match=f"claims {side} x {side} pixels"):
                read(SimpleNamespace(format="", data=boast))


def test_a_progressive_picture_of_many_scans_is_refused():
    """Each scan goes over all pixels, and takes a few bytes."""
    data = compressed(colors(), "JPEG").data.tobytes()
    scan = data[data.index(b"\xff\xda") : -2]
    many = data[:-2] + scan * 200 + data[-2:]
    with pytest.raises(BadInput, match="201 scans; at most 100"):
        compressed_color(SimpleNamespace(format="", data=np.frombuffer(many, np.uint8)))

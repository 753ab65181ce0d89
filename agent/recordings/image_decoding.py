"""Decode pictures in messages: depths in metres and colours as RGB, raw or compressed."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.bayer import MOSAICS, colors_of_mosaic
from agent.recordings.byte_order import in_right_order, note_of
from agent.recordings.depth_units import MILLIMETRE
from agent.recordings.message_decoding import FARTHEST
from agent.recordings.pictures import open_picture, pixels_of
from agent.recordings.rvl import unpack_rvl
from agent.recordings.sizes import check_pixels

DEPTHS = ("16UC1", "mono16", "32FC1")
_COLORS = {  # encoding -> type of a channel, channels, and which of them are red, green and blue
    "rgb8": ("u1", 3, (0, 1, 2)),
    "bgr8": ("u1", 3, (2, 1, 0)),
    "8UC3": ("u1", 3, (2, 1, 0)),
    "rgba8": ("u1", 4, (0, 1, 2)),
    "bgra8": ("u1", 4, (2, 1, 0)),
    "8UC4": ("u1", 4, (2, 1, 0)),
    "mono8": ("u1", 1, (0, 0, 0)),
    "8UC1": ("u1", 1, (0, 0, 0)),
    "rgb16": ("u2", 3, (0, 1, 2)),
    "bgr16": ("u2", 3, (2, 1, 0)),
    "mono16": ("u2", 1, (0, 0, 0)),
}
_YUV = {  # two pixels in four bytes: where their brightness is, and the two parts of their colour
    "yuv422": ((1, 3), 0, 2),
    "uyvy": ((1, 3), 0, 2),
    "yuv422_yuy2": ((0, 2), 1, 3),
    "yuyv": ((0, 2), 1, 3),
}
_BAND_PIXELS = 1_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
_COMPRESSED = ("JPEG", "PNG")
_RVL_SIZE = "<II"
_QUANTISED = "<iff"  # the header of compressedDepth: a number for the format, then A and B


@dataclass(frozen=True)
class StoredDepths:
    """The depths of a message as it stores them.

    Attributes:
        values: (H, W) float32, 0 or NaN where nothing was measured.
        unit: metres per unit, by the encoding.
        note: what was corrected, or "".
    """

    values: np.ndarray
    unit: float
    note: str = ""

    def metres(self, unit: float | None = None) -> np.ndarray:
        """Return the depths (H, W) float32 in metres, NaN where nothing was measured.

        Args:
            unit: metres per unit, in place of that of the encoding.
        """
        return _without_zero(self.values * np.float32(self.unit if unit is None else unit))


def stored_depths(message: Any) -> StoredDepths:
    """Return the depths of a raw Image.

    Raises:
        BadInput: if it is not a depth picture, or contradicts itself.
    """
    if message.encoding not in DEPTHS:
        raise BadInput(f"a picture of encoding {message.encoding!r} holds no depths; legal: {', '.join(DEPTHS)}")
    kind, unit = ("f4", 1.0) if message.encoding == "32FC1" else ("u2", MILLIMETRE)
    pixels = _pixels(message, kind, 1)[..., 0]
    note = note_of(pixels, bool(message.is_bigendian))
    return StoredDepths(in_right_order(pixels).astype(np.float32), unit, note)


def color_picture(message: Any) -> np.ndarray:
    """Return the colours (H, W, 3) uint8 RGB of a raw Image.

    The colours of a Bayer mosaic are interpolated.

    Raises:
        BadInput: if the encoding is not known, or the message contradicts itself.
    """
    if message.encoding in _YUV:
        return _in_bands(_pixels(message, "u1", 2), lambda rows: _from_yuv(rows, *_YUV[message.encoding]))
    if (mosaic := message.encoding.rstrip("0123456789")) in MOSAICS:
        wide = message.encoding.endswith("16")
        pixels = _pixels(message, "u2" if wide else "u1", 1)[..., 0]
        return _in_bands(
            pixels, lambda rows: np.rint(colors_of_mosaic(rows >> 8 if wide else rows, mosaic)).astype(np.uint8)
        )
    if message.encoding not in _COLORS:
        legal = ", ".join([*_COLORS, *_YUV, *(f"{name}{bits}" for name in MOSAICS for bits in (8, 16))])
        raise BadInput(f"a picture of encoding {message.encoding!r} cannot be used for colour; legal: {legal}")
    kind, channels, order = _COLORS[message.encoding]
    pixels = _pixels(message, kind, channels)
    if kind == "u2":
        pixels = pixels >> 8
    return pixels[..., order].astype(np.uint8)


def compressed_color(message: Any) -> np.ndarray:
    """Return the colours (H, W, 3) uint8 RGB of a CompressedImage.

    Raises:
        BadInput: if it is not a JPEG or PNG picture.
    """
    try:
        return pixels_of(open_picture(message.data.tobytes(), _COMPRESSED), "RGB")
    except BadInput as error:
        raise BadInput(f"a compressed picture cannot be read: {error}") from error


def stored_compressed_depths(message: Any) -> StoredDepths:
    """Return the depths of a CompressedImage.

    Raises:
        BadInput: if it is neither a PNG of depths nor RVL.
    """
    data, header = message.data.tobytes(), struct.calcsize(_QUANTISED)
    a, b = 0.0, 0.0
    if not data.startswith(_PNG) and len(data) >= header:
        _, a, b = struct.unpack(_QUANTISED, data[:header])
        data = data[header:]
    if data.startswith(_PNG):
        values = _from_png(data)
    elif "rvl" in message.format.lower():
        values = _from_rvl(data)
    else:
        raise BadInput(f"a compressed depth picture of format {message.format!r} holds neither a PNG nor RVL")
    if message.format.startswith("32FC1"):
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.where(values > 0, a / (values - b), np.nan).astype(np.float32)
        return StoredDepths(depth, 1.0)
    return StoredDepths(values.astype(np.float32), MILLIMETRE)


def _from_png(data: bytes) -> np.ndarray:
    """Return the values (H, W) of a PNG of depths."""
    try:
        picture = open_picture(data, ("PNG",))
        if not picture.mode.startswith("I"):
            raise BadInput(f"it has the mode {picture.mode!r}; legal: 16 bits of grey")
        return pixels_of(picture)
    except BadInput as error:
        raise BadInput(f"the PNG of a compressed depth picture cannot be read: {error}") from error


def _from_rvl(data: bytes) -> np.ndarray:
    """Return the values (H, W) uint16 of an RVL picture, which begins with its width and height."""
    if len(data) < struct.calcsize(_RVL_SIZE):
        raise BadInput("an RVL picture is cut short: its size is not there")
    width, height = struct.unpack_from(_RVL_SIZE, data)
    check_pixels(width, height, "an RVL picture")
    return unpack_rvl(data[struct.calcsize(_RVL_SIZE) :], width * height).reshape(height, width)


def is_compressed_depth(topic: str, message_format: str) -> bool:
    """Return whether a CompressedImage holds depths, by its topic and its format."""
    return topic.lower().endswith("compresseddepth") or message_format.startswith(("16UC1", "32FC1"))


def compressed_size(message: Any) -> tuple[int, int]:
    """Return width and height of a CompressedImage without unpacking it.

    Raises:
        BadInput: if it is not a picture.
    """
    data = message.data.tobytes()
    at = data.find(_PNG, 0, 64)
    after = struct.calcsize(_QUANTISED)
    if at < 0 and "rvl" in message.format.lower() and len(data) >= after + struct.calcsize(_RVL_SIZE):
        width, height = struct.unpack_from(_RVL_SIZE, data, after)
        check_pixels(width, height, "an RVL picture")
        return width, height
    try:
        return open_picture(data[max(at, 0) :], _COMPRESSED).size
    except BadInput as error:
        raise BadInput(f"a compressed picture cannot be read: {error}") from error


def _pixels(message: Any, kind: str, channels: int) -> np.ndarray:
    """Return the pixels (H, W, C) of a raw Image without copying them."""
    height, width = message.height, message.width
    dtype = np.dtype((">" if message.is_bigendian else "<") + kind)
    row = width * channels * dtype.itemsize
    step = message.step or row
    if height == 0 or width == 0:
        raise BadInput(f"a picture of {width} x {height} pixels has none")
    if step < row or len(message.data) < (height - 1) * step + row:
        raise BadInput(
            f"a picture of {width} x {height} pixels ({message.encoding}), {step} bytes a row, needs "
            f"{max(step, row) * height} bytes and has {len(message.data)}"
        )
    check_pixels(width, height, "a picture")
    strides = (step, channels * dtype.itemsize, dtype.itemsize)
    return np.ndarray((height, width, channels), dtype, np.ascontiguousarray(message.data), 0, strides)


def _in_bands(pixels: np.ndarray, convert: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the colours (H, W, 3) of pixels (H, W, ...), some rows at a time, for which floats are made.

    Args:
        convert: for an even number of rows; the first and the last two of them are seen by their neighbours alone.
    """
    height, width = pixels.shape[:2]
    colors = np.empty((height, width, 3), np.uint8)
    rows = max(2, _BAND_PIXELS // width // 2 * 2)
    for start in range(0, height, rows):
        above = min(start, 2)
        band = convert(pixels[start - above : start + rows + 2])
        colors[start : start + rows] = band[above : above + rows]
    return colors


def _from_yuv(pixels: np.ndarray, brightness: tuple[int, int], blue: int, red: int) -> np.ndarray:
    """Convert YUV 4:2:2 to RGB by ITU-R BT.601."""
    height, width, _ = pixels.shape
    if width % 2:
        raise BadInput(f"a YUV 4:2:2 picture cannot be {width} pixels wide: its pixels come in pairs")
    pairs = pixels.reshape(height, width // 2, 4).astype(np.float32)
    y = pairs[..., brightness].reshape(height, width)
    u, v = (np.repeat(pairs[..., place] - 128, 2, axis=1) for place in (blue, red))
    rgb = np.stack((y + 1.402 * v, y - 0.344136 * u - 0.714136 * v, y + 1.772 * u), axis=-1)
    return np.clip(np.rint(rgb), 0, 255).astype(np.uint8)


def _without_zero(depth: np.ndarray) -> np.ndarray:
    """Replace depths that are no measurement by NaN."""
    with np.errstate(invalid="ignore"):
        depth[~((depth > 0) & (depth < FARTHEST))] = np.nan
    return depth

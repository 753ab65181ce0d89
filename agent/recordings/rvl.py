"""Unpack depths in RVL, the lossless code of Wilson, "Fast Lossless Depth Image Compression" (ISS 2017).

A picture is a list of runs: how many pixels without a measurement, how many with one, and the differences between the
latter. Every number is a chain of nibbles, three bits each, the lowest first, of which all but the last have their
highest bit set.
"""

from __future__ import annotations

import numpy as np

from agent.errors import BadInput

_WORD = 4  # bytes: the nibbles of a word begin with its highest
_MOST_NIBBLES = 11  # of a number: 32 bits


def unpack_rvl(data: bytes, count: int) -> np.ndarray:
    """Return the depths (`count`,) uint16 that `data` holds; 0 where nothing was measured.

    Raises:
        BadInput: when it is cut short or holds more pixels than that.
    """
    numbers = _numbers(data)
    depths = np.zeros(count, np.uint16)
    pixel, at, previous = 0, 0, 0
    while pixel < count:
        if at + 1 >= len(numbers):
            raise BadInput(f"an RVL picture is cut short: {pixel} of {count} pixels are there")
        empty, measured = int(numbers[at]), int(numbers[at + 1])
        at, pixel = at + 2, pixel + empty
        coded = numbers[at : at + measured]
        if pixel + measured > count or len(coded) < measured or empty + measured == 0:
            raise BadInput(f"an RVL picture is damaged: after {pixel} of {count} pixels it claims {measured} more")
        differences = (coded >> 1) ^ -(coded & 1)
        depths[pixel : pixel + measured] = (previous + np.cumsum(differences)) & 0xFFFF
        if measured:
            previous = int(depths[pixel + measured - 1])
        at, pixel = at + measured, pixel + measured
    return depths


def _numbers(data: bytes) -> np.ndarray:
    """Return every number in `data`, int64."""
    words = np.frombuffer(data[: len(data) // _WORD * _WORD], "<u4")
    nibbles = (words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32)).ravel() & 0xF
    last = np.flatnonzero(nibbles < 8)
    first = np.concatenate(([0], last[:-1] + 1)) if len(last) else last
    nibbles = nibbles[: last[-1] + 1 if len(last) else 0].astype(np.int64)
    place = np.arange(len(nibbles)) - np.repeat(first, last - first + 1)
    if (place >= _MOST_NIBBLES).any():
        raise BadInput("an RVL picture is damaged: it has a number of more than 32 bits")
    return np.add.reduceat((nibbles & 7) << (3 * place), first) if len(first) else nibbles

"""Unpack depths in RVL, the lossless code of Wilson, "Fast Lossless Depth Image Compression" (ISS 2017).

A picture is a list of runs: how many pixels without a measurement, how many with one, and the differences between the
latter. Every number is a chain of nibbles, three bits each, the lowest first, of which all but the last have their
highest bit set.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from agent.errors import BadInput

_WORD = 4  # bytes: the nibbles of a word begin with its highest
_BLOCK = 32_768 * _WORD  # bytes that are unpacked at once, each into two numbers at most
_MOST_NIBBLES = 11  # of a number: 32 bits
_CUT = "an RVL picture is cut short: {} of {} pixels are there"


def unpack_rvl(data: bytes, count: int) -> np.ndarray:
    """Return the depths (`count`,) uint16 that `data` holds; 0 where nothing was measured.

    What follows the last pixel is not unpacked.

    Raises:
        BadInput: when it is cut short or holds more pixels than that.
    """
    depths = np.zeros(count, np.uint16)
    pixel, left, previous = 0, 0, 0  # `left` pixels of the last run are in the next block
    rest = np.empty(0, np.int64)
    for block in _numbers(data):
        numbers = np.concatenate((rest, block))
        lengths, heads, end, left = _runs(numbers, left, pixel, count)
        is_difference = np.ones(end, bool)
        is_difference[heads] = is_difference[heads + 1] = False
        coded = numbers[:end][is_difference]
        measured = previous + np.cumsum((coded >> 1) ^ -(coded & 1))
        is_measured = np.repeat(np.arange(len(lengths)) % 2 == 0, lengths)
        depths[pixel : pixel + len(is_measured)][is_measured] = measured & 0xFFFF
        previous = int(measured[-1]) & 0xFFFF if len(measured) else previous
        pixel, rest = pixel + len(is_measured), numbers[end:]
        if pixel == count:
            return depths
    raise BadInput(_CUT.format(pixel, count))


def _runs(numbers: np.ndarray, left: int, pixel: int, count: int) -> tuple[np.ndarray, np.ndarray, int, int]:
    """Find the runs in numbers, of which the first `left` end the run before.

    Returns:
        How many pixels are measured, not measured, measured, and so on; where the two numbers that begin each run
        stand; how many numbers were used; and how many pixels of the last run are missing.
    """
    at, size = min(left, len(numbers)), len(numbers)
    begun, left = at, left - at
    values, heads = numbers.tolist() if pixel + begun + left < count else [], []
    while at + 1 < len(values):
        heads.append(at)
        at += 2 + values[at + 1]
    places = np.array(heads, dtype=np.int64)
    empty, measured = numbers[places], numbers[places + 1]
    ends = pixel + begun + left + np.cumsum(empty + measured)
    last = int(np.searchsorted(ends, count)) + 1  # runs up to the picture's last pixel
    wrong = np.flatnonzero((empty + measured == 0)[:last] | (ends[:last] > count))
    if len(wrong):
        before = ends[wrong[0]] - empty[wrong[0]] - measured[wrong[0]]
        raise BadInput(
            f"an RVL picture is damaged: after {before} of {count} pixels it claims {measured[wrong[0]]} more"
        )
    places, empty, measured = places[:last], empty[:last], measured[:last].copy()
    if len(places):
        at = int(places[-1] + 2 + measured[-1])
        left = max(0, at - size)
        at -= left
        measured[-1] -= left
    return np.concatenate(([begun], np.column_stack((empty, measured)).ravel())), places, at, left


def _numbers(data: bytes) -> Iterator[np.ndarray]:
    """Yield the numbers in `data`, int64, block by block."""
    rest = np.empty(0, np.uint8)
    end = len(data) // _WORD * _WORD
    for start in range(0, end, _BLOCK):
        pairs = np.frombuffer(data, np.uint8, min(_BLOCK, end - start), start).reshape(-1, _WORD)[:, ::-1]
        nibbles = np.concatenate((rest, np.stack((pairs >> 4, pairs & 0xF), axis=-1).ravel()))
        is_last = nibbles < 8
        if is_last.all():  # as in a picture of nothing much
            rest = nibbles[:0]
            yield nibbles.astype(np.int64)
            continue
        last = np.flatnonzero(is_last)
        rest = nibbles[last[-1] + 1 :] if len(last) else nibbles
        first = np.concatenate(([0], last[:-1] + 1)) if len(last) else last
        nibbles = nibbles[: len(nibbles) - len(rest)]
        place = np.arange(len(nibbles)) - np.repeat(first, last - first + 1)
        if len(rest) >= _MOST_NIBBLES or (place >= _MOST_NIBBLES).any():
            raise BadInput("an RVL picture is damaged: it has a number of more than 32 bits")
        if len(first):
            yield np.add.reduceat((nibbles & 7).astype(np.int64) << (3 * place), first)

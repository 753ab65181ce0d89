"""Check the parts of the table in 3D that a session file holds: anyone may have written the file."""

from __future__ import annotations

import base64
import binascii
from typing import Any

_LINK_KEYS = {"link", "sides", "round", "position", "quaternion", "color"}


def part_error(part: Any) -> str:
    """Return what is wrong with a part (see `agent.reporting.table_model`), in a phrase; empty if nothing is."""
    try:
        match part:
            case {"seen": {"table": table, "robot": robot, "objects": objects}} if len(part) == 1:
                good = _numbers(table, 4) and (robot is None or _numbers(robot, 3)) and all(map(_is_object, objects))
            case {"candidates": list(frames)} if len(part) == 1:
                good = all(map(_is_frame, frames))
            case {"chosen": int(rank), "frame": frame} if len(part) == 2:
                good = rank >= 1 and _is_frame(frame)
            case {"step": frame, "released": bool()} if len(part) == 2:
                good = _is_frame(frame)
            case {"film": film} if len(part) == 1:
                good = _is_film(film)
            case _:
                good = False
    except (TypeError, KeyError, ValueError, AttributeError):
        good = False
    return (
        "" if good else "its table is not a part that structagent writes; legal: seen, candidates, chosen, step, film"
    )


def _numbers(values: Any, count: int) -> bool:
    numbers = [isinstance(value, int | float) and not isinstance(value, bool) for value in values]
    return isinstance(values, list) and len(values) == count and all(numbers)


def _packed(text: Any, size: int) -> int:
    """Return how many values of `size` bytes base64 text holds.

    Raises:
        ValueError: if it is none, or does not hold whole values.
    """
    try:
        count, rest = divmod(len(base64.b64decode(text, validate=True)), size)
    except binascii.Error as error:
        raise ValueError(str(error)) from error
    if rest:
        raise ValueError("a value is incomplete")
    return count


def _is_object(one: Any) -> bool:
    if not isinstance(one["name"], str) or not _numbers(one["color"], 3):
        return False
    if "points" in one:
        return _packed(one["points"], 6) == _packed(one["colors"], 3)
    return _packed(one["vertices"], 6) > 0 and _packed(one["faces"], 6) > 0


def _is_frame(frame: Any) -> bool:
    return isinstance(frame["caption"], str) and all(m is None or _numbers(m, 12) for m in frame["motions"])


def _is_film(film: Any) -> bool:
    counts = {_packed(track, 14) for track in (*film["links"].values(), *filter(None, film["motions"]))}
    marks = all(_numbers(mark[:1], 1) and isinstance(mark[1], str) and len(mark) == 2 for mark in film["marks"])
    return (
        _numbers([film["every"]], 1) and film["every"] > 0 and len(counts) == 1 and 0 not in counts
        and bool(film["links"]) and marks and all(map(_is_solid, film["shapes"]))
    )  # fmt: skip


def _is_solid(shape: Any) -> bool:
    return (
        shape.keys() == _LINK_KEYS and isinstance(shape["link"], int) and isinstance(shape["round"], bool)
        and _numbers(shape["sides"], 3) and _numbers(shape["position"], 3) and _numbers(shape["quaternion"], 4)
        and _numbers(shape["color"], 3)
    )  # fmt: skip

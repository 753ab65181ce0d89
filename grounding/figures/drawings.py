"""Hold figures that a language model draws in one line: the shape "drawing NAME <DRAWING>" of a goal.

The drawing stands in the goal itself, so that a report, another process or a next turn has all of it, and so that no
name of the library or of a user ever means it.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

from grounding.figures.figure import MOST, Figure, FigureError, Point
from grounding.figures.files import figure_from

DRAWING = "drawing "  # before the noun and the drawing, in place of a figure's name
KEYS = ("strokes", "blocks", "least")  # of the file of a figure, those that a drawing may have
MOST_STROKES, MOST_POINTS = 12, 60  # the largest figure of the library has 6 strokes and 50 points
FARTHEST = 1000.0  # coordinates of points; a flat figure is scaled to its objects
_SAME = 0.02  # of the width: ends of strokes that are nearer are one place
_OVERLAP = 1e-6  # widths of a usual block
_INLINE = re.compile(rf"{DRAWING}([^<>]+) <[^<>]*>")


def drawing_shape(noun: str, drawing: Any) -> str:
    """Return the shape of a drawing, in the form of the file of a figure without its name.

    Args:
        noun: how people say it.
        drawing: strokes and the fewest objects that show them (`least`), or blocks. Keys that are null are not there.

    Raises:
        FigureError: for a drawing that is not legal.
    """
    if not isinstance(drawing, Mapping):
        raise FigureError(f"drawing cannot be {drawing!r:.60}; legal: an object with the keys {', '.join(KEYS)}")
    said = {key: value for key, value in drawing.items() if value not in (None, [])}
    if unknown := [key for key in said if key not in KEYS]:
        raise FigureError(f"unknown key {unknown[0]!r} of a drawing; legal keys: {', '.join(KEYS)}")
    if blocks := said.get("blocks"):
        said["least"] = len(blocks) if isinstance(blocks, list) and len(blocks) <= MOST else 1
    if "least" not in said and "strokes" in said:
        raise FigureError("the key 'least' of a drawing is missing; legal: the fewest objects that show its strokes")
    return _shape(_checked(figure_from({"name": noun, "nouns": [noun], "least": 1} | said)))


def drawn(shape: str) -> Figure:
    """Return the figure of the shape of a drawing; the shape is its name.

    Raises:
        FigureError: for a text that is no such shape.
    """
    return replace(_drawn(shape), name=shape)


def without_drawings(text: str) -> str:
    """Return a text with the noun in place of the shape of each drawing."""
    return _INLINE.sub(r"\1", text)


def drawings_among(shapes: Iterable[str | None]) -> dict[str, str]:
    """Return noun -> shape of those shapes that are drawings; of two with one noun, the last."""
    return {without_drawings(shape): shape for shape in shapes if shape is not None and shape.startswith(DRAWING)}


@lru_cache(maxsize=256)
def _drawn(shape: str) -> Figure:
    found = _INLINE.fullmatch(shape)
    if found is None:
        raise FigureError(f"{shape!r:.60} is not a drawing; legal: {DRAWING}NAME <DRAWING>")
    noun = found[1]
    try:
        entries = json.loads(shape[len(DRAWING) + len(noun) + 2 : -1])
    except (ValueError, RecursionError) as error:
        raise FigureError(f"the drawing of {noun!r:.60} is not JSON: {error}") from error
    if not isinstance(entries, dict):
        raise FigureError(f"the drawing of {noun!r:.60} is not a JSON object")
    return _checked(
        figure_from({"name": noun, "nouns": [noun]} | {key: entries[key] for key in entries if key in KEYS})
    )


def _shape(figure: Figure) -> str:
    entries: dict[str, Any] = {"least": figure.least}
    if figure.strokes:
        entries["strokes"] = [[[_brief(x), _brief(y)] for x, y in stroke] for stroke in figure.strokes]
    else:
        entries["blocks"] = [
            {"x": _brief(one.x), "level": one.level, "width": _brief(one.width)} for one in figure.blocks
        ]
    return f"{DRAWING}{figure.name} <{json.dumps(entries, separators=(', ', ': '))}>"


def _brief(value: float) -> float | int:
    """Return a number with four digits, which is finer than any table shows."""
    short = float(f"{value:.4g}")
    return int(short) if short.is_integer() else short


def _checked(figure: Figure) -> Figure:
    if figure.blocks:
        _check_blocks(figure)
        return figure
    points = [point for stroke in figure.strokes for point in stroke]
    if len(figure.strokes) > MOST_STROKES or len(points) > MOST_POINTS:
        raise FigureError(
            f"a drawing cannot have {len(figure.strokes)} strokes of {len(points)} points; legal: up to {MOST_STROKES} "
            f"strokes of {MOST_POINTS} points in all"
        )
    if far := [value for point in points for value in point if abs(value) > FARTHEST]:
        raise FigureError(f"strokes cannot have {far[0]:g}; legal: -{FARTHEST:g} to {FARTHEST:g}")
    width = max(math.dist(one, other) for one in points for other in points)
    strokes = tuple(_distinct(stroke, 1e-4 * width) for stroke in figure.strokes)
    if width < 1e-3:
        raise FigureError("strokes of one point show nothing; legal: two points or more that lie apart")
    ends = list[Point]()
    for point in (end for stroke in strokes for end in (stroke[0], stroke[-1])):
        if all(math.dist(point, other) > _SAME * width for other in ends):
            ends.append(point)
    if figure.least < len(ends):
        raise FigureError(
            f"least cannot be {figure.least}, because the strokes have {len(ends)} ends; legal: {len(ends)} to {MOST}"
        )
    return replace(figure, strokes=strokes)


def _distinct(stroke: tuple[Point, ...], apart: float) -> tuple[Point, ...]:
    """Return a stroke without points that lie on the one before."""
    return (stroke[0], *(point for before, point in pairwise(stroke) if math.dist(before, point) > apart))


def _check_blocks(figure: Figure) -> None:
    blocks = figure.blocks
    if len(blocks) > MOST:
        raise FigureError(f"a drawing cannot have {len(blocks)} blocks; legal: up to {MOST}")
    for one in blocks:
        if abs(one.x) > MOST or one.width > MOST:
            raise FigureError(f"a block cannot have x {one.x:g} and width {one.width:g}; legal: up to {MOST}")
    for one, other in pairwise(sorted(blocks)):
        if one.level == other.level and other.x - one.x < (one.width + other.width) / 2 - _OVERLAP:
            raise FigureError(
                f"the blocks at x {one.x:g} and {other.x:g} of level {one.level} overlap; legal: middles that are "
                "half of both widths apart or more"
            )

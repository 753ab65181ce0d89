"""Draw a figure as characters: flat ones from above, upright ones from the front."""

from __future__ import annotations

import math
from itertools import pairwise

from grounding.figures.figure import Figure
from grounding.figures.growth import pattern_places

COLUMNS, ROWS = 33, 13  # of a picture of a flat figure
_BLOCK = 4  # characters of a block's width


def picture(figure: Figure) -> list[str]:
    """Return the lines of a figure's picture."""
    if figure.blocks:
        return _upright(figure)
    if figure.places:
        return _dotted(
            [
                (place.x + i * place.size[0] / 4, place.y + j * place.size[1] / 4)
                for place in figure.places
                for i in (-1, 1)
                for j in (-1, 1)
            ]
        )
    if figure.pattern:
        count = next((n for n in figure.legal if n >= 8), figure.legal[-1])
        return _dotted([(x, y) for x, y in pattern_places(figure.pattern, count)])
    return _dotted([point for stroke in figure.strokes for point in _sampled(stroke)])


def _sampled(stroke: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
    """Return points along a stroke, close enough for a line of characters."""
    found = list(stroke[:1])
    for (x, y), (to_x, to_y) in pairwise(stroke):
        found += [(x + (to_x - x) * k / 40, y + (to_y - y) * k / 40) for k in range(1, 41)]
    return found


def _dotted(points: list[tuple[float, float]]) -> list[str]:
    """Return a picture of points, in proportion: a character is twice as high as wide."""
    left, low = min(x for x, _ in points), min(y for _, y in points)
    width, height = max(x for x, _ in points) - left, max(y for _, y in points) - low
    unit = min((COLUMNS - 1) / max(2 * width, 1e-9), (ROWS - 1) / max(height, 1e-9))
    rows = [[" "] * COLUMNS for _ in range(math.floor(height * unit + 0.5) + 1)]
    for x, y in points:
        rows[len(rows) - 1 - math.floor((y - low) * unit + 0.5)][
            min(COLUMNS - 1, math.floor(2 * (x - left) * unit + 0.5))
        ] = "o"
    return ["".join(row).rstrip() for row in rows]


def _upright(figure: Figure) -> list[str]:
    """Return a picture of blocks, level by level."""
    left = min(block.x - block.width / 2 for block in figure.blocks)
    right = max(block.x + block.width / 2 for block in figure.blocks)
    levels = [
        [" "] * (math.ceil((right - left) * _BLOCK) + 1) for _ in range(max(block.level for block in figure.blocks) + 1)
    ]
    for block in figure.blocks:
        first = round((block.x - block.width / 2 - left) * _BLOCK)
        end = max(first + 2, round((block.x + block.width / 2 - left) * _BLOCK))
        row = levels[-1 - block.level]
        row[first:end] = ["[", *"#" * (end - first - 2), "]"]
    return ["".join(row).rstrip() for row in levels]

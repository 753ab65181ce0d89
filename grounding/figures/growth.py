"""Let blocks and patterns have other numbers of objects: posts become longer, walls get rows and columns,
stairs steps.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

_ASIDE = 0.5  # of a block's width: blocks of one level that are farther from each other are posts
_LONGEST = 2.5  # times as long as wide, that a pattern may become


@dataclass(frozen=True, order=True)
class FigureBlock:
    """One block of an upright figure, in widths of a usual block.

    Attributes:
        level: how many blocks it has below it; 0 stands on the table.
        x: of its middle along the wall, to the reader's right.
        width: along the wall. What is wider than 1 bridges, and gets the longest objects.
    """

    level: int
    x: float
    width: float = 1.0


Blocks: TypeAlias = tuple[FigureBlock, ...]


def levels_of(blocks: Blocks) -> list[list[FigureBlock]]:
    """Return the blocks level by level from the bottom, each from the left to the right."""
    count = max(block.level for block in blocks) + 1
    return [sorted(block for block in blocks if block.level == level) for level in range(count)]


def supports_of(blocks: Blocks) -> tuple[tuple[int, ...], ...]:
    """Return for each block the indices of those that carry it: of the level below, where both overlap."""
    return tuple(
        tuple(
            k
            for k, under in enumerate(blocks)
            if under.level == block.level - 1 and abs(under.x - block.x) < (under.width + block.width) / 2 - 1e-6
        )
        for block in blocks
    )


# --- rules: each gives the figures that have one step more, or one less ---------------------------


def _posts(blocks: Blocks) -> Iterator[Blocks]:
    """Make the lowest posts longer or shorter by a block: the blocks of a level that stand apart from each other."""
    levels = levels_of(blocks)
    lowest = next((k for k, level in enumerate(levels) if len(level) > 1 and _apart(level)), None)
    if lowest is None:
        return
    above = [_raised(block, 1) if block.level > lowest else block for block in blocks]
    yield _sorted((*above, *(_raised(block, 1) for block in levels[lowest])))
    if lowest + 1 < len(levels) and _alike(levels[lowest], levels[lowest + 1]):
        left = [block for block in blocks if block.level != lowest]
        yield _sorted(_raised(block, -1) if block.level > lowest else block for block in left)


def _rows(blocks: Blocks) -> Iterator[Blocks]:
    """Add or take the highest row of a wall in bond: each block of a row lies over a joint of the row below."""
    levels = levels_of(blocks)
    if len(levels) < 2 or any([block.x for block in upper] != _joints(lower) for lower, upper in pairwise(levels)):
        return
    if joints := _joints(levels[-1]):
        yield _sorted((*blocks, *(FigureBlock(len(levels), x, levels[-1][0].width) for x in joints)))
    if len(levels) > 2:
        yield _sorted(block for block in blocks if block.level < len(levels) - 1)


def _columns(blocks: Blocks) -> Iterator[Blocks]:
    """Make every row longer or shorter by a block at its right."""
    levels = levels_of(blocks)
    pitch = next((row[-1].x - row[-2].x for row in levels if len(row) > 1), 0.0)
    if not pitch:
        return
    yield _sorted((*blocks, *(replace(row[-1], x=row[-1].x + pitch) for row in levels)))
    if all(len(row) > 1 for row in levels):
        yield _sorted(block for row in levels for block in row[:-1])


def _steps(blocks: Blocks) -> Iterator[Blocks]:
    """Put stairs on a row that is longer by one, or take their lowest row away."""
    levels = levels_of(blocks)
    right = levels[0][-1].x
    if any(len(upper) != len(lower) - 1 or upper[-1].x != right for lower, upper in pairwise(levels)):
        return
    first = levels[0][0]
    yield _sorted((replace(first, x=first.x - 1), *levels[0], *(_raised(block, 1) for block in blocks)))
    if len(levels) > 2:
        yield _sorted(_raised(block, -1) for block in blocks if block.level)


RULES: Mapping[str, Callable[[Blocks], Iterator[Blocks]]] = {
    "posts": _posts, "rows": _rows, "columns": _columns, "steps": _steps,
}  # fmt: skip


@lru_cache(maxsize=256)
def grown(blocks: Blocks, rules: tuple[str, ...], most: int) -> Mapping[int, tuple[Blocks, ...]]:
    """Return what rules make of blocks: number of blocks -> the ways to have it, the fewest steps from them first."""
    start = _sorted(blocks)
    found, waiting = {start: None}, deque([start])
    while waiting:
        for other in (other for rule in rules for other in RULES[rule](waiting[0])):
            if len(other) <= most and other not in found:
                found[other] = None
                waiting.append(other)
        waiting.popleft()
    ways: dict[int, tuple[Blocks, ...]] = {}
    for one in found:
        ways[len(one)] = (*ways.get(len(one), ()), one)
    return ways


def _raised(block: FigureBlock, by: int) -> FigureBlock:
    return replace(block, level=block.level + by)


def _sorted(blocks: Iterator[FigureBlock] | Blocks) -> Blocks:
    """Return the blocks in order, the leftmost at its x of 0."""
    listed = tuple(blocks)
    left = min(block.x for block in listed)
    return tuple(sorted(replace(block, x=round(block.x - left, 6)) for block in listed))


def _joints(row: list[FigureBlock]) -> list[float]:
    """Return where the blocks of a row meet."""
    return [(a.x + b.x) / 2 for a, b in pairwise(row)]


def _apart(level: list[FigureBlock]) -> bool:
    return all(b.x - a.x - (a.width + b.width) / 2 >= _ASIDE for a, b in pairwise(level))


def _alike(one: list[FigureBlock], other: list[FigureBlock]) -> bool:
    return [(block.x, block.width) for block in one] == [(block.x, block.width) for block in other]


# --- patterns -------------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def pattern_places(tile: tuple[str, ...], count: int) -> tuple[tuple[float, float], ...]:
    """Return where so many objects stand in a repeated pattern, the nearest to a square; () if none has so many.

    Every row and column of the cut has an object at least, so that it is as wide as it says.
    """
    best: tuple[float, tuple[tuple[float, float], ...]] | None = None
    for rows in range(2, 2 * count + 1):
        for columns in range(2, 2 * count + 1):
            shape = max(rows, columns) / min(rows, columns)
            if shape > _LONGEST or rows * columns > 4 * count or (best is not None and shape >= best[0]):
                continue
            for down in range(len(tile)):
                places = _cut(tile, rows, columns, down)
                if len(places) == count and _full(places, rows, columns):
                    best = shape, places
                    break
    return best[1] if best else ()


def _cut(tile: tuple[str, ...], rows: int, columns: int, down: int) -> tuple[tuple[float, float], ...]:
    return tuple(
        (float(column), float(rows - 1 - row))
        for row in range(rows)
        for column in range(columns)
        if tile[(row + down) % len(tile)][column % len(tile[0])] == "x"
    )


def _full(places: tuple[tuple[float, float], ...], rows: int, columns: int) -> bool:
    return len({x for x, _ in places}) == columns and len({y for _, y in places}) == rows

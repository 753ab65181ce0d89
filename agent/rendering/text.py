"""Format numbers and names as text, shared by the terminal, the page and the pictures."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from itertools import zip_longest
from typing import Any, TextIO

COLUMNS = 120  # largest width of a table
_GAP = "  "  # between columns
_WORD = re.compile(r"\s*(?:[^\s/]+/?|/)")  # with the space before it
_LEAST_CELL = 12  # columns that a text keeps


def number(value: float | None, digits: int = 1) -> str:
    """Format a number for display; a dash for `None`."""
    if value is None or not math.isfinite(value):
        return "-"
    return f"{value:.{digits}f}"


def duration(seconds: float | None) -> str:
    """Format seconds for people, such as "0.4 s"."""
    return f"{number(seconds, 1)} s"


def slot_label(slot: str) -> str:
    """Return a slot's name without underscores."""
    return slot.replace("_", " ")


def columns_of(stream: TextIO) -> int:
    """Return how many columns a table on a stream may have: `COLUMNS`, or fewer on a narrower terminal."""
    try:
        return min(COLUMNS, os.get_terminal_size(stream.fileno()).columns or COLUMNS)
    except (OSError, ValueError, AttributeError):  # no terminal, closed, or no file
        return COLUMNS


def aligned(rows: Sequence[Sequence[str]], left: int | None = None, width: int = COLUMNS) -> str:
    """Format a table as lines of text: the first `left` columns (all, if `None`) flush left, the others flush right.

    A table that is wider than `width` breaks its cells between words and behind slashes: those of texts, and the heads of
    numbers. If that is not enough, words are broken where all columns are texts; else numbers go below each other in blocks, each with the first `left` columns.
    """
    flush_left = len(rows[0]) if left is None else left
    columns = list(zip(*rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    if _total(widths) > width:
        for number in range(flush_left, len(widths)):
            head, *values = columns[number]
            widths[number] = max(map(len, (*head.split(), *values, "")))
        least = [_longest_word(column) for column in columns[:flush_left]]
        _narrow(widths, least, width)
        room = width - max((each + len(_GAP) for each in widths[flush_left:]), default=0)
        texts = widths[:flush_left]
        _narrow(texts, [_LEAST_CELL] * flush_left, room)  # words are broken
        widths[:flush_left] = texts
    blocks = _blocks(widths, flush_left, width)
    return "\n\n".join(_block(rows, widths, block, flush_left) for block in blocks)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + len(_GAP) * (len(widths) - 1)


def _longest_word(cells: Sequence[str]) -> int:
    return max(_LEAST_CELL, *(len(word.strip()) for cell in cells for word in _WORD.findall(cell)))


def _narrow(widths: list[int], least: Sequence[int], width: int) -> None:
    """Take away from the widest of the first columns, as far as each may go, until the table fits."""
    while _total(widths) > width:
        free = [number for number, minimum in enumerate(least) if widths[number] > minimum]
        if not free:
            return
        widths[max(free, key=widths.__getitem__)] -= 1


def _blocks(widths: Sequence[int], flush_left: int, width: int) -> list[list[int]]:
    """Return the columns of each block: the first ones in each, and as many of the others as fit."""
    first = list(range(flush_left))
    blocks = [list(first)]
    for number in range(flush_left, len(widths)):
        if blocks[-1] != first and _total([widths[each] for each in (*blocks[-1], number)]) > width:
            blocks.append(list(first))
        blocks[-1].append(number)
    return blocks


def _block(rows: Sequence[Sequence[str]], widths: Sequence[int], block: Sequence[int], flush_left: int) -> str:
    lines = []
    for row in rows:
        cells = [_broken(row[number], widths[number]) for number in block]
        for parts in zip_longest(*cells, fillvalue=""):
            filled = (
                part.ljust(widths[number]) if number < flush_left else part.rjust(widths[number])
                for part, number in zip(parts, block, strict=True)
            )
            lines.append(_GAP.join(filled).rstrip())
    return "\n".join(lines)


def _broken(cell: str, width: int) -> list[str]:
    """Return the lines of a cell; those after the first one begin as far to the right as the first."""
    if len(cell) <= width:
        return [cell]
    indent = cell[: len(cell) - len(cell.lstrip())]
    lines = [""]
    for word in _WORD.findall(cell):
        while len((lines[-1] + word).rstrip()) > width:
            if lines[-1].strip():
                lines.append(indent)
                word = word.lstrip()
            else:  # longer than a line
                room = max(1, width - len(lines[-1]))
                lines[-1:], word = [lines[-1] + word[:room], indent], word[room:]
        lines[-1] += word
    return [line.rstrip() for line in lines]


def place(position: Any, viewpoint: str = "robot") -> str:
    """Describe a position in the world frame (metres): "52 cm ahead, 10 cm to the left".

    To a speaker on the opposite side it says whose left that is: "52 cm ahead of the arm, 10 cm to its left".
    """
    x, y = round(100 * position[0]), round(100 * position[1])
    ahead, whose = (" of the arm", "its") if viewpoint == "opposite" else ("", "the")
    if y == 0:
        return f"{x} cm straight ahead{ahead}"
    return f"{x} cm ahead{ahead}, {abs(y)} cm to {whose} {'left' if y > 0 else 'right'}"


def with_indefinite_article(noun: str) -> str:
    """Return the noun as in "a mug" or "an orange"."""
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"

"""Format numbers and names as text, shared by the terminal, the page and the pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


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


def aligned(rows: Sequence[Sequence[str]], left: int | None = None) -> str:
    """Format a table as lines of text: the first `left` columns (all, if `None`) flush left, the others flush right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    flush_left = len(widths) if left is None else left
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column < flush_left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


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

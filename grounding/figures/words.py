"""Write words: a figure of the figures of its letters, side by side in reading order."""

from __future__ import annotations

import re
from collections.abc import Callable

from grounding.figures.figure import MOST, Figure, FigureError, Point

WORD = "word "  # before what is written, in place of a figure's name
_HEIGHT = 2.0  # of every letter
_GAP = 1.6  # between two letters: clearly more than there is between the objects of one


def written(text: str, letter_of: Callable[[str], Figure]) -> Figure:
    """Return the figure of a written word.

    Args:
        text: of two or more capital letters and digits.
        letter_of: returns the figure of "letter T" or "digit 7".

    Raises:
        FigureError: for another text, or a word of more objects than a figure can have.
    """
    if not re.fullmatch(r"[A-Z0-9]{2,}", text):
        raise FigureError(f"{text[:40]!r} cannot be written; legal: one word of the letters A to Z and digits")
    letters = [letter_of(f"digit {one}" if one.isdecimal() else f"letter {one}") for one in text[: MOST + 1]]
    least = sum(one.least for one in letters)
    if least > MOST:
        raise FigureError(f"the word {text[:40]!r} needs {least} objects or more; legal: up to {MOST}")
    strokes, left = list[tuple[Point, ...]](), 0.0
    for one in letters:
        points = [point for stroke in one.strokes for point in stroke]
        low, bottom = (min(point[axis] for point in points) for axis in (0, 1))
        scale = _HEIGHT / (max(y for _, y in points) - bottom)
        strokes += [
            tuple((left + (x - low) * scale, (y - bottom) * scale) for x, y in stroke) for stroke in one.strokes
        ]
        left += (max(x for x, _ in points) - low) * scale + _GAP
    return Figure(f"{WORD}{text}", (f"{WORD}{text}", text), tuple(strokes), least=least)

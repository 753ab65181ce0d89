"""The figure: a drawing seen from above, a pattern of places, or blocks that stand on each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from grounding.figures.growth import RULES, Blocks, FigureBlock, grown, pattern_places

Point = tuple[float, float]
MOST = 24  # objects of a figure: more than any table that an arm serves has


class FigureError(ValueError):
    """Raised for a figure that is not legal or not there; the message names the file or name,
    the key and what is legal.
    """


@dataclass(frozen=True)
class Figure:
    """One figure. It has either `strokes`, a `pattern` or `blocks`.

    Attributes:
        name: the shape's name in goals: "letter T".
        nouns: how people say it.
        strokes: polylines seen from above, in any unit: +x is the reader's right, +y away from the reader. A closed
            one repeats its first point; one of a single point is a dot.
        pattern: rows of a tile, the farthest first, "x" where an object stands; it is repeated as far as the objects
            reach.
        blocks: that stand on each other, seen by the reader.
        least: the fewest objects that show it.
        numbers: of objects that can show it, where not every number from `least` on can; () for blocks and patterns,
            which have theirs by themselves.
        points: whether it points somewhere, as an arrow does: a rotation says where to. Any other figure faces its
            reader.
        grows: of `grounding.figures.growth.RULES`, those by which blocks become more or fewer.

    Raises:
        FigureError: for values that make no figure.
    """

    name: str
    nouns: tuple[str, ...]
    strokes: tuple[tuple[Point, ...], ...] = ()
    pattern: tuple[str, ...] = ()
    blocks: Blocks = ()
    least: int = 0
    numbers: tuple[int, ...] = ()
    points: bool = False
    grows: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if sum(map(bool, (self.strokes, self.pattern, self.blocks))) != 1:
            raise FigureError("a figure has one of strokes, pattern and blocks")
        if not self.name or not self.nouns or not all(self.nouns):
            raise FigureError("name and nouns cannot be empty")
        if unknown := [rule for rule in self.grows if rule not in RULES]:
            raise FigureError(f"grows cannot be {unknown[0]!r}; legal values: {', '.join(RULES)}")
        if self.grows and not self.blocks:
            raise FigureError("grows needs blocks: strokes and patterns take any number of objects by themselves")
        if not all(self.strokes):
            raise FigureError("a stroke cannot be empty; legal: one point or more")
        if self.pattern and not ("x" in "".join(self.pattern) and len({len(row) for row in self.pattern}) == 1):
            raise FigureError("pattern must be rows of one length, with an x where an object stands")
        if self.blocks:
            _require_carried(self.blocks)

    @property
    def stacked(self) -> bool:
        """Return whether its objects stand on each other."""
        return bool(self.blocks)

    @cached_property
    def legal(self) -> tuple[int, ...]:
        """Return the numbers of objects, up to `MOST`, that can show it."""
        if self.blocks:
            return tuple(sorted(count for count in grown(self.blocks, self.grows, MOST) if count >= self.least))
        if self.pattern:
            return tuple(n for n in range(max(self.least, 2), MOST + 1) if pattern_places(self.pattern, n))
        return self.numbers or tuple(range(max(self.least, 1), MOST + 1))

    def blocks_of(self, count: int) -> tuple[Blocks, ...]:
        """Return the ways in which so many blocks show it, the one most like the drawing first; () for none."""
        return grown(self.blocks, self.grows, MOST).get(count, ()) if self.blocks else ()

    def legal_numbers(self) -> str:
        """Return the legal numbers of objects in words: "3, 5 or 7", "4 or more"."""
        if self.strokes and not self.numbers:
            return f"{self.legal[0]} or more"
        *others, last = map(str, self.legal)
        return f"{', '.join(others)} or {last}" if others else last


def _require_carried(blocks: Blocks) -> None:
    for block in blocks:
        below = [one for one in blocks if one.level == block.level - 1]
        if block.level and not any(abs(one.x - block.x) < (one.width + block.width) / 2 for one in below):
            raise FigureError(f"the block at x {block.x:g} of level {block.level} stands on nothing")
        if block.width <= 0 or block.level < 0:
            raise FigureError(f"the block at x {block.x:g} needs a width over 0 and a level of 0 or more")


__all__ = ["MOST", "Blocks", "Figure", "FigureBlock", "FigureError", "Point"]

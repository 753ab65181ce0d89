"""The figure: a drawing seen from above, a pattern of places, blocks that stand on each other, or exact places."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from grounding.figures.growth import RULES, Blocks, FigureBlock, grown, pattern_places

Point = tuple[float, float]
MOST = 24  # objects of a figure: more than any table that an arm serves has
ON_TABLE = 0.01  # m: a place that is lower lies on the table
MOST_COPIED = 12  # objects of an exact copy


class FigureError(ValueError):
    """Raised for a figure that is not legal or not there; the message names the file or name,
    the key and what is legal.
    """


@dataclass(frozen=True, order=True)
class FigurePlace:
    """The place of one object of an exact copy. Metres; +x is the reader's right, +y away from the reader.

    Attributes:
        x, y: of the middle of its outline.
        z: of its bottom, above the table.
        size: of its box: along `turn`, across it, and upward.
        turn: degrees from +x to the long side of its box; `None` for what is round.
    """

    x: float
    y: float
    z: float
    size: tuple[float, float, float]
    turn: float | None = None


@dataclass(frozen=True)
class Figure:
    """One figure. It has either `strokes`, a `pattern`, `blocks` or `places`.

    Attributes:
        name: the shape's name in goals: "letter T".
        nouns: how people say it.
        strokes: polylines seen from above, in any unit: +x is the reader's right, +y away from the reader. A closed
            one repeats its first point; one of a single point is a dot.
        pattern: rows of a tile, the farthest first, "x" where an object stands; it is repeated as far as the objects
            reach.
        blocks: that stand on each other, seen by the reader.
        places: of an exact copy, one for each object.
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
    places: tuple[FigurePlace, ...] = ()
    least: int = 0
    numbers: tuple[int, ...] = ()
    points: bool = False
    grows: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if sum(map(bool, (self.strokes, self.pattern, self.blocks, self.places))) != 1:
            raise FigureError("a figure has one of strokes, pattern, blocks and places")
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
        if self.places and not 2 <= len(self.places) <= MOST_COPIED:
            raise FigureError(f"an exact copy cannot have {len(self.places)} objects; legal: 2 to {MOST_COPIED}")
        if any(place.z < 0 or min(place.size) <= 0 for place in self.places):
            raise FigureError("a place needs a z of 0 or more and sizes over 0")

    @property
    def stacked(self) -> bool:
        """Return whether its objects stand on each other."""
        return bool(self.blocks) or any(place.z > ON_TABLE for place in self.places)

    @cached_property
    def legal(self) -> tuple[int, ...]:
        """Return the numbers of objects, up to `MOST`, that can show it."""
        if self.places:
            return (len(self.places),)
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
        if self.places:
            return f"exactly {len(self.places)}"
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


__all__ = ["MOST", "MOST_COPIED", "Blocks", "Figure", "FigureBlock", "FigureError", "FigurePlace", "Point"]

"""Make the figure of an example: the drawing, the pattern or the blocks that an arrangement on a table shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from grounding.figures.figure import Figure, FigureBlock, FigureError
from grounding.figures.growth import RULES, pattern_places, supports_of
from structdiffusion.figures.curves import arc_lengths, diameter, similarity

_FINE = 4  # points of a curve from one object to the next
_SAME_LINE = 0.004  # of half the diameter, by which leaving out a point may change a stroke
_STRAIGHT = math.radians(50.0)  # a stroke goes on at a junction where it turns by less
_ON_LATTICE = 0.15  # of the step: objects that miss the places of a pattern by less show it
_PATTERNS = (("x.", ".x"), ("x",))  # the chessboard and the grid
_LEAST_PATTERN = 5  # objects: fewer lie on too many patterns
# Rules by which an example grows: the first that fits says what it is; a wall alone grows in both directions.
_BESIDE = 1.4  # times the usual width: objects of one level that are nearer stand beside each other
_BRIDGES = 1.15  # times the usual width, from which on what lies on several bridges them
_RULES = (("posts",), ("steps",), ("rows", "columns"))


@dataclass(frozen=True)
class Example:
    """What stands somewhere, seen by a reader: +x is to the reader's right, +y away. Lengths in metres.

    Attributes:
        outlines: (K, 2) each, convex, of N objects.
        middles: (N, 2) their centroids.
        rests_on: for each object those that carry it; () is the table.
        bottoms: (N,) z.
        tops: (N,) z; `None` if they are not known.
    """

    outlines: tuple[np.ndarray, ...]
    middles: np.ndarray
    rests_on: tuple[tuple[int, ...], ...]
    bottoms: np.ndarray
    tops: np.ndarray | None = None


@dataclass(frozen=True)
class Reading:
    """What the places of objects show.

    Attributes:
        joined: (N, N) bool, whether two follow each other along a stroke.
        corners: (N,) bool, whether an object stands at an end, a corner or a junction.
    """

    joined: np.ndarray
    corners: np.ndarray


def figure_of(example: Example, name: str, nouns: Sequence[str], read: Callable[[Example], Reading]) -> Figure:
    """Return the figure that an example shows.

    Args:
        example: what stands there.
        name, nouns: of the figure.
        read: reads the strokes of what lies on the table, such as `models.strokes.reading.read_strokes`.

    Raises:
        FigureError: for fewer than two objects, or objects that stand on each other out of one plane.
    """
    if len(example.middles) < 2:
        raise FigureError("an example needs two objects or more")
    if any(example.rests_on):
        return _upright(example, name, nouns)
    points = example.middles
    if tile := _pattern(points):
        return Figure(name, tuple(nouns), pattern=tile, least=_LEAST_PATTERN)
    size = diameter(points)
    drawn = (points - points.mean(axis=0)) * (2.0 / size)
    reading = read(example)
    strokes = [
        tuple((round(float(x), 3), round(float(y), 3)) for x, y in _drawn(drawn, chain, reading.corners))
        for chain in strokes_through(points, reading.joined)
    ]
    ends = {end for stroke in strokes if stroke[0] != stroke[-1] or len(stroke) == 1 for end in (stroke[0], stroke[-1])}
    closed = sum(stroke[0] == stroke[-1] and len(stroke) > 1 for stroke in strokes)
    # What is needed for as many strokes and ends; whether so few show the outline is known when they are laid out.
    least = max(2, min(len(points), len(ends) + 3 * closed))
    return Figure(name, tuple(nouns), strokes=tuple(strokes), least=least)


# --- flat ones ------------------------------------------------------------------------------------


def strokes_through(points: np.ndarray, joined: np.ndarray) -> list[list[int]]:
    """Return the strokes that join points (N, 2): their indices, a closed stroke's first one twice.

    Args:
        points: middles.
        joined: (N, N) bool, which of them follow each other.
    """
    neighbours = {i: np.flatnonzero(own).tolist() for i, own in enumerate(joined)}
    strokes: list[list[int]] = []
    left = {frozenset((i, j)) for i, own in neighbours.items() for j in own}
    # From ends and junctions first; what is left then is closed.
    starts = sorted(neighbours, key=lambda i: (len(neighbours[i]) == 2, len(neighbours[i]) != 1, i))
    for start in starts:
        while ways := [j for j in neighbours[start] if frozenset((start, j)) in left]:
            stroke = [start, ways[0]]
            left.discard(frozenset(stroke))
            while (onward := _onward(neighbours, left, stroke)) is not None:
                left.discard(frozenset((stroke[-1], onward)))
                stroke.append(onward)
            strokes.append(stroke)
    return [*_through_junctions(points, strokes), *([i] for i, own in neighbours.items() if not own)]


def _drawn(points: np.ndarray, chain: Sequence[int], corners: np.ndarray) -> np.ndarray:
    """Return the polyline (P, 2) of a stroke: a curve between its corners, straight where there is nothing between."""
    import shapely
    from scipy.interpolate import CubicSpline  # takes longer to import than this module

    chain = list(chain)
    closed = len(chain) > 2 and chain[0] == chain[-1]
    if closed and (turns := [k for k, i in enumerate(chain[:-1]) if corners[i]]):
        chain = [*chain[turns[0] : -1], *chain[: turns[0] + 1]]  # begins at a corner
    whole = closed and not corners[chain[0]]
    marks = [0, *(k for k in range(1, len(chain) - 1) if corners[chain[k]]), len(chain) - 1]
    line = [points[chain[:1]]]
    for a, b in pairwise(marks):
        run = points[chain[a : b + 1]]
        if len(run) > 2:
            along = arc_lengths(run)
            at = np.interp(np.arange(1, _FINE * (b - a) + 1) / _FINE, np.arange(len(run)), along)
            run = np.vstack((run[:1], CubicSpline(along, run, bc_type="periodic" if whole else "natural")(at)))
        line.append(run[1:])
    return np.array(shapely.LineString(np.concatenate(line)).simplify(_SAME_LINE).coords) if len(chain) > 1 else line[0]


def _onward(neighbours: dict[int, list[int]], left: set[frozenset[int]], stroke: Sequence[int]) -> int | None:
    """Return where a stroke goes on; `None` at an end and at a junction."""
    here = stroke[-1]
    if len(neighbours[here]) != 2:
        return None
    return next((j for j in neighbours[here] if frozenset((here, j)) in left), None)


def _through_junctions(points: np.ndarray, strokes: list[list[int]]) -> list[list[int]]:
    """Join strokes that meet at a junction and go straight on there, the straightest first."""
    strokes = [list(stroke) for stroke in strokes]
    while True:
        best: tuple[float, int, int, list[int]] | None = None
        for a, one in enumerate(strokes):
            for b, other in enumerate(strokes):
                if a >= b or one[0] == one[-1] or other[0] == other[-1]:
                    continue
                for first in (one, one[::-1]):
                    for second in (other, other[::-1]):
                        if first[-1] == second[0]:
                            turn = _turn(points[first[-2]], points[first[-1]], points[second[1]])
                            if turn < _STRAIGHT and (best is None or turn < best[0]):
                                best = turn, a, b, [*first, *second[1:]]
        if best is None:
            return strokes
        _, a, b, joined = best
        strokes = [joined, *(stroke for k, stroke in enumerate(strokes) if k not in (a, b))]


def _turn(before: np.ndarray, here: np.ndarray, after: np.ndarray) -> float:
    one, other = here - before, after - here
    cosine = one @ other / max(np.linalg.norm(one) * np.linalg.norm(other), 1e-12)
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))


def _pattern(points: np.ndarray) -> tuple[str, ...]:
    """Return the tile of the pattern that points (N, 2) lie on; () for none."""
    from scipy.optimize import linear_sum_assignment  # takes longer to import than this module

    if len(points) < _LEAST_PATTERN:
        return ()
    about = points - points.mean(axis=0)
    for tile in _PATTERNS:
        places = np.array(pattern_places(tile, len(points))).reshape(-1, 2)
        if not len(places):
            continue
        places = places - places.mean(axis=0)
        scale = math.sqrt(float((about**2).sum() / (places**2).sum()))
        for angle in np.arange(0.0, 2 * math.pi, math.pi / 36):
            c, s = math.cos(angle), math.sin(angle)
            there = scale * places @ np.array([[c, s], [-s, c]])
            order = linear_sum_assignment(np.linalg.norm(there[:, None] - about, axis=-1))[1]
            size, turn, shift = similarity(places, about[order])
            c, s = math.cos(turn), math.sin(turn)
            off = np.linalg.norm(size * places @ np.array([[c, s], [-s, c]]) + shift - about[order], axis=1)
            if off.max() < _ON_LATTICE * size:
                return tile
    return ()


# --- upright ones ---------------------------------------------------------------------------------


def _upright(example: Example, name: str, nouns: Sequence[str]) -> Figure:
    """Return the figure of objects that stand on each other, seen across their wall."""
    middle = example.middles.mean(axis=0)
    axis = np.linalg.svd(example.middles - middle)[2][0]
    axis = axis if axis[0] >= 0 else -axis  # to the reader's right
    across = (example.middles - middle) @ np.array([-axis[1], axis[0]])
    along = (example.middles - middle) @ axis
    widths = np.array([float(np.ptp(outline @ axis)) for outline in example.outlines])
    if np.abs(across).max() > widths.min() / 2:
        raise FigureError("objects that stand on each other can be taught only as one wall, and these stand in several")
    level: dict[int, int] = {}
    for i in sorted(range(len(along)), key=lambda i: example.bottoms[i]):
        level[i] = 1 + max((level.get(j, 0) for j in example.rests_on[i]), default=-1)
    blocks = _blocks(along, level, widths, example.rests_on)
    for rules in _RULES:
        if all(any(True for _ in RULES[rule](blocks)) for rule in rules):
            return Figure(name, tuple(nouns), blocks=blocks, least=2, grows=rules)
    return Figure(name, tuple(nouns), blocks=blocks, least=2)


def _blocks(
    along: np.ndarray, level: dict[int, int], widths: np.ndarray, rests_on: Sequence[tuple[int, ...]]
) -> tuple[FigureBlock, ...]:
    """Return the blocks of objects, in steps as coarse as leave everything on what carries it."""
    usual = float(np.median(widths))
    beside = [b - a for row in _rows(along, level) for a, b in pairwise(along[row]) if b - a < _BESIDE * usual]
    unit = float(np.median(beside)) if beside else usual
    bridging = [len(own) > 1 and width > _BRIDGES * usual for own, width in zip(rests_on, widths)]
    for step in (0.5, 0.25, 0.05, 0.01):
        x = np.round((along - along.min()) / unit / step) * step
        made = [
            FigureBlock(level[i], round(float(x[i]), 3), round(float(widths[i]) / unit, 2) if bridging[i] else 1.0)
            for i in range(len(along))
        ]
        if [set(own) for own in supports_of(tuple(made))] == [set(own) for own in rests_on]:
            break
    return tuple(sorted(made))


def _rows(along: np.ndarray, level: dict[int, int]) -> list[list[int]]:
    """Return the objects of each level, from the left to the right."""
    return [
        sorted((i for i in level if level[i] == number), key=lambda i: along[i])
        for number in range(max(level.values()) + 1)
    ]

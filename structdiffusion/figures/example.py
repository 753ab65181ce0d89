"""Make the figure of an example: the drawing, the pattern or the blocks that an arrangement on a table shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from grounding.figures.figure import Figure, FigureBlock, FigureError
from grounding.figures.growth import RULES, pattern_places, supports_of
from structdiffusion.figures.curves import diameter, similarity

_LONGEST = 1.6  # times the usual distance of neighbours: what is farther apart is not joined
_FARTHER, _NEARER = 1.25, 0.8  # times the usual distance, and times the distance of the next one: another stroke begins
_UNEVEN = 0.25  # of a step, by which the next step of a stroke differs that goes on evenly
_BACK = math.radians(120.0)  # an end is not joined to what lies behind it
_BROKEN = 2.2  # times the usual distance of neighbours: the shortest tree is cut where it is longer
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
        order: the objects in the order in which they were drawn; `None` if that is not known.
        tops: (N,) z; `None` if they are not known.
    """

    outlines: tuple[np.ndarray, ...]
    middles: np.ndarray
    rests_on: tuple[tuple[int, ...], ...]
    bottoms: np.ndarray
    order: tuple[int, ...] | None = None
    tops: np.ndarray | None = None


def figure_of(example: Example, name: str, nouns: Sequence[str]) -> Figure:
    """Return the figure that an example shows.

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
    strokes = [
        tuple((round(float(x), 3), round(float(y), 3)) for x, y in drawn[list(chain)])
        for chain in strokes_through(points, example.order)
    ]
    ends = {end for stroke in strokes if stroke[0] != stroke[-1] or len(stroke) == 1 for end in (stroke[0], stroke[-1])}
    closed = sum(stroke[0] == stroke[-1] and len(stroke) > 1 for stroke in strokes)
    # What is needed for as many strokes and ends; whether so few show the outline is known when they are laid out.
    least = max(2, min(len(points), len(ends) + 3 * closed))
    return Figure(name, tuple(nouns), strokes=tuple(strokes), least=least)


# --- flat ones ------------------------------------------------------------------------------------


def strokes_through(points: np.ndarray, order: Sequence[int] | None = None) -> list[list[int]]:
    """Return the strokes that join neighbouring points (N, 2): their indices, a closed stroke's first one twice.

    Without the order of the drawing, the shortest tree joins the points, and so are two to which no third is nearer
    than they are to each other (the relative neighbourhood graph), where they are not much farther apart than usual.
    """
    neighbours = _joined(points) if order is None else _in_order(points, order)
    strokes: list[list[int]] = []
    left = {frozenset((i, j)) for i, own in neighbours.items() for j in own}
    # From ends and junctions first; what is left then is closed.
    starts = sorted(neighbours, key=lambda i: (len(neighbours[i]) == 2, len(neighbours[i]) != 1, i))
    for start in starts:
        while ways := [j for j in neighbours[start] if frozenset((start, j)) in left]:
            stroke = [start, ways[0]]
            left.discard(frozenset(stroke))
            while (onward := _onward(points, neighbours, left, stroke)) is not None:
                left.discard(frozenset((stroke[-1], onward)))
                stroke.append(onward)
            strokes.append(stroke)
    return [*_through_junctions(points, strokes), *([i] for i, own in neighbours.items() if not own)]


def _joined(points: np.ndarray) -> dict[int, list[int]]:
    """Return for each point those that it is joined to, from their places alone."""
    distances = np.linalg.norm(points[:, None] - points, axis=-1)
    np.fill_diagonal(distances, np.inf)
    tree = _shortest_tree(distances)
    usual = float(np.median([distances[i, j] for i, j in tree]))
    edges = {edge for edge in tree if distances[edge] <= _BROKEN * usual}
    for i in range(len(points)):
        for j in range(i):
            between = np.maximum(distances[i], distances[j]).min() < distances[i, j] - 1e-9
            if not between and distances[i, j] <= _LONGEST * usual:
                edges.add((j, i))
    return _neighbours(len(points), edges)


def _in_order(points: np.ndarray, order: Sequence[int]) -> dict[int, list[int]]:
    """Return for each point those that it is joined to, where the order is that of the drawing.

    Each is joined to the next one within a usual distance, or where a stroke goes on straight and evenly, unless the
    next is nearer to what is there already: then another stroke begins on that. Ends are joined to other ends, or to
    what they end on.
    """
    distances = np.linalg.norm(points[:, None] - points, axis=-1)
    np.fill_diagonal(distances, np.inf)
    usual = float(np.median(distances.min(axis=1)))
    pairs = list(pairwise(order))
    even = [
        abs(distances[i, j] - distances[j, k]) <= _UNEVEN * distances[i, j]
        and _turn(points[i], points[j], points[k]) < _STRAIGHT
        for i, j, k in zip(order, order[1:], order[2:])
    ]
    edges = set()
    for number, (i, j) in enumerate(pairs):
        elsewhere = any(distances[k, j] < _NEARER * distances[i, j] for k in order[:number])
        begins = elsewhere and distances[i, j] > _FARTHER * usual
        if not begins and (distances[i, j] <= _LONGEST * usual or any(even[max(number - 1, 0) : number + 1])):
            edges.add((min(i, j), max(i, j)))
    neighbours = _neighbours(len(points), edges)
    for alone in [i for i, own in neighbours.items() if not own]:
        onto = int(distances[alone].argmin())
        if distances[alone, onto] <= _FARTHER * usual:
            edges.add((min(alone, onto), max(alone, onto)))
    neighbours = _neighbours(len(points), edges)
    ends = [i for i, own in neighbours.items() if len(own) == 1]
    for end in ends:
        (before,) = neighbours[end]
        reach = _FARTHER * max(usual, distances[end, before])
        near = [
            j
            for j in np.flatnonzero(distances[end] <= reach).tolist()
            if j != before and j not in neighbours[before] and _turn(points[before], points[end], points[j]) < _BACK
        ]
        if near:
            onto = min(near, key=lambda j: (j not in ends, distances[end, j]))
            edges.add((min(end, onto), max(end, onto)))
    return _neighbours(len(points), edges)


def _neighbours(count: int, edges: Iterable[tuple[int, int]]) -> dict[int, list[int]]:
    neighbours: dict[int, list[int]] = {i: [] for i in range(count)}
    for i, j in sorted(edges):
        neighbours[i].append(j)
        neighbours[j].append(i)
    return neighbours


def _shortest_tree(distances: np.ndarray) -> list[tuple[int, int]]:
    """Return the edges of the shortest tree that joins all points, by their distances (N, N)."""
    edges: list[tuple[int, int]] = []
    nearest, to = distances[0].copy(), np.zeros(len(distances), int)
    nearest[0] = np.inf
    joined = {0}
    while len(joined) < len(distances):
        new = int(nearest.argmin())
        edges.append((min(new, int(to[new])), max(new, int(to[new]))))
        joined.add(new)
        closer = distances[new] < nearest
        nearest, to = np.where(closer, distances[new], nearest), np.where(closer, new, to)
        nearest[list(joined)] = np.inf
    return edges


def _onward(
    points: np.ndarray, neighbours: dict[int, list[int]], left: set[frozenset[int]], stroke: Sequence[int]
) -> int | None:
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

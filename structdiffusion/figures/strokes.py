"""Sample the strokes of a figure at a number of places, so that ends,
corners and junctions are kept and gaps are even.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from grounding.figures.figure import Figure
from grounding.figures.growth import pattern_places
from structdiffusion.evaluation_protocol import MAX_FIGURE_OFF_SHARE, MAX_GAP_VARIATION
from structdiffusion.figures.curves import arc_lengths, chamfer, diameter, sampled

_SAME = 0.02  # of the diameter: points that are nearer are one place, such as where strokes meet
_CORNER = math.radians(35.0)  # a stroke that turns by more has a corner there
_MOST_SUMS = 60_000  # more ways to share places out are not compared: the letter B of 24 objects has 53,130
_WAYS = 4  # of sharing places out, those whose longest step is the shortest, that are compared with the drawing
_APART = 1.6  # times the wider of two steps: places that are farther apart are no neighbours in the drawing


@dataclass(frozen=True)
class Places:
    """Where objects stand that show a figure, in its own coordinates and unit.

    Attributes:
        points: (N, 2).
        axes: (N,) the direction of the stroke there, radians.
        chains: the places along each stroke, in its direction; a closed one repeats its first place. Dots have none.
        corners: (N,) whether a place is an end, a corner or a junction, which is to be kept.
        curves: (P, 2) each: what the places are sampled of.
        width: the largest distance between two points of the drawing.
    """

    points: np.ndarray
    axes: np.ndarray
    chains: tuple[tuple[int, ...], ...]
    corners: np.ndarray
    curves: tuple[np.ndarray, ...]
    width: float

    @property
    def steps(self) -> list[tuple[int, int]]:
        """Return the pairs of places that follow each other along a stroke."""
        return list(dict.fromkeys((i, j) for chain in self.chains for i, j in pairwise(chain)))

    def lines(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return points (N, 2) that stand on the places, joined by the strokes: (Q, 2) each; dots are lines of one."""
        joined = {i for chain in self.chains for i in chain}
        dots = [points[i][None] for i in range(len(points)) if i not in joined]
        return (*(points[list(chain)] for chain in self.chains), *dots)

    def apart(self) -> list[tuple[int, int]]:
        """Return the pairs of places that are clearly apart in the drawing: not joined,
        and farther than two that are.
        """
        steps = {frozenset(step) for step in self.steps}
        longest = np.zeros(len(self.points))
        for i, j in self.steps:
            length = float(np.linalg.norm(self.points[i] - self.points[j]))
            longest[[i, j]] = np.maximum(longest[[i, j]], length)
        distances = np.linalg.norm(self.points[:, None] - self.points, axis=-1)
        return [
            (i, j)
            for i in range(len(self.points))
            for j in range(i + 1, len(self.points))
            if frozenset((i, j)) not in steps and distances[i, j] > _APART * max(longest[i], longest[j], 1e-9)
        ]


@lru_cache(maxsize=512)
def places_of(figure: Figure, count: int) -> Places:
    """Return where so many objects stand.

    Raises:
        ValueError: for a number of objects that cannot show the figure, or blocks.
    """
    if count not in figure.legal or figure.blocks:
        raise ValueError(f"{figure.name!r} cannot be sampled at {count} places; legal: {figure.legal_numbers()}")
    if figure.pattern:
        points = np.array(pattern_places(figure.pattern, count))
        points = points - points.mean(axis=0)
        dots = tuple(point[None] for point in points)
        return Places(points, np.zeros(count), (), np.ones(count, bool), dots, diameter(points))
    drawing = Drawing(figure.strokes)
    options = [each for least in drawing.choices() for each in drawing.sampled(least, count)]
    if not options:
        raise ValueError(f"{figure.name!r} has more strokes than {count} objects can show")
    return min(options, key=_cost)


def _cost(places: Places) -> float:
    """Return how far places are from the drawing, and how uneven their steps are, each in units of its limit."""
    off = chamfer(
        sampled(places.lines(places.points), 0.01 * places.width), sampled(places.curves, 0.01 * places.width)
    )
    uneven = [
        variation(np.array([np.linalg.norm(places.points[i] - places.points[j]) for i, j in pairwise(chain)]))
        for chain in places.chains
    ]
    steps = np.array([np.linalg.norm(places.points[i] - places.points[j]) for i, j in places.steps])
    longest = float(steps.max() / steps.mean()) - 1.0 if len(steps) else 0.0
    # The drawing counts more: what is uneven is evened out when the objects' widths are known. From one stroke to
    # another steps may differ, but a stroke of one long step, as the bar of an H, is hardly seen.
    return (
        6.0 * off / (MAX_FIGURE_OFF_SHARE * places.width)
        + 0.5 * (max(uneven, default=0.0) + longest) / MAX_GAP_VARIATION
    )


def variation(gaps: np.ndarray) -> float:
    """Return the coefficient of variation of gaps; 0 for fewer than two."""
    return float(gaps.std() / max(gaps.mean(), 1e-9)) if len(gaps) > 1 else 0.0


class Drawing:
    """The strokes of a figure with their ends, corners and junctions.

    Args:
        strokes: polylines, as in `Figure`.
    """

    def __init__(self, strokes: Sequence[Sequence[tuple[float, float]]]) -> None:
        self.curves = tuple(np.array(stroke, float).reshape(-1, 2) for stroke in strokes)
        points = np.concatenate(self.curves)
        self.width = diameter(points) or 1.0
        self.along = [arc_lengths(curve) for curve in self.curves]
        # (stroke, place along it) -> how much a place there has to be kept: corners by their angle, the rest always.
        self.keys = [self._keys(k) for k in range(len(self.curves))]

    def choices(self) -> list[float]:
        """Return the angles (rad) from which on corners are kept: all, fewer and fewer, none."""
        angles = sorted({round(worth, 3) for keys in self.keys for worth in keys.values() if worth < math.inf})
        return [0.0, *(angle + 1e-3 for angle in angles)]

    def sampled(self, least: float, count: int) -> list[Places]:
        """Return ways to have `count` places with the corners whose angle is `least` or more;
        none if these are too many.
        """
        nodes, spans = self._kept(least)
        return [self._placed(list(nodes), spans, inner) for inner in self._shared(spans, count - len(nodes))]

    def plain(self, count: int, least: float = 0.0) -> Places | None:
        """Return `count` places with the corners whose angle is `least` or more, the others given one after another to
        the longest step; `None` if there are more corners.
        """
        nodes, spans = self._kept(least)
        inner = self._greedy(spans, count - len(nodes))
        return None if inner is None else self._placed(nodes, spans, inner.tolist())

    def _kept(self, least: float) -> tuple[list[np.ndarray], list[tuple[int, float, float]]]:
        """Return the places that are kept where corners turn by `least` or more, and the spans between them: stroke,
        from, to.
        """
        stops = [sorted(t for t, worth in keys.items() if worth >= least) for keys in self.keys]
        nodes: list[np.ndarray] = []
        spans: list[tuple[int, float, float]] = []
        for k, curve in enumerate(self.curves):
            if len(curve) == 1:
                self._node(nodes, curve[0])
                continue
            own = stops[k] or [0.0]
            if self._closed(k):
                total = float(self.along[k][-1])
                own = [*[t for t in own if t < total - 1e-9], own[0] + total]
            spans += [(k, a, b) for a, b in pairwise(own)]
        for k, a, b in spans:
            self._node(nodes, self._at(k, a))
            self._node(nodes, self._at(k, b))
        return nodes, spans

    def _placed(
        self, nodes: list[np.ndarray], spans: Sequence[tuple[int, float, float]], inner: Sequence[int]
    ) -> Places:
        """Return places at the nodes and, evenly, at so many others inside each span."""
        corners = len(nodes)
        axes: dict[int, float] = {}
        joined: dict[int, list[int]] = {}
        for (k, a, b), number in zip(spans, inner):
            chain = [self._node(nodes, self._at(k, a))]
            for step in range(1, number + 1):
                nodes.append(self._at(k, a + (b - a) * step / (number + 1)))
                chain.append(len(nodes) - 1)
            chain.append(self._node(nodes, self._at(k, b)))
            axes |= {i: self._direction(k, float(t)) for t, i in zip(np.linspace(a, b, len(chain)), chain)}
            joined[k] = [*joined.get(k, [])[:-1], *chain]
        directions = np.array([axes.get(i, 0.0) for i in range(len(nodes))])
        chains = tuple(map(tuple, joined.values()))
        return Places(np.array(nodes), directions, chains, np.arange(len(nodes)) < corners, self.curves, self.width)

    def _shared(self, spans: Sequence[tuple[int, float, float]], left: int) -> list[list[int]]:
        """Return ways to share so many places out inside the spans, so that steps are about even.

        One way gives them one after another to the longest step; in the others, spans that are equally long, such as
        both halves of the bar of a T, get equally many.
        """
        inner = self._greedy(spans, left)
        if inner is None:
            return []
        lengths, least = self._lengths(spans), self._least(spans)
        ways = [inner[None]]
        # Equally long spans of one stroke, and of all, as the four halves of the legs of an H
        for of_stroke in (True, False):
            alike: dict[tuple[int, float], list[int]] = {}
            for number, (k, a, b) in enumerate(spans):
                alike.setdefault((k if of_stroke else 0, round((b - a) / self.width, 2)), []).append(number)
            if alike and math.comb(left + len(alike) - 1, left) > _MOST_SUMS:
                continue
            counts = np.array(list(_sums([len(group) for group in alike.values()], left)), int)
            found = np.zeros((len(counts), len(spans)), int)
            for column, group in enumerate(alike.values()):
                found[:, group] = counts[:, column, None] if len(counts) else 0
            ways.append(found[(found >= least).all(axis=1)])
        every = np.concatenate(ways)
        best = (lengths / (every + 1)).max(axis=1, initial=0.0).argsort(kind="stable")[:_WAYS]
        return [every[k].tolist() for k in dict.fromkeys((0, *best.tolist()))]

    def _greedy(self, spans: Sequence[tuple[int, float, float]], left: int) -> np.ndarray | None:
        """Return how many places each span gets if the longest step always gets the next; `None` if they are too
        few.
        """
        lengths, inner = self._lengths(spans), self._least(spans)
        if left < inner.sum() or not (len(spans) or left == 0):
            return None
        for _ in range(left - int(inner.sum())):
            inner[int((lengths / (inner + 1)).argmax())] += 1
        return inner

    def _lengths(self, spans: Sequence[tuple[int, float, float]]) -> np.ndarray:
        return np.array([b - a for _, a, b in spans])

    def _least(self, spans: Sequence[tuple[int, float, float]]) -> np.ndarray:
        """Return how many places each span needs: one that returns to its start needs two at least to be seen."""
        return np.array([
            2 if np.linalg.norm(self._at(k, a) - self._at(k, b)) < _SAME * self.width else 0 for k, a, b in spans
        ], int)  # fmt: skip

    def _keys(self, number: int) -> dict[float, float]:
        """Return the places along a stroke that may have to be kept, with their worth: an angle, or infinity."""
        curve, along = self.curves[number], self.along[number]
        keys: dict[float, float] = {}
        if len(curve) > 1 and not self._closed(number):
            keys = {0.0: math.inf, float(along[-1]): math.inf}
        for t, angle in self._corners(number):
            keys.setdefault(t, angle)
        for other in range(len(self.curves)):
            if other != number:
                for t in _meetings(curve, along, self.curves[other], _SAME * self.width):
                    near = next((key for key in keys if abs(key - t) < 2 * _SAME * self.width), t)
                    keys[near] = math.inf
        return keys

    def _corners(self, number: int) -> list[tuple[float, float]]:
        """Return where a stroke turns sharply, and by how much (rad)."""
        curve, along = self.curves[number], self.along[number]
        ways = np.diff(curve, axis=0)
        headings = np.arctan2(ways[:, 1], ways[:, 0])
        turns = np.abs((np.diff(headings) + math.pi) % (2 * math.pi) - math.pi)
        found = [(float(along[k + 1]), float(turn)) for k, turn in enumerate(turns) if turn > _CORNER]
        if self._closed(number):
            turn = abs((headings[0] - headings[-1] + math.pi) % (2 * math.pi) - math.pi)
            if turn > _CORNER:
                found.append((0.0, float(turn)))
        return found

    def _closed(self, number: int) -> bool:
        curve = self.curves[number]
        return len(curve) > 2 and float(np.linalg.norm(curve[0] - curve[-1])) < _SAME * self.width

    def _node(self, nodes: list[np.ndarray], point: np.ndarray) -> int:
        """Return the number of the place at a point; a new one if there is none."""
        for k, there in enumerate(nodes):
            if np.linalg.norm(there - point) < 1.5 * _SAME * self.width:
                return k
        nodes.append(point)
        return len(nodes) - 1

    def _at(self, number: int, t: float) -> np.ndarray:
        along, curve = self.along[number], self.curves[number]
        t = t % along[-1] if self._closed(number) and t > along[-1] else t
        return np.array([np.interp(t, along, curve[:, 0]), np.interp(t, along, curve[:, 1])])

    def _direction(self, number: int, t: float) -> float:
        step = 0.02 * float(self.along[number][-1])
        low, high = (
            (t - step, t + step)
            if self._closed(number)
            else (max(t - step, 0.0), min(t + step, self.along[number][-1]))
        )
        way = self._at(number, high) - self._at(number, low % self.along[number][-1] if low < 0 else low)
        return math.atan2(way[1], way[0])


def _sums(sizes: Sequence[int], total: int) -> Iterator[tuple[int, ...]]:
    """Yield the counts with which groups of these sizes have a total."""
    if not sizes:
        if not total:
            yield ()
        return
    for count in range(total // sizes[0] + 1):
        yield from ((count, *rest) for rest in _sums(sizes[1:], total - count * sizes[0]))


def _meetings(curve: np.ndarray, along: np.ndarray, other: np.ndarray, tolerance: float) -> list[float]:
    """Return the places along a stroke where another one ends on it, begins on it, or crosses it."""
    found = []
    for k, (a, b) in enumerate(pairwise(curve)):
        way, length = b - a, float(np.linalg.norm(b - a))
        for point in (other[0], other[-1]):
            share = float(np.clip((point - a) @ way / max(length**2, 1e-12), 0.0, 1.0))
            if np.linalg.norm(a + share * way - point) < tolerance:
                found.append(float(along[k] + share * length))
        for c, d in pairwise(other):
            system = np.column_stack((way, c - d))
            if abs(np.linalg.det(system)) > 1e-9:
                share, elsewhere = np.linalg.solve(system, c - a)
                if -1e-9 <= share <= 1 + 1e-9 and -1e-9 <= elsewhere <= 1 + 1e-9:
                    found.append(float(along[k] + share * length))
    if len(other) == 1:
        return []
    merged: list[float] = []
    for t in sorted(found):
        if not merged or t - merged[-1] > 2 * tolerance:
            merged.append(t)
    return merged

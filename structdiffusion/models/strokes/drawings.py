"""Draw arrangements that show drawings, to train the stroke network: figures of the library, and random strokes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grounding.figures.names import figure_named, shipped_names
from structdiffusion.figures.strokes import Drawing, Places

# The families of the benchmark of figures, and what is a mirror or a part of one: nothing is trained on them.
NEVER = (
    "letter T", "letter L", "letter V", "heart", "star", "spiral", "zigzag", "chessboard", "smiley", "gate", "stairs",
    "brick wall", "sad face", "letter N", "letter M", "letter W", "letter Z", "lightning bolt", "check mark", "digit 7",
)  # fmt: skip
FAMILIES = tuple(name for name in shipped_names() if name not in NEVER and figure_named(name).strokes)
FEWEST, MOST = 3, 18  # objects
_OF_LIBRARY = 0.6  # share of the drawings
_WITH_DOTS, _MOST_DOTS = 0.3, 3  # share of the drawings that get dots beside their strokes
_ALL_CORNERS = 0.7  # share of the arrangements that have an object at every corner
# Left out, because nobody could read them: longer and shorter steps, and strokes that are nearer. In usual steps.
_LONGEST, _SHORTEST, _NEAREST = 2.4, 0.4, 0.4
_RADII, _OTHER_RADII = (0.25, 0.42), 0.25  # usual steps, of most objects; spread of their logarithms
_EVENED = 12  # rounds in which gaps become even
_OFF = (0.0, 0.01, 0.03, 0.06)  # usual steps, standard deviations by which objects miss their places
Rng = np.random.Generator


@dataclass(frozen=True)
class DrawnExample:
    """An arrangement with what it shows.

    Attributes:
        points: (N, 2) middles.
        gaps: (N, N) clear gaps of the outlines.
        joined: (N, N) bool, whether two follow each other along a stroke.
        corners: (N,) bool, whether an object stands at an end, a corner or a junction.
    """

    points: np.ndarray
    gaps: np.ndarray
    joined: np.ndarray
    corners: np.ndarray


def draw_example(rng: Rng) -> DrawnExample:
    """Draw an arrangement of `FEWEST` to `MOST` objects, in any unit."""
    while True:
        drawing = Drawing([stroke.tolist() for stroke in _deformed(_strokes(rng), rng)])
        least = 0.0 if rng.random() < _ALL_CORNERS else float(rng.choice(drawing.choices()))
        places = drawing.plain(int(rng.integers(FEWEST, MOST + 1)), least)
        if places is None:
            continue
        joined = _joined(places)
        if usual := _usual_step(places, joined):
            return _arranged(places, joined, usual, rng)


def _strokes(rng: Rng) -> list[np.ndarray]:
    """Draw a figure of the library or some strokes; some get dots beside them."""
    if rng.random() < _OF_LIBRARY:
        strokes = [np.array(stroke, float) for stroke in figure_named(str(rng.choice(FAMILIES))).strokes]
    else:
        strokes = _some_strokes(rng)
    if rng.random() < _WITH_DOTS:
        points = np.concatenate(strokes)
        count = int(rng.integers(1, _MOST_DOTS + 1))
        strokes += list(rng.uniform(points.min(axis=0), points.max(axis=0), (count, 1, 2)))
    return strokes


def _some_strokes(rng: Rng) -> list[np.ndarray]:
    """Draw one to four strokes, of which most begin on another."""
    strokes: list[np.ndarray] = []
    for _ in range(int(rng.choice([1, 1, 2, 2, 3, 4]))):
        start = rng.uniform(-1.0, 1.0, 2)
        if strokes and rng.random() < 0.7:
            other = strokes[rng.integers(len(strokes))]
            at = int(rng.integers(max(len(other) - 1, 1)))
            start = other[at] + rng.choice([0.0, 0.35, 0.5, 0.65, 1.0]) * (
                other[min(at + 1, len(other) - 1)] - other[at]
            )
        strokes.append(start + _KINDS[rng.choice(len(_KINDS), p=_SHARES)](rng.uniform(0.0, 2 * math.pi), rng))
    return strokes


def _straight(heading: float, rng: Rng) -> np.ndarray:
    return np.outer([0.0, rng.uniform(0.5, 2.0)], [math.cos(heading), math.sin(heading)])


def _bent(heading: float, rng: Rng) -> np.ndarray:
    """Draw three to five straight pieces. Two would be an L or a V."""
    count = int(rng.integers(3, 6))
    turns = rng.uniform(0.6, 2.4, count) * rng.choice([-1, 1], count)
    return _along(heading + np.cumsum(turns), rng.uniform(0.5, 1.4, count))


def _curved(heading: float, rng: Rng) -> np.ndarray:
    """Draw a curve that turns by other rates now and then."""
    rates = np.repeat(rng.uniform(-0.35, 0.35, 4), 4)
    return _along(heading + np.cumsum(rates), np.full(16, rng.uniform(0.08, 0.18)))


def _arc(heading: float, rng: Rng) -> np.ndarray:
    return _round(heading, rng.uniform(1.5, 5.0), 16, rng)


def _closed(heading: float, rng: Rng) -> np.ndarray:
    return _round(heading, 2 * math.pi, 20, rng)


def _polygon(heading: float, rng: Rng) -> np.ndarray:
    return _round(heading, 2 * math.pi, int(rng.integers(3, 7)), rng)


def _along(headings: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    steps = lengths[:, None] * np.column_stack((np.cos(headings), np.sin(headings)))
    return np.vstack((np.zeros(2), np.cumsum(steps, axis=0)))


def _round(heading: float, span: float, pieces: int, rng: Rng) -> np.ndarray:
    """Draw a part of an ellipse in straight pieces; the whole of it is closed."""
    angles = heading + np.linspace(0.0, span, pieces + 1)
    found = rng.uniform(0.4, 1.1) * np.column_stack((np.cos(angles) * rng.uniform(0.6, 1.0), np.sin(angles)))
    if span > 6.2:
        found[-1] = found[0]
    return found - found[0]


_KINDS: tuple[Callable[[float, Rng], np.ndarray], ...] = (_straight, _bent, _curved, _arc, _closed, _polygon)
_SHARES = (0.24, 0.26, 0.18, 0.13, 0.11, 0.08)


def _deformed(strokes: list[np.ndarray], rng: Rng) -> list[np.ndarray]:
    """Return strokes turned, stretched, slanted, and half of the time mirrored."""
    angle = rng.uniform(0.0, 2 * math.pi)
    c, s = math.cos(angle), math.sin(angle)
    map_of = np.array([[c, -s], [s, c]]) @ np.diag([1.0, rng.uniform(0.7, 1.4)])
    map_of = map_of @ np.array([[rng.choice([-1.0, 1.0]), rng.uniform(-0.25, 0.25)], [0.0, 1.0]])
    return [stroke @ map_of.T for stroke in strokes]


def _usual_step(places: Places, joined: np.ndarray) -> float:
    """Return the median step along the strokes; 0 where steps differ too much, or strokes are too near to read."""
    if not joined.any():
        return 0.0
    distances = np.linalg.norm(places.points[:, None] - places.points, axis=-1)
    steps, others = distances[joined], distances[~joined & ~np.eye(len(joined), dtype=bool)]
    usual = float(np.median(steps))
    legible = _SHORTEST * usual <= steps.min() and steps.max() <= _LONGEST * usual
    return usual if legible and others.min(initial=math.inf) >= _NEAREST * usual else 0.0


def _joined(places: Places) -> np.ndarray:
    """Return whether places are joined, (N, N) bool."""
    joined = np.zeros((len(places.points),) * 2, bool)
    for i, j in places.steps:
        joined[i, j] = joined[j, i] = True
    return joined


def _arranged(places: Places, joined: np.ndarray, usual: float, rng: Rng) -> DrawnExample:
    """Put objects of some widths on the places, with even gaps along each stroke, and then a little off."""
    count = len(places.points)
    radii = usual * np.minimum(rng.uniform(*_RADII) * np.exp(rng.normal(0.0, _OTHER_RADII, count)), 0.48)
    points = places.points.copy()
    for chain in [np.array(chain) for chain in places.chains for _ in range(_EVENED)]:
        ways = points[chain[1:]] - points[chain[:-1]]
        lengths = np.linalg.norm(ways, axis=1)
        gaps = lengths - radii[chain[1:]] - radii[chain[:-1]]
        moves = ((gaps - gaps.mean()) / np.maximum(lengths, 1e-9) / 4)[:, None] * ways
        np.add.at(points, chain[:-1], moves)
        np.add.at(points, chain[1:], -moves)
    points += rng.normal(0.0, rng.choice(_OFF) * usual, points.shape)
    gaps = np.linalg.norm(points[:, None] - points, axis=-1) - radii[:, None] - radii
    return DrawnExample(points, gaps, joined, places.corners)

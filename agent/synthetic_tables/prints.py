"""Print the surfaces of objects as those of real ones are: labels, bands, caps, handles, sides and insides in other
colours.

A print is a number of layers, each of one colour, painted one over the other. Each is a set of surface points in the
object's own frame, z up from where it stands, metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_MOST_LAYERS = 5
_SIDEWAYS, _UPWARD = 0.5, 0.8  # the z of normals of sides, at most, and of tops, at least
_NEUTRAL = 0.35  # share of colours that are white, gray or black: most labels are
_LETTERS = (0.003, 0.009)  # m across what stands for a letter


@dataclass(frozen=True)
class Surface:
    """Points of an object's surface, in its own frame.

    Attributes:
        points, normals: (P, 3) metres and unit.
        low, high: (3,) the corners of the box around the whole object, metres.
    """

    points: np.ndarray
    normals: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def unrolled(self) -> np.ndarray:
        """Return places (P, 2) on the unrolled surface, metres: around the object and up,
        and seen from above on tops.
        """
        middle = (self.low + self.high)[:2] / 2
        x, y = (self.points[:, :2] - middle).T
        radius = max(float((self.high - self.low)[:2].mean()) / 2, 1e-3)
        sides = np.column_stack((radius * np.arctan2(y, x), self.points[:, 2]))
        return np.where(np.abs(self.normals[:, 2:]) > _UPWARD, np.column_stack((x + 1.0, y + 1.0)), sides)


Where = Callable[[Surface], np.ndarray]  # the points (P,) of a layer


@dataclass(frozen=True)
class Print:
    """The colours of an object.

    Attributes:
        base: (3,) linear RGB, 0 to 1.
        layers: the points and the linear RGB (3,) of each, the uppermost last.
    """

    base: np.ndarray
    layers: tuple[tuple[Where, np.ndarray], ...] = ()

    def colors(self, surface: Surface) -> np.ndarray:
        """Return the linear colours (P, 3) of points."""
        found = np.tile(self.base, (len(surface.points), 1))
        for where, color in self.layers:
            found[where(surface)] = color
        return found


def draw_print(rng: np.random.Generator) -> Print:
    """Draw a print of up to five layers."""
    draws = (_band, _band, _cap, _end, _side, _side, _top, _inside, _label, _label, _letters, _letters)
    layers = [
        (draws[int(rng.integers(len(draws)))](rng), _color(rng)) for _ in range(int(rng.integers(1, _MOST_LAYERS + 1)))
    ]
    return Print(_color(rng), tuple(layers))


def _color(rng: np.random.Generator) -> np.ndarray:
    if rng.random() < _NEUTRAL:
        return np.full(3, rng.uniform(0.05, 0.95))
    return rng.uniform(0.05, 0.95, 3)


def _share(surface: Surface, axis: int) -> np.ndarray:
    """Return where points (P,) are along an axis: 0 at one end of the object and 1 at the other."""
    size = max(float(surface.high[axis] - surface.low[axis]), 1e-6)
    return (surface.points[:, axis] - surface.low[axis]) / size


def _band(rng: np.random.Generator) -> Where:
    """Draw a band around the object, such as the label of a tin."""
    low, high = np.sort(rng.uniform(-0.05, 1.05, 2))
    return lambda surface: (_share(surface, 2) > low) & (_share(surface, 2) < high) & (
        np.abs(surface.normals[:, 2]) < _UPWARD
    )  # fmt: skip


def _cap(rng: np.random.Generator) -> Where:
    """Draw the upper end: a cap, a lid, the rim of a cup."""
    begin = rng.uniform(0.6, 0.97)
    return lambda surface: _share(surface, 2) > begin


def _end(rng: np.random.Generator) -> Where:
    """Draw one end of the object's longer side: a handle, a blade."""
    begin, swapped = rng.uniform(0.25, 0.75), rng.random() < 0.5

    def where(surface: Surface) -> np.ndarray:
        along = _share(surface, int((surface.high - surface.low)[:2].argmax()))
        return (1.0 - along if swapped else along) > begin

    return where


def _side(rng: np.random.Generator) -> Where:
    """Draw a side of a box, or a quarter of a tin."""
    turn = math.pi / 2 * rng.integers(4)
    way = np.array([math.cos(turn), math.sin(turn)])
    return lambda surface: surface.normals[:, :2] @ way > math.sqrt(0.5)


def _top(rng: np.random.Generator) -> Where:
    """Draw what faces up."""
    limit = rng.uniform(_SIDEWAYS, _UPWARD)
    return lambda surface: surface.normals[:, 2] > limit


def _inside(rng: np.random.Generator) -> Where:
    """Draw the inside of a vessel: what faces the axis."""
    limit = rng.uniform(0.0, 0.3)

    def where(surface: Surface) -> np.ndarray:
        out = surface.points[:, :2] - (surface.low + surface.high)[:2] / 2
        return (out * surface.normals[:, :2]).sum(axis=1) < -limit * np.linalg.norm(out, axis=1)

    return where


def _label(rng: np.random.Generator) -> Where:
    """Draw rectangles and discs anywhere: pictures and logos."""
    count = int(rng.integers(1, 6))
    middles, halves = rng.uniform(-0.15, 0.25, (count, 2)), rng.uniform(0.008, 0.05, (count, 2))
    above, round_ones = rng.random(count) < 0.4, rng.random(count) < 0.4
    middles += above[:, None] * 0.95  # where tops are unrolled to

    def where(surface: Surface) -> np.ndarray:
        off = np.abs(surface.unrolled[:, None] - middles) / halves
        return np.where(round_ones, (off**2).sum(axis=2) < 1.0, off.max(axis=2) < 1.0).any(axis=1)

    return where


def _letters(rng: np.random.Generator) -> Where:
    """Draw lines of small print."""
    size, dense = rng.uniform(*_LETTERS), rng.uniform(0.3, 0.7)
    lines = rng.integers(2, 6)
    inked = rng.random((64, 64)) < dense

    def where(surface: Surface) -> np.ndarray:
        column, row = np.floor(surface.unrolled / size).astype(int).T
        return inked[row % 64, column % 64] & ((row // 2) % lines == 0)

    return where

"""Find which object stands on which place of a figure, and how far the whole is from the drawing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from structdiffusion.figures.curves import chamfer, moved, sampled, similarity
from structdiffusion.figures.strokes import Places

# m between samples of outlines, which are coarser where a figure is wider than any table by so many of them.
_SAMPLE, _MOST_SAMPLES = 0.01, 200
_ROUNDS = 8  # of assigning places and fitting
_STARTS = 16  # angles from which the fit begins
_REACHES = 20  # rounds after which it is measured again how far outlines reach toward each other
_EVEN = 1e-4  # m from the mean gap, within which gaps are even
# Share of what an object was moved off its stroke, or an end or corner off its place, that is taken back in a round.
_BACK, _CORNERS_BACK = 0.2, 0.02
_FARTHEST = 0.4  # of the mean step along the strokes, by which an object is moved at most
_BETTER = 0.8  # of the distance of an earlier start, from which on another counts: a figure may look the same turned
_GOOD = 0.03  # of the diameter: objects that miss their places by less in the mean need no other start


@dataclass(frozen=True)
class Match:
    """How objects show a figure.

    Attributes:
        order: (N,) the object on each place.
        heading: by how much the drawing is turned, radians: 0 if its right is +x and its top +y.
        scale: metres in a unit of the drawing.
        off: Chamfer distance of the objects, joined by the strokes, and the drawing, over the drawing's diameter.
    """

    order: np.ndarray
    heading: float
    scale: float
    off: float


def matched(places: Places, points: np.ndarray, start: float) -> Match:
    """Match objects to the places of a figure, by the similarity without mirroring that brings them nearest.

    Args:
        places: N places.
        points: (N, 2) the objects' centroids, metres.
        start: the angle (rad) by which the drawing is likely turned; others are tried if it does not fit.
    """
    best: tuple[float, np.ndarray, float, float, np.ndarray] | None = None
    for k in range(_STARTS):
        found = _fitted(places.points, points, start + 2 * math.pi * k / _STARTS)
        if best is None or found[0] < _BETTER * best[0]:
            best = found
        if best[0] < _GOOD * places.width * best[2]:
            break
    assert best is not None
    _, order, scale, angle, shift = best
    return Match(order, angle, scale, _off(places, points[order], scale, angle, shift))


def _fitted(places: np.ndarray, points: np.ndarray, angle: float) -> tuple[float, np.ndarray, float, float, np.ndarray]:
    """Return the mean distance (m), the object on each place, and the similarity, from a first angle (rad)."""
    from scipy.optimize import linear_sum_assignment  # takes longer to import than all structures

    scale = float(np.sqrt(points.var(axis=0).sum() / max(places.var(axis=0).sum(), 1e-12)))
    shift = points.mean(axis=0) - moved(places.mean(axis=0)[None], scale, angle, np.zeros(2))[0]
    order = np.arange(len(points))
    for _ in range(_ROUNDS):
        distances = np.linalg.norm(moved(places, scale, angle, shift)[:, None] - points, axis=-1)
        assigned = linear_sum_assignment(distances**2)[1]
        scale, angle, shift = similarity(places, points[assigned])
        if (assigned == order).all():
            break
        order = assigned
    off = np.linalg.norm(moved(places, scale, angle, shift) - points[order], axis=1)
    return float(off.mean()), order, scale, angle, shift


def _off(places: Places, standing: np.ndarray, scale: float, angle: float, shift: np.ndarray) -> float:
    """Return the Chamfer distance over the drawing's diameter, of objects (N, 2) on their places."""
    width = max(places.width * scale, 1e-9)
    step = max(_SAMPLE, width / _MOST_SAMPLES)
    drawn = sampled([moved(curve, scale, angle, shift) for curve in places.curves], step)
    return chamfer(sampled(places.lines(standing), step), drawn) / width


def evened(
    places: Places, points: np.ndarray, axes: np.ndarray, outlines: Sequence[np.ndarray], rounds: int = 300
) -> np.ndarray:
    """Return points (N, 2) on the places, moved along the strokes until clear gaps along each stroke are even.

    Args:
        places: N places.
        points: (N, 2) their scaled and turned positions, metres.
        axes: (N,) the directions of the strokes there, radians.
        outlines: of the objects on them, about their own origins, as they are turned.
        rounds: of moving, at most.
    """
    links = [(i, j, k) for k, chain in enumerate(places.chains) for i, j in pairwise(chain)]
    if not links:
        return points
    first, second, stroke = np.array(links).T
    often = np.bincount(np.concatenate((first, second)), minlength=len(points)).clip(1)[:, None]
    count = np.bincount(stroke)
    normals = np.column_stack((-np.sin(axes), np.cos(axes)))
    farthest = _FARTHEST * float(np.linalg.norm(points[second] - points[first], axis=1).mean())
    now = points.copy()
    for number in range(rounds):
        ways = now[second] - now[first]
        lengths = np.linalg.norm(ways, axis=1)
        units = ways / np.maximum(lengths, 1e-9)[:, None]
        if number % _REACHES == 0:
            reaches = np.array([
                float((outlines[i] @ unit).max()) - float((outlines[j] @ unit).min())
                for i, j, unit in zip(first, second, units)
            ])  # fmt: skip
        gaps = lengths - reaches
        push = 0.5 * (gaps - (np.bincount(stroke, gaps) / count)[stroke])[:, None] * units
        if np.abs(push).max() < _EVEN:
            break
        moves = np.zeros_like(now)
        np.add.at(moves, first, push)
        np.add.at(moves, second, -push)
        now = now + 0.7 * moves / often
        off = now - points
        across = (off * normals).sum(axis=1, keepdims=True) * normals
        off -= np.where(places.corners[:, None], _CORNERS_BACK * off, _BACK * across)
        length = np.linalg.norm(off, axis=1, keepdims=True)
        now = points + off * np.minimum(1.0, farthest / np.maximum(length, 1e-12))
    return now

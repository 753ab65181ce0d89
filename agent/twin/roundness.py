"""Round things: the upright axis that a partial view turns about, and the body turned from its profile."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError, cKDTree

from agent.twin.seeing import View, level_top
from structdiffusion.objects.solids import frustum, shell

_FITTED = 300  # points that the axis is fitted to
_OPPOSITE = math.radians(40.0)  # seen from the axis, points so far apart tell whether the outline turns
_FAR = 0.008  # m: what deviates more is a handle, and counts no further
_ROUND = 0.0017  # m of mean deviation up to which a thing of 4 cm radius is round
_OPEN = 0.35  # of the turned points in the open, or where the camera saw something else: not round
_HOLLOW = 0.010  # m that the inside lies below the rim
_WALL = (0.0025, 0.008)  # m, the thinnest and the thickest wall
_BAND = 0.006  # m of height whose points give one radius
_STRAIGHT = 0.0015  # m that a profile may deviate from a straight line
_SIDES = 16
_SIZE = (0.008, 0.25)  # m, radii


@dataclass(frozen=True)
class Turned:
    """A body turned about an upright axis. World frame, metres.

    Attributes:
        middle: (2,) where the axis stands.
        profile: (K, 2) outer radius and height, from the support up.
        wall: how thick the wall of a hollow thing is; 0 for a solid one.
        floor: z of a hollow thing's inside.
        ball: whether it is a ball: radius and middle's height follow from the profile's extent.
    """

    middle: np.ndarray
    profile: np.ndarray
    wall: float = 0.0
    floor: float = 0.0
    ball: bool = False

    @property
    def hollow(self) -> bool:
        """Whether the camera saw into it."""
        return self.wall > 0

    def parts(self) -> tuple[np.ndarray, ...]:
        """Convex parts, each (V, 3)."""
        at = np.array([*self.middle, 0.0])
        if self.ball:
            low, high = self.profile[0, 1], self.profile[-1, 1]
            radius = (high - low) / 2
            return (_ball(radius) + at + [0.0, 0.0, low + radius],)
        if not self.hollow:
            # A polygon's sides lie within its corners' circle: half of what is lost is added.
            grown = [(radius * (1 + _lost(24) / 2), z) for radius, z in self.profile]
            pieces = [frustum(a, b, low, high) for (a, low), (b, high) in itertools.pairwise(grown)]
            whole = np.concatenate(pieces)
            hull = ConvexHull(whole)
            if hull.volume < 1.04 * sum(ConvexHull(piece).volume for piece in pieces):
                pieces = [whole[hull.vertices]]
            return tuple(piece + at for piece in pieces)
        grown = [(radius * (1 + _lost(_SIDES) / 2), z) for radius, z in self.profile]
        bottom = grown[0][1]
        above = [(float(np.interp(self.floor, *_columns(grown))), self.floor), *(p for p in grown if p[1] > self.floor + 0.001)]
        below = [p for p in grown if p[1] < self.floor - 0.001] or [(grown[0][0], bottom)]
        walls = shell(above, self.wall, _SIDES)
        base = np.concatenate([frustum(a, b, low, high) for (a, low), (b, high) in itertools.pairwise([*below, above[0]])])
        return tuple(part + at for part in (base, *walls))


def _columns(profile: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    """Heights and radii of a profile, as `np.interp` takes them."""
    return [z for _, z in profile], [radius for radius, _ in profile]


def _lost(sides: int) -> float:
    """What share of the corner radius the middle of a side lies within it."""
    return 1 - math.cos(math.pi / sides)


def _ball(radius: float) -> np.ndarray:
    """About 60 points (V, 3) spread evenly over a sphere, its lowest and highest among them."""
    count = 62
    z = np.linspace(1.0, -1.0, count)
    turn = math.pi * (1 + math.sqrt(5)) * np.arange(count)
    level = np.sqrt(np.maximum(0.0, 1 - z**2))
    return radius * np.stack((level * np.cos(turn), level * np.sin(turn), z), axis=1)


def turned_body(view: View, support: float) -> tuple[Turned, np.ndarray] | None:
    """The round body that a view shows, and which of its points (P,) belong to it; `None` where it shows none.

    Args:
        view: the object as it was seen.
        support: z of what it stands on.
    """
    points = view.points
    if len(points) < 20 or np.ptp(points[:, 2]) < 0.006:
        return None
    few = points[:: math.ceil(len(points) / _FITTED)]
    middle, deviation = _axis(few)
    radii = np.linalg.norm(points[:, :2] - middle, axis=1)
    radius = float(np.quantile(radii, 0.95))
    if not _SIZE[0] < radius < _SIZE[1] or deviation > _ROUND * max(0.6, min(1.5, radius / 0.04)):
        return None
    turns = np.array([math.pi, 2 * math.pi / 3, -2 * math.pi / 3, math.pi / 2, -math.pi / 2])
    behind, outside = view.behind(np.concatenate([_turn(few, middle, turn) for turn in turns]))
    if (outside | (behind < -_FAR)).mean() > _OPEN:
        return None
    return _profile(view, middle, support)


def _turn(points: np.ndarray, middle: np.ndarray, turn: float) -> np.ndarray:
    """The points (P, 3) turned about the upright axis at `middle` (2,)."""
    c, s = math.cos(turn), math.sin(turn)
    return np.column_stack(((points[:, :2] - middle) @ np.array([[c, s], [-s, c]]) + middle, points[:, 2]))


def _axis(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Where the axis (2,) stands about which points (P, 3) turn best, and how far they deviate, metres."""

    def deviation(middle: np.ndarray) -> float:
        offset = points[:, :2] - middle
        curve = np.stack((np.linalg.norm(offset, axis=1), points[:, 2]), axis=1)
        around = np.arctan2(offset[:, 1], offset[:, 0])
        apart, near = cKDTree(curve).query(curve, k=min(12, len(points)))
        turn = np.abs((around[near] - around[:, None] + math.pi) % (2 * math.pi) - math.pi)
        apart[(turn < _OPPOSITE) & (curve[:, :1] > 0.01)] = _FAR
        return float(np.minimum(apart[:, 1:].min(axis=1), _FAR).mean())

    low, high = np.quantile(points[:, :2], [0.01, 0.99], axis=0)
    starts = [0.5 * (low + high), _common_middle(points)]
    top = points[points[:, 2] > level_top(points[:, 2]) - 0.01, :2]
    starts.append(0.5 * (top.min(axis=0) + top.max(axis=0)))
    best = min(starts, key=deviation)
    found = minimize(
        deviation, best, method="Nelder-Mead",
        options={"initial_simplex": best + 0.006 * np.array([[0, 0], [1, 0], [0, 1]]), "maxfev": 60, "xatol": 3e-4, "fatol": 1e-5},
    )  # fmt: skip
    return found.x, float(found.fun)


def _common_middle(points: np.ndarray) -> np.ndarray:
    """The middle (2,) of circles, one per band of height, fitted to points (P, 3) by least squares."""
    middle, flat = points[:, :2].mean(axis=0), points[:, :2] - points[:, :2].mean(axis=0)
    band = ((points[:, 2] - points[:, 2].min()) / 0.012).astype(int)
    terms = np.concatenate((2 * flat, np.eye(band.max() + 1)[band]), axis=1)
    solution = np.linalg.lstsq(terms, (flat**2).sum(axis=1), rcond=None)[0]
    reach = np.ptp(flat, axis=0)
    return middle + np.clip(solution[:2], -reach, reach)


def _profile(view: View, middle: np.ndarray, support: float) -> tuple[Turned, np.ndarray] | None:
    """The body turned about `middle`, and which points belong to it."""
    points = view.points
    offset = points[:, :2] - middle
    radii, heights = np.linalg.norm(offset, axis=1), points[:, 2] - support
    toward = view.eye[:2] - middle
    toward = toward / max(1e-9, float(np.linalg.norm(toward)))
    front = offset @ toward > 0.3 * radii
    top = level_top(heights)
    rim = float(np.quantile(heights, 0.985)) - 0.0015
    outermost = float(np.quantile(radii[heights > rim - 0.006], 0.9))
    inside = radii < 0.5 * outermost
    if inside.sum() >= max(5, 0.01 * len(radii)) and rim - float(np.median(heights[inside])) > _HOLLOW:
        return _hollow(middle, radii, heights, front, rim, outermost, support)
    curve = _radii_by_height(radii, heights, top)
    if curve is None:
        return None
    # Only the front shows the sides below the widest place; the top shows all around.
    body = np.abs(radii - np.interp(heights, curve[:, 1], curve[:, 0])) < _FAR
    body |= radii < np.interp(heights, curve[:, 1], curve[:, 0])
    if (radius := _ball_radius(radii, heights)) is not None:
        return Turned(middle, np.array([[0.0, support], [0.0, support + 2 * radius]]), ball=True), body
    profile = _simplified(np.vstack(([curve[0, 0], 0.0], curve, [curve[-1, 0], top])))
    return Turned(middle, profile + [0.0, support]), body


def _radii_by_height(radii: np.ndarray, heights: np.ndarray, top: float) -> np.ndarray | None:
    """Outer radius and height (K, 2) of bands from the lowest that was seen up to the top."""
    count = max(2, min(24, round(top / _BAND)))
    edges = np.linspace(0.0, top, count + 1)
    curve = []
    for low, high in itertools.pairwise(edges):
        band = radii[(heights >= low - _BAND / 4) & (heights < high + _BAND / 4)]
        if len(band) >= 4:
            # A level top fills its disc: the outer points of the band give its radius.
            outer = band[band > np.quantile(band, 0.9) - _FAR / 2]
            curve.append((float(np.quantile(outer, 0.6)), 0.5 * (low + high)))
    return np.array(curve) if len(curve) > 0 else None


def _ball_radius(radii: np.ndarray, heights: np.ndarray) -> float | None:
    """The radius of the ball on the support that the points lie on; `None` where they lie on none."""
    # r^2 + (z - R)^2 = R^2: R = (r^2 + z^2) / (2 z)
    usable = heights > 0.006
    if usable.sum() < 10:
        return None
    squares = radii[usable] ** 2 + heights[usable] ** 2
    radius = float((squares * heights[usable]).sum() / (2 * (heights[usable] ** 2).sum()))
    error = np.abs(np.hypot(radii[usable], heights[usable] - radius) - radius)
    return radius if np.mean(error) < 0.0018 and radii.max() > 0.7 * radius else None


def _hollow(
    middle: np.ndarray, radii: np.ndarray, heights: np.ndarray, front: np.ndarray, rim: float, outermost: float, support: float
) -> tuple[Turned, np.ndarray]:
    """A vessel: its wall from the inside that the far side shows, and the outside that the near side shows."""
    lowest = radii < 0.35 * outermost
    floor = float(np.median(heights[lowest])) if lowest.sum() >= 4 else float(np.quantile(heights[~front], 0.05))
    floor = float(np.clip(floor, 0.002, rim - 0.004))
    edges = np.linspace(floor, rim, max(2, min(12, round((rim - floor) / _BAND))) + 1)
    inner, outer = [], []
    for low, high in itertools.pairwise(edges):
        band = (heights >= low - 0.001) & (heights < high + 0.001)
        z = 0.5 * (low + high)
        for points, curve in ((band & ~front, inner), (band & front, outer)):
            if points.sum() >= 3:
                curve.append((float(np.median(radii[points])), z))
    thick = [r - np.interp(z, [b for _, b in inner], [a for a, _ in inner]) for r, z in outer] if inner else []
    wall = float(np.clip(np.median(thick), *_WALL)) if len(thick) else _WALL[0]
    shown = outer if len(outer) >= len(inner) else [(r + wall, z) for r, z in inner]
    if not shown:
        shown = [(outermost, rim)]
    near = radii[(heights < floor + 0.004) & front & (radii > 0.35 * outermost)]
    base = float(np.median(near)) if len(near) >= 5 else shown[0][0]
    curve = np.vstack(([min(base, shown[0][0]), 0.0], shown, [max(outermost, shown[-1][0]), rim]))
    profile = _simplified(curve)
    body = radii < np.interp(heights, curve[:, 1], curve[:, 0]) + _FAR
    return Turned(middle, profile + [0.0, support], wall, floor + support), body


def _simplified(curve: np.ndarray) -> np.ndarray:
    """The profile (K, 2) with as few points as follow it within 1.5 mm."""
    order = np.argsort(curve[:, 1], kind="stable")
    curve = curve[order]
    keep, waiting = {0, len(curve) - 1}, [(0, len(curve) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        between = slice(first + 1, last)
        straight = np.interp(curve[between, 1], curve[[first, last], 1], curve[[first, last], 0])
        error = np.abs(straight - curve[between, 0])
        if error.max() > _STRAIGHT:
            worst = first + 1 + int(error.argmax())
            keep.add(worst)
            waiting += [(first, worst), (worst, last)]
    kept = curve[sorted(keep)]
    rising = np.concatenate(([True], np.diff(kept[:, 1]) > 1e-4))
    return kept[rising]

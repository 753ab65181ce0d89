"""Estimate the profile of a body of revolution about a known axis: radius over height, outside and, if open, inside."""

from __future__ import annotations

import itertools

import numpy as np

from structdiffusion.completion.revolution import Turned
from structdiffusion.completion.view import level_top

TOP = 0.008  # m below the highest points that belong to a rim or a top
_WALL, _THINNEST_WALL = 0.0035, 0.002  # m: thickness of a wall if it cannot be seen, and its minimum
BAND = 0.006  # m: height of the bands that give one radius each
_OUTER = 0.004  # m: points this close to the outermost ones of a band also give its radius
_STRAIGHT = 0.0015  # m by which a profile may deviate from a straight line


def profile_of(points: np.ndarray, eye: np.ndarray, middle: np.ndarray, support: float) -> Turned | None:
    """Return the body of revolution about `middle` of which points (P, 3) were seen."""
    offset = points[:, :2] - middle
    radii, heights = np.linalg.norm(offset, axis=1), points[:, 2] - support
    toward = eye[:2] - middle
    toward = toward / max(1e-9, float(np.linalg.norm(toward)))
    front = offset @ toward > 0.3 * radii
    rim = float(np.quantile(heights, 0.985)) - 0.0015
    outermost = float(np.quantile(radii[heights > rim - 0.006], 0.95))
    if opens_above(radii, heights):
        return _hollow(middle, radii, heights, front, rim, outermost, support)
    if (radius := _ball_radius(radii, heights)) is not None:
        outer = np.array([[0.0, 0.0], [radius, radius], [0.0, 2 * radius]]) + [0.0, support]
        return Turned(middle, outer, np.empty((0, 2)), ball=True)
    top = level_top(heights)
    curve = _radii_by_height(radii, heights, top)
    if curve is None:
        return None
    profile = _simplified(np.vstack(([curve[0, 0], 0.0], curve, [curve[-1, 0], top])))
    return Turned(middle, profile + [0.0, support], np.empty((0, 2)))


def _radii_by_height(radii: np.ndarray, heights: np.ndarray, top: float) -> np.ndarray | None:
    """Return the outer radius and height (K, 2) of bands from the lowest seen one up to the top."""
    count = max(2, min(24, round(top / BAND)))
    edges = np.linspace(0.0, top, count + 1)
    curve = []
    for low, high in itertools.pairwise(edges):
        band = radii[(heights >= low - BAND / 4) & (heights < high + BAND / 4)]
        if len(band) >= 4:
            # A level top fills its disc, so the outer points of the band give its radius.
            outer = band[band > np.quantile(band, 0.9) - _OUTER]
            curve.append((float(np.quantile(outer, 0.6)), 0.5 * (low + high)))
    return np.array(curve) if len(curve) > 0 else None


def _ball_radius(radii: np.ndarray, heights: np.ndarray) -> float | None:
    """Return the radius of the ball on the support on which the points lie; `None` if they lie on none."""
    # r^2 + (z - R)^2 = R^2: R = (r^2 + z^2) / (2 z)
    usable = heights > 0.006
    if usable.sum() < 10:
        return None
    squares = radii[usable] ** 2 + heights[usable] ** 2
    radius = float((squares * heights[usable]).sum() / (2 * (heights[usable] ** 2).sum()))
    error = np.abs(np.hypot(radii[usable], heights[usable] - radius) - radius)
    return radius if np.mean(error) < 0.0018 and radii.max() > 0.7 * radius else None


def _hollow(
    middle: np.ndarray,
    radii: np.ndarray,
    heights: np.ndarray,
    front: np.ndarray,
    rim: float,
    outermost: float,
    support: float,
) -> Turned:
    """Return a vessel: the far side shows the inside of its wall, the near side the outside.

    Args:
        radii, heights: (P,) of the points, above the support.
        front: (P,) which of them are on the near side.
        rim: height of the rim. outermost: radius of the rim.
    """
    lowest = radii < 0.35 * outermost
    if lowest.sum() >= 4:
        floor = float(np.median(heights[lowest]))
    else:  # as low as the far side was seen; where it was not, as low as can be
        floor = float(np.quantile(heights[~front], 0.02)) if (~front).any() else 0.0
    floor = float(np.clip(floor, min(0.002, 0.4 * rim), max(rim - 0.004, 0.4 * rim)))
    wall = heights > floor + min(0.004, 0.3 * (rim - floor))
    far = wall & ~front & (radii > 0.3 * outermost)
    inside = _curve(radii[far], heights[far])
    levels = np.linspace(floor, rim, 5)
    seen_inside = inside(levels) if inside else np.full(len(levels), outermost - _WALL)
    inner = np.minimum(seen_inside, outermost - _THINNEST_WALL)
    inner = np.clip(inner, 0.25 * outermost, None)
    near = front & (heights > 0.002) & (radii > np.interp(heights, levels, inner)) & (heights < rim)
    slope = np.gradient(inner, levels)
    outer = np.minimum(inner + _WALL * np.sqrt(1 + slope**2), inner + 0.3 * outermost)
    if near.sum() >= 12 and np.ptp(heights[near]) > 0.4 * rim and (outside := _curve(radii[near], heights[near])):
        levels_seen = np.clip(levels, np.quantile(heights[near], 0.05), rim)
        outer = np.maximum(outside(levels_seen), inner + _THINNEST_WALL)
        base = float(outside(np.array([max(0.0, np.quantile(heights[near], 0.02))]))[0])
    else:
        base = outer[0] - slope[0] * floor if slope[0] > 0 else outer[0]
    base = float(np.clip(base, 0.3 * outermost, outer[0]))
    outside_curve = np.vstack(([base, 0.0], np.column_stack((outer, levels))))
    inside_curve = _simplified(np.column_stack((inner, levels)))
    return Turned(middle, outside_curve + [0.0, support], inside_curve + [0.0, support])


def _curve(radii: np.ndarray, heights: np.ndarray) -> np.polynomial.Polynomial | None:
    """Fit a parabola of radius over height by least squares without outliers; `None` for too few points."""
    if len(radii) < 8 or np.ptp(heights) < 0.004:
        return None
    keep = np.ones(len(radii), dtype=bool)
    for _ in range(3):
        curve = np.polynomial.Polynomial.fit(heights[keep], radii[keep], 2 if np.ptp(heights[keep]) > 0.02 else 1)
        error = np.abs(curve(heights) - radii)
        keep = error <= max(0.002, 2.5 * float(np.median(error)))
    return curve


def _simplified(curve: np.ndarray) -> np.ndarray:
    """Simplify the profile to the fewest points (K, 2) that follow it within 1.5 mm."""
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


def opens_above(radii: np.ndarray, heights: np.ndarray) -> bool:
    """Return whether the highest points form a rim with only lower points inside, from radii and heights (P,)."""
    top = min(TOP, 0.35 * float(np.ptp(heights)))  # plates are shallow
    high = heights > np.quantile(heights, 0.985) - top
    inside = radii < 0.6 * np.quantile(radii[high], 0.9)
    within = high & inside
    if within.sum() > 0.1 * high.sum():
        return False
    return not inside.any() or bool(heights[high].mean() - np.median(heights[inside]) > top)

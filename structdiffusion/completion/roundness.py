"""Round things: whether a partial view is one of them, the upright axis it turns about, and its profile."""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from structdiffusion.completion.seeing import View, level_top
from structdiffusion.completion.turned import Turned

_FITTED = 300  # points that the axis is fitted to
_OPPOSITE = math.radians(40.0)  # seen from the axis, points so far apart tell whether the outline turns
_FAR = 0.008  # m: what deviates more is a handle, and counts no further
_ROUND = 0.0015  # m of mean deviation up to which a thing may be round
_LOWEST = 0.006  # m: what is flatter need not be turned
_SECTORS = 24
_STRAIGHT_AROUND = 0.002  # m that a round outline may deviate, or 5 %
_ROUND_SHARE = 0.62  # of the outline that has to be round
_HANDLE = 0.004  # m beyond the outline where handles begin
_OWN = 0.7  # of the points that have to belong to the round body
_OPEN, _OPEN_INSIDE = 0.2, 0.45  # of the turned points in the open: then it is not round; the same of hollow things
_SIDEWAYS = 0.82  # of its radius that a round body has to show to either side
_TOP = 0.008  # m below the highest points that belong to a rim or a top
_WALL, _THINNEST_WALL = 0.0035, 0.002  # m, where its thickness cannot be seen, and at least
_BAND = 0.006  # m of height whose points give one radius
_STRAIGHT = 0.0015  # m that a profile may deviate from a straight line
_SIZE = (0.008, 0.25)  # m, radii


def turned_body(view: View, support: float) -> tuple[Turned, np.ndarray] | None:
    """The round body that a view shows, and which of its points (P,) belong to it; `None` where it shows none.

    Args:
        view: the object as it was seen.
        support: z of what it stands on.
    """
    points = view.points
    if len(points) < 20 or np.ptp(points[:, 2]) < _LOWEST:
        return None
    few = points[:: math.ceil(len(points) / _FITTED)]
    middle, deviation = _axis(few, view.eye)
    if deviation > _ROUND:
        return None
    radii = np.linalg.norm(points[:, :2] - middle, axis=1)
    opens = _opens_above(radii, points[:, 2])
    outline, share = _outline(points, middle, view.eye)
    if opens:  # the near wall hides much of the inside, but the rim shows all around
        share = max(share, _rim_share(points, middle))
    if share < _ROUND_SHARE or not _SIZE[0] < np.quantile(outline, 0.9) < _SIZE[1]:
        return None
    own = radii < outline + _HANDLE
    if own.mean() < _OWN:
        return None
    few = points[own][:: math.ceil(own.sum() / _FITTED)]
    turns = np.array([math.pi, 2 * math.pi / 3, -2 * math.pi / 3, math.pi / 2, -math.pi / 2])
    behind, outside = view.behind(np.concatenate([_turn(few, middle, turn) for turn in turns]))
    if (outside | (behind < -_FAR)).mean() > (_OPEN_INSIDE if opens else _OPEN):
        return None
    body = _profile(points[own], view.eye, middle, support)
    if body is None or not _as_wide(points[own], view.eye, middle, float(body.outer[:, 0].max())):
        return None
    return body, own | (radii < np.interp(points[:, 2], body.outer[:, 1], body.outer[:, 0]) + _HANDLE)


def _as_wide(points: np.ndarray, eye: np.ndarray, middle: np.ndarray, radius: float) -> bool:
    """Whether points (P, 3) were seen as far to both sides of the axis as a round body reaches."""
    toward = (eye[:2] - middle) / max(1e-9, float(np.linalg.norm(eye[:2] - middle)))
    across = (points[:, :2] - middle) @ np.array([-toward[1], toward[0]])
    left, right = np.quantile(across, [0.01, 0.99])
    return bool(min(-left, right) > _SIDEWAYS * radius)


def _rim_share(points: np.ndarray, middle: np.ndarray) -> float:
    """Which share of the rim's outline around `middle` is round; 0 where too little of it was seen."""
    offset = points[points[:, 2] > np.quantile(points[:, 2], 0.985) - _TOP, :2] - middle
    outermost = np.zeros(_SECTORS)
    np.maximum.at(outermost, _sector(offset), np.linalg.norm(offset, axis=1))
    known = outermost[outermost > 0]
    if len(known) < 0.6 * _SECTORS:
        return 0.0
    typical = np.median(known)
    return float((np.abs(known - typical) < max(_STRAIGHT_AROUND, 0.05 * typical)).mean())


def _sector(offset: np.ndarray) -> np.ndarray:
    """In which sector (P,) around the middle level offsets (P, 2) lie."""
    return ((np.arctan2(offset[:, 1], offset[:, 0]) / (2 * math.pi) + 0.5) * _SECTORS).astype(int) % _SECTORS


def _outline(points: np.ndarray, middle: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, float]:
    """The radius (P,) of the outline at each point's height and side, and which share of the outline is round.

    The side toward the camera shows the outside, the other one the inside of hollow things: they are told apart. Of
    each sector around the middle the outermost point counts, so that a handle is one sector of many.
    """
    offset = points[:, :2] - middle
    radii = np.linalg.norm(offset, axis=1)
    band = ((points[:, 2] - points[:, 2].min()) / (1.5 * _BAND)).astype(int)
    group = 2 * band + (offset @ (eye[:2] - middle) > 0)
    outermost = np.full((group.max() + 1, _SECTORS), np.nan)
    np.fmax.at(outermost, (group, _sector(offset)), radii)
    enough = (~np.isnan(outermost)).sum(axis=1) >= 3
    if not enough.any():
        return radii, 0.0
    typical = np.full(len(outermost), np.nan)
    typical[enough] = np.nanmedian(outermost[enough], axis=1)
    deviation = np.abs(outermost[enough] - typical[enough, None])
    fits = deviation < np.maximum(_STRAIGHT_AROUND, 0.05 * typical[enough])[:, None]
    typical[~enough] = np.nanmax(typical)
    return typical[group], float(fits[~np.isnan(deviation)].mean())


def _turn(points: np.ndarray, middle: np.ndarray, turn: float) -> np.ndarray:
    """The points (P, 3) turned about the upright axis at `middle` (2,)."""
    c, s = math.cos(turn), math.sin(turn)
    return np.column_stack(((points[:, :2] - middle) @ np.array([[c, s], [-s, c]]) + middle, points[:, 2]))


def _axis(points: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, float]:
    """Where the axis (2,) stands about which points (P, 3) turn best, and how far most of them deviate, metres."""
    start = _common_middle(points)
    # Of a wall, the far side shows the inside, the near side the outside.
    two_sides = float(_opens_above(np.linalg.norm(points[:, :2] - start, axis=1), points[:, 2]))

    def deviation(middle: np.ndarray) -> float:
        offset = points[:, :2] - middle
        far = two_sides * (offset @ (eye[:2] - middle) > 0)
        curve = np.stack((np.linalg.norm(offset, axis=1), points[:, 2], far), axis=1)
        around = np.arctan2(offset[:, 1], offset[:, 0])
        apart, near = cKDTree(curve).query(curve, k=min(12, len(points)))
        turn = np.abs((around[near] - around[:, None] + math.pi) % (2 * math.pi) - math.pi)
        apart[(turn < _OPPOSITE) & (curve[:, :1] > 0.01)] = _FAR
        nearest = np.sort(np.minimum(apart[:, 1:].min(axis=1), _FAR))
        return float(nearest[: math.ceil(_OWN * len(nearest))].mean())

    low, high = np.quantile(points[:, :2], [0.01, 0.99], axis=0)
    top = points[points[:, 2] > level_top(points[:, 2]) - 0.01, :2]
    starts = [start, 0.5 * (low + high), 0.5 * (top.min(axis=0) + top.max(axis=0))]
    best = min(starts, key=deviation)
    simplex = best + 0.006 * np.array([[0, 0], [1, 0], [0, 1]])
    options = {"initial_simplex": simplex, "maxfev": 60, "xatol": 3e-4, "fatol": 1e-5}
    found = minimize(deviation, best, method="Nelder-Mead", options=options)
    return found.x, float(found.fun)


def _opens_above(radii: np.ndarray, heights: np.ndarray) -> bool:
    """Whether the highest points form a rim, with nothing but lower ones within, from radii and heights (P,)."""
    top = min(_TOP, 0.35 * float(np.ptp(heights)))  # plates are shallow
    high = heights > np.quantile(heights, 0.985) - top
    inside = radii < 0.6 * np.quantile(radii[high], 0.9)
    within = high & inside
    if within.sum() > 0.1 * high.sum():
        return False
    return not inside.any() or bool(heights[high].mean() - np.median(heights[inside]) > top)


def _common_middle(points: np.ndarray) -> np.ndarray:
    """The middle (2,) of circles, one per band of height, fitted to points (P, 3) without their outliers."""
    mean = points[:, :2].mean(axis=0)
    flat = points[:, :2] - mean
    band = ((points[:, 2] - points[:, 2].min()) / 0.012).astype(int)
    terms = np.concatenate((2 * flat, np.eye(band.max() + 1)[band]), axis=1)
    squares, weights = (flat**2).sum(axis=1), np.ones(len(flat))
    for _ in range(6):
        root = np.sqrt(weights)
        solution = np.linalg.lstsq(terms * root[:, None], squares * root, rcond=None)[0]
        error = np.abs(terms @ solution - squares)
        weights = 1 / (1 + (error / max(1e-9, float(np.median(error)))) ** 2)
    reach = np.ptp(flat, axis=0)
    return mean + np.clip(solution[:2], -reach, reach)


def _profile(points: np.ndarray, eye: np.ndarray, middle: np.ndarray, support: float) -> Turned | None:
    """The body of which points (P, 3) were seen, turned about `middle`."""
    offset = points[:, :2] - middle
    radii, heights = np.linalg.norm(offset, axis=1), points[:, 2] - support
    toward = eye[:2] - middle
    toward = toward / max(1e-9, float(np.linalg.norm(toward)))
    front = offset @ toward > 0.3 * radii
    rim = float(np.quantile(heights, 0.985)) - 0.0015
    outermost = float(np.quantile(radii[heights > rim - 0.006], 0.95))
    if _opens_above(radii, heights):
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
    middle: np.ndarray,
    radii: np.ndarray,
    heights: np.ndarray,
    front: np.ndarray,
    rim: float,
    outermost: float,
    support: float,
) -> Turned:
    """A vessel: the far side shows the inside of its wall, the near side the outside.

    Args:
        radii, heights: (P,) of the points, above the support.
        front: (P,) which of them are on the near side.
        rim: its height. outermost: its radius.
    """
    lowest = radii < 0.35 * outermost
    floor = float(np.median(heights[lowest])) if lowest.sum() >= 4 else float(np.quantile(heights[~front], 0.02))
    floor = float(np.clip(floor, 0.002, rim - 0.004))
    wall = heights > floor + min(0.004, 0.3 * (rim - floor))
    far = wall & ~front & (radii > 0.3 * outermost)
    inside = _curve(radii[far], heights[far])
    levels = np.linspace(floor, rim, 5)
    inner = np.minimum(inside(levels) if inside else outermost - _WALL, outermost - _THINNEST_WALL)
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
    """The radius as a parabola over the height, by least squares with outliers left out; `None` of too few points."""
    if len(radii) < 8 or np.ptp(heights) < 0.004:
        return None
    keep = np.ones(len(radii), dtype=bool)
    for _ in range(3):
        curve = np.polynomial.Polynomial.fit(heights[keep], radii[keep], 2 if np.ptp(heights[keep]) > 0.02 else 1)
        error = np.abs(curve(heights) - radii)
        keep = error <= max(0.002, 2.5 * float(np.median(error)))
    return curve


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

"""Detect bodies of revolution in a partial view, and fit their upright axis."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from structdiffusion.completion.profiles import BAND, TOP, opens_above, profile_of
from structdiffusion.completion.revolution import Turned
from structdiffusion.completion.view import View, level_top

_FITTED = 300  # points to which the axis is fitted
_OPPOSITE = math.radians(40.0)  # angle between points, seen from the axis, that shows whether the outline is round
_FAR = 0.008  # m: a larger deviation is that of a handle; deviations are clipped here
_ROUND = 0.0015  # m of mean deviation up to which an object may be round
_LOWEST = 0.006  # m: flatter objects are not treated as bodies of revolution
_SECTORS = 24
_STRAIGHT_AROUND = 0.002  # m by which a round outline may deviate, or 5 %
_ROUND_SHARE = 0.62  # share of the outline that has to be round
# share of the outline: an object that is less round about every candidate axis is rejected without a fit
_HOPELESS = 0.4
_HANDLE = 0.004  # m beyond the outline where handles begin
_OWN = 0.7  # share of the points that have to belong to the round body
# shares of turned points in empty space above which a solid, or a hollow, object is not round
_OPEN, _OPEN_INSIDE = 0.2, 0.45
_SIDEWAYS = 0.82  # share of its radius that a round body has to show on either side
_SIZE = (0.008, 0.25)  # m, radii


def turned_body(view: View, support: float) -> tuple[Turned, np.ndarray] | None:
    """Fit a body of revolution to a view; return it and a mask (P,) of its points, or `None` if none fits.

    Args:
        view: the view of the object.
        support: z of the surface that it stands on.
    """
    points = view.points
    if len(points) < 20 or np.ptp(points[:, 2]) < _LOWEST:
        return None
    few = points[:: math.ceil(len(points) / _FITTED)]
    starts = _likely_middles(few)
    # The search for the axis takes most of the time.
    if all(max(_outline(points, start, view.eye)[1], _rim_share(points, start)) < _HOPELESS for start in starts):
        return None
    middle, deviation = _axis(few, view.eye, starts)
    if deviation > _ROUND:
        return None
    radii = np.linalg.norm(points[:, :2] - middle, axis=1)
    opens = opens_above(radii, points[:, 2])
    outline, share = _outline(points, middle, view.eye)
    if opens:  # the near wall hides much of the inside, but the whole rim is visible
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
    body = profile_of(points[own], view.eye, middle, support)
    if body is None or not _as_wide(points[own], view.eye, middle, float(body.outer[:, 0].max())):
        return None
    return body, own | (radii < np.interp(points[:, 2], body.outer[:, 1], body.outer[:, 0]) + _HANDLE)


def _as_wide(points: np.ndarray, eye: np.ndarray, middle: np.ndarray, radius: float) -> bool:
    """Return whether points (P, 3) were seen as far to both sides of the axis as a round body reaches."""
    toward = (eye[:2] - middle) / max(1e-9, float(np.linalg.norm(eye[:2] - middle)))
    across = (points[:, :2] - middle) @ np.array([-toward[1], toward[0]])
    left, right = np.quantile(across, [0.01, 0.99])
    return bool(min(-left, right) > _SIDEWAYS * radius)


def _rim_share(points: np.ndarray, middle: np.ndarray) -> float:
    """Return the share of the rim's outline around `middle` that is round; 0 if too little of it was seen."""
    offset = points[points[:, 2] > np.quantile(points[:, 2], 0.985) - TOP, :2] - middle
    outermost = np.zeros(_SECTORS)
    np.maximum.at(outermost, _sector(offset), np.linalg.norm(offset, axis=1))
    known = outermost[outermost > 0]
    if len(known) < 0.6 * _SECTORS:
        return 0.0
    typical = np.median(known)
    return float((np.abs(known - typical) < max(_STRAIGHT_AROUND, 0.05 * typical)).mean())


def _sector(offset: np.ndarray) -> np.ndarray:
    """Return the sector (P,) around the middle in which horizontal offsets (P, 2) lie."""
    return ((np.arctan2(offset[:, 1], offset[:, 0]) / (2 * math.pi) + 0.5) * _SECTORS).astype(int) % _SECTORS


def _outline(points: np.ndarray, middle: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the outline's radius (P,) at each point's height and side, and the share of the outline that is round.

    The side toward the camera shows the outside, and the far side shows the inside of hollow objects, so they are
    treated separately. Only the outermost point of each sector counts, so that a handle affects one sector of many.
    """
    offset = points[:, :2] - middle
    radii = np.linalg.norm(offset, axis=1)
    band = ((points[:, 2] - points[:, 2].min()) / (1.5 * BAND)).astype(int)
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
    """Rotate the points (P, 3) about the upright axis at `middle` (2,)."""
    c, s = math.cos(turn), math.sin(turn)
    return np.column_stack(((points[:, :2] - middle) @ np.array([[c, s], [-s, c]]) + middle, points[:, 2]))


def _likely_middles(points: np.ndarray) -> list[np.ndarray]:
    """Return candidates for the axis (2,) of points (P, 3): the centre of their circles, their mean, and that of the
    highest.
    """
    low, high = np.quantile(points[:, :2], [0.01, 0.99], axis=0)
    top = points[points[:, 2] > level_top(points[:, 2]) - 0.01, :2]
    return [_common_middle(points), 0.5 * (low + high), 0.5 * (top.min(axis=0) + top.max(axis=0))]


def _axis(points: np.ndarray, eye: np.ndarray, starts: Sequence[np.ndarray]) -> tuple[np.ndarray, float]:
    """Find the axis (2,) about which points (P, 3) are rotationally symmetric, and their typical deviation in metres.

    Args:
        starts: candidate positions; the best one is refined.
    """
    # The far side of a wall shows its inside, the near side its outside.
    few = min(12, len(points))
    two_sides = float(opens_above(np.linalg.norm(points[:, :2] - starts[0], axis=1), points[:, 2]))

    def deviation(middle: np.ndarray) -> float:
        offset = points[:, :2] - middle
        far = two_sides * (offset @ (eye[:2] - middle) > 0)
        radii = np.linalg.norm(offset, axis=1)
        curve = np.stack((radii, points[:, 2], far), axis=1)
        apart, near = cKDTree(curve, leafsize=32, balanced_tree=False, compact_nodes=False).query(curve, k=few)
        x, y = (offset / np.maximum(radii, 1e-12)[:, None]).T
        same_side = x[near] * x[:, None] + y[near] * y[:, None] > math.cos(_OPPOSITE)
        apart[same_side & (radii > 0.01)[:, None]] = _FAR
        nearest = np.sort(np.minimum(apart[:, 1:].min(axis=1), _FAR))
        return float(nearest[: math.ceil(_OWN * len(nearest))].mean())

    from scipy.optimize import minimize  # takes longer to import than all completion, and few clouds need it

    best = min(starts, key=deviation)
    simplex = best + 0.006 * np.array([[0, 0], [1, 0], [0, 1]])
    options = {"initial_simplex": simplex, "maxfev": 60, "xatol": 3e-4, "fatol": 1e-5}
    found = minimize(deviation, best, method="Nelder-Mead", options=options)
    return found.x, float(found.fun)


def _common_middle(points: np.ndarray) -> np.ndarray:
    """Return the common centre (2,) of circles fitted to height bands of points (P, 3), ignoring outliers."""
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

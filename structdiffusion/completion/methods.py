"""Complete an object's far side, inside and bottom from a partial view.

| method | body |
|---|---|
| "hull" | the convex hull of the seen points and of the lowest ones projected onto the support |
| "extrude" | the seen points extended straight down to the support, as one convex hull |
| "columns" | the same, in as many convex parts as the outline and its steps need |
| "mirror" | the hidden far side from the most likely mirror plane or half turn; then "extrude" |
| "symmetry" | bodies of revolution for round objects, hollow if the camera saw inside; else "mirror", then "columns" |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError, cKDTree

from structdiffusion.completion.axis_fitting import turned_body
from structdiffusion.completion.columns import column_parts, solid
from structdiffusion.completion.estimate import outline_of, top_of
from structdiffusion.completion.revolution import Turned
from structdiffusion.completion.tops import fall_of_top, is_rounded
from structdiffusion.completion.view import View, level_top, levelled, without_strays
from structdiffusion.footprints import stands_above
from structdiffusion.objects.decomposition import few_vertices
from structdiffusion.objects.rigid_body import mass_properties
from structdiffusion.observation import ObjectCloud

METHODS = ("hull", "extrude", "columns", "mirror", "symmetry")
BEST = "symmetry"

_FLAT = 0.015  # m: lower objects show their whole outline to a camera above
_TOP, _BROAD = 0.008, 0.85  # m below the top that belong to it; share of the outline's area
_FEWEST = 12  # points needed to detect a symmetry
_MOST = 1200  # points used
_LOW = 0.15  # share of the height that the lowest points span
_TRIED = 200  # points mirrored to test a symmetry
_CERTAIN = 0.15  # smallest plausibility of an accepted symmetry
_APPENDAGE = 25  # points outside a round body that form a handle
_HANDLE = 0.006  # m below the seen points of a handle that belong to it
# The top of a ball falls by a seventh of its radius (`fall_of_top`), a level top by zero.
_BALL_FALLS = 0.07
_STUDS = 0.0016  # m by which an object has to be higher than its level top would be
_FOOT, _VERTICES = 0.0015, 64  # m by which a round object is flattened at the bottom; vertices of a round body
_LEVEL_FOOT = 2e-4  # m: what begins this close to its lowest point touches the support


@dataclass(frozen=True)
class CompletedShape:
    """A completed shape, estimated from a partial view. World frame, metres.

    Attributes:
        parts: convex parts, each (V, 3); their union is the body, and its lowest point is on the support.
        seen: (P, 3) the points that it was estimated from, without strays and with the noise smoothed.
        symmetry: "turned", "ball", "half turn", "mirror", "prism" or "": how the far side was estimated.
        hollow: whether it is open at the top.
    """

    parts: tuple[np.ndarray, ...]
    seen: np.ndarray
    symmetry: str = ""
    hollow: bool = False


def are_covered(clouds: Sequence[ObjectCloud]) -> list[bool]:
    """Return of each object whether another stands on it, directly or on others."""
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    bottoms = [cloud.bottom for cloud in clouds]
    every = range(len(clouds))
    return [any(stands_above(upper, index, outlines, bottoms) for upper in every) for index in every]


def complete(
    cloud: ObjectCloud, world_from_camera: np.ndarray | None, method: str = BEST, covered: bool = False
) -> CompletedShape:
    """Complete the body of a partly seen object.

    Args:
        cloud: the seen points, any number of them.
        world_from_camera: (4, 4); without it hidden regions are unknown, and nothing is mirrored.
        method: one of `METHODS`.
        covered: whether something stands on it. Then its top is not seen, and nothing tells how far its sides reach
            back: it is taken to fill a rectangle around what is seen, if it is neither round nor hollow.

    Raises:
        ValueError: for an unknown method, or a cloud without points.
    """
    if method not in METHODS:
        raise ValueError(f"a method of completion cannot be {method!r}; legal: {', '.join(METHODS)}")
    points = np.asarray(cloud.points, dtype=np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise ValueError(f"no point was seen of the {cloud.name}")
    points = without_strays(points[:: math.ceil(len(points) / _MOST)])
    points[:, 2] = np.maximum(points[:, 2], cloud.bottom)
    as_seen = replace(cloud, points=points)
    view = None
    if world_from_camera is not None and len(points) >= _FEWEST:
        view = View(points, world_from_camera[:3, 3])
        points = view.points
        points[:, 2] = np.maximum(points[:, 2], cloud.bottom)
    points = levelled(points)
    if method == "hull":
        return CompletedShape((_lowered_hull(points, cloud.bottom),), points)
    if method == "extrude" or (view is None and method == "mirror"):
        return CompletedShape((solid(points, cloud.bottom),), points)
    if method == "columns" or view is None:
        return CompletedShape(column_parts(points, cloud.bottom), points)
    if method == "mirror":
        far, symmetry = mirrored(view, cloud.bottom)
        return CompletedShape((solid(np.concatenate((points, far)), cloud.bottom),), points, symmetry)
    round_top = is_rounded(points, float(points[:, 2].max()) - cloud.bottom)
    if (turned := turned_body(view, cloud.bottom)) is not None and not _cornered(turned[0], points):
        body, own = turned
        parts = body.parts()
        if round_top and not (body.hollow or body.ball):
            parts = (_round_below(np.concatenate(parts), cloud.bottom),)
        handle = _largest_piece(points[~own])
        if len(handle) >= _APPENDAGE:
            hangs = max(cloud.bottom, float(np.quantile(handle[:, 2], 0.02)) - _HANDLE)
            parts += column_parts(handle, hangs)
        if not body.hollow:
            parts = _as_high(parts, as_seen)
        return CompletedShape(parts, points, "ball" if body.ball else "turned", body.hollow)
    far, symmetry = mirrored(view, cloud.bottom)
    whole = np.concatenate((points, far))
    if covered and not top_of(points, outline_of(points[:, :2]))[1]:
        return CompletedShape((_prism(whole, cloud.bottom),), points, "prism")
    parts = (_round_below(whole, cloud.bottom),) if round_top else column_parts(whole, cloud.bottom)
    return CompletedShape(_as_high(parts, as_seen), points, symmetry)


def mirrored(view: View, support: float) -> tuple[np.ndarray, str]:
    """Return the points (Q, 3) of the far side by the most likely symmetry of the seen points, and the name of the
    symmetry.

    Candidates are half turns about an upright axis and reflections in upright planes. A candidate is likely if it maps
    the seen points onto or behind seen points, and none into space that the camera saw to be empty.
    """
    points = view.points
    none = np.empty((0, 3)), ""
    if np.ptp(points[:, 2]) < _FLAT or points[:, 2].max() - support < _FLAT or _shows_outline(points):
        return none
    few = points[:: math.ceil(len(points) / _TRIED)]
    away = points[:, :2].mean(axis=0) - view.eye[:2]
    away = away / max(1e-9, float(np.linalg.norm(away)))
    beside = np.array([-away[1], away[0]])
    along, across = points[:, :2] @ away, points[:, :2] @ beside
    depth, width = np.quantile(along, [0.01, 0.99]), np.quantile(across, [0.01, 0.99])
    best, found = _CERTAIN, None
    for d in np.linspace(0.4, 0.75, 8):
        for w in (0.45, 0.5, 0.55):
            middle = (depth[0] + d * (depth[1] - depth[0])) * away + (width[0] + w * (width[1] - width[0])) * beside
            for kind in (None, *np.linspace(-math.pi / 2, math.pi / 2, 8, endpoint=False)):
                score = view.plausibility(_reflected(few, middle, kind)) + (0.03 if kind is None else 0.0)
                if score > best:
                    best, found = score, (middle, kind)
    if found is None:
        return none
    middle, kind = found
    far = _reflected(points, middle, kind)
    return far[view.hidden(far)], "half turn" if kind is None else "mirror"


def _largest_piece(points: np.ndarray) -> np.ndarray:
    """Return the largest connected group of the points (P, 3); everything else that sticks out of a body is noise."""
    if len(points) < _APPENDAGE:
        return points[:0]
    tree = cKDTree(points)
    reach = 3 * float(np.median(tree.query(points, k=4)[0][:, 3]))
    pairs = tree.query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    _, piece = connected_components(links, directed=False)
    return points[piece == np.bincount(piece).argmax()]


def _shows_outline(points: np.ndarray) -> bool:
    """Return whether the seen top (P, 3) is level and as wide as the whole, so that nothing sticks out behind it."""
    top = points[points[:, 2] > level_top(points[:, 2]) - _TOP]
    try:
        return ConvexHull(top[:, :2]).volume > _BROAD * ConvexHull(points[:, :2]).volume  # in 2-d, volume is area
    except (QhullError, ValueError):
        return False


def _reflected(points: np.ndarray, middle: np.ndarray, heading: float | None) -> np.ndarray:
    """Rotate points (P, 3) by a half turn about the axis at `middle` (2,), or reflect them in the plane facing
    `heading`.
    """
    offset = points[:, :2] - middle
    if heading is None:
        return np.column_stack((middle - offset, points[:, 2]))
    normal = np.array([math.cos(heading), math.sin(heading)])
    return np.column_stack((points[:, :2] - 2 * (offset @ normal)[:, None] * normal, points[:, 2]))


def _cornered(body: Turned, points: np.ndarray) -> bool:
    """Return whether a supposed ball has a level top; a small cube is nowhere far from a ball."""
    radius = float(body.outer[:, 0].max())
    return body.ball and fall_of_top(points) < _BALL_FALLS * radius


def _as_high(parts: tuple[np.ndarray, ...], cloud: ObjectCloud) -> tuple[np.ndarray, ...]:
    """Stretch the parts if studs or a ridge, which have few points, reach higher than a level top would."""
    top = max(float(part[:, 2].max()) for part in parts)
    reach, _ = top_of(cloud.points, outline_of(cloud.points[:, :2]))
    if reach - top < _STUDS or top - cloud.bottom < _STUDS:
        return parts
    stretch = (reach - cloud.bottom) / (top - cloud.bottom)
    return tuple((part - [0, 0, cloud.bottom]) * [1, 1, stretch] + [0, 0, cloud.bottom] for part in parts)


def _round_below(points: np.ndarray, support: float) -> np.ndarray:
    """Return the convex hull (V, 3) of a body that is as round below as above, and stands on a flat: a small one, or
    as large as it takes to stand."""
    top, flat = float(points[:, 2].max()), _FOOT
    upper = points[points[:, 2] >= support + 0.5 * (top - support)]
    while True:
        lower = upper * [1, 1, -1] + [0, 0, top + support]
        lower[:, 2] = np.maximum(lower[:, 2], support + flat)
        whole = np.concatenate((upper, lower - [0, 0, flat]))
        body = few_vertices(whole[ConvexHull(whole).vertices], _VERTICES)
        if flat > 0.5 * (top - support) or _stands(body):
            return body
        flat *= 2


def _stands(body: np.ndarray) -> bool:
    """Return whether the centre of mass of a convex body (V, 3) is above the flat that it stands on."""
    foot = shapely.MultiPoint(body[body[:, 2] < body[:, 2].min() + _LEVEL_FOOT, :2]).convex_hull
    return bool(foot.contains(shapely.Point(mass_properties((body,), 1.0).object_from_inertial[:2, 3])))


def _prism(points: np.ndarray, bottom: float) -> np.ndarray:
    """Return the corners (8, 3) of an upright prism over the rectangle around points (P, 3) to whose sides they lie
    nearest on average.

    Around two faces of a box the smallest rectangle has two solutions of the same area, and the other one lies across.
    """
    headings = np.deg2rad(np.arange(90.0))
    axes = np.stack((np.cos(headings), np.sin(headings), -np.sin(headings), np.cos(headings)), axis=1).reshape(-1, 2, 2)
    along = axes @ points[:, :2].T  # (90, 2, P)
    low, high = along.min(axis=2, keepdims=True), along.max(axis=2, keepdims=True)
    best = int(np.minimum(along - low, high - along).min(axis=1).mean(axis=1).argmin())
    (left, near), (right, far) = low[best, :, 0], high[best, :, 0]
    corners = np.array([(left, near), (left, far), (right, far), (right, near)]) @ axes[best]
    return np.concatenate([np.column_stack((corners, np.full(4, z))) for z in (bottom, points[:, 2].max())])


def _lowered_hull(points: np.ndarray, support: float) -> np.ndarray:
    """Return the convex hull (V, 3) of points and of the shadow of the lowest ones."""
    low = points[points[:, 2] <= np.quantile(points[:, 2], 0.02) + _LOW * np.ptp(points[:, 2])]
    feet = solid(low, support)
    whole = np.concatenate((points, feet))
    return whole[ConvexHull(whole).vertices]

"""Plane geometry of footprints: clear gaps, tightest extents, and possible centres of a structure on a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from structdiffusion.evaluation_protocol import CLEARANCE
from structdiffusion.observation import Table

# m, m^2: what stands higher by less, or overlaps less, stands beside the other one.
LEAST_STEP, LEAST_OVERLAP = 0.003, 1e-4


def turned(outline: np.ndarray, yaw: float) -> np.ndarray:
    """Rotate an outline (K, 2) by `yaw` about its origin."""
    c, s = math.cos(yaw), math.sin(yaw)
    return outline @ np.array([[c, s], [-s, c]])


def turned_by_each(outline: np.ndarray, yaws: np.ndarray) -> np.ndarray:
    """Rotate an outline (K, 2) about its origin by each of T angles: (T, K, 2), the same as `turned` to the bit."""
    both = [(math.cos(yaw), math.sin(yaw)) for yaw in yaws.tolist()]  # numpy rounds some of them otherwise
    return outline @ np.array([[[c, s], [-s, c]] for c, s in both]).reshape(-1, 2, 2)


def _following(corners: np.ndarray) -> np.ndarray:
    """Return for each corner (K, 2) the next one; the same as `np.roll`, which takes five times as long."""
    return np.concatenate((corners[1:], corners[:1]))


def outline_centroid(outline: np.ndarray) -> np.ndarray:
    """Return the area centroid (2,) of a convex outline (K, 2); the mean of its corners if it has no area."""
    return outline_centroids(outline[None])[0]


def outline_centroids(outlines: np.ndarray) -> np.ndarray:
    """Return the area centroid (T, 2) of each of T convex outlines (T, K, 2), as `outline_centroid` does."""
    about = outlines - outlines[:, :1]  # far from the origin, areas about it would cancel out
    following = np.concatenate((about[:, 1:], about[:, :1]), axis=1)
    cross = about[..., 0] * following[..., 1] - following[..., 0] * about[..., 1]
    area = cross.sum(axis=1)
    flat = area == 0.0
    moment = ((about + following) * cross[..., None]).sum(axis=1)
    centroids = outlines[:, 0] + moment / (3.0 * np.where(flat, 1.0, area))[:, None]
    return np.where(flat[:, None], outlines.mean(axis=1), centroids) if flat.any() else centroids


def clear_gap(a: np.ndarray, b: np.ndarray) -> float:
    """Return the distance, metres, between two outlines (K, 2) in one frame; 0 if they overlap."""
    return float(shapely.distance(shapely.Polygon(a), shapely.Polygon(b)))


def overlap_depths(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far, metres, each of T convex outlines (T, K, 2) overlaps one of T others (T, L, 2): (T,).

    That is the shortest separating move; 0 where they are apart. By the separating axis theorem, two convex outlines
    overlap iff their shadows overlap along every edge normal.
    """
    depths = np.zeros(len(a))
    apart = (a.max(axis=1) <= b.min(axis=1)) | (b.max(axis=1) <= a.min(axis=1))
    near = np.flatnonzero(~apart.any(axis=1))
    if not len(near):
        return depths
    a, b, shortest = a[near], b[near], np.full(len(near), math.inf)
    for outline in (a, b):
        edges = np.concatenate((outline[:, 1:], outline[:, :1]), axis=1) - outline
        normals = np.stack((edges[..., 1], -edges[..., 0]), axis=1)  # (T, 2, E)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
        shadow_a, shadow_b = a @ normals, b @ normals  # (T, K, E)
        # To either side: where one shadow lies inside the other, parting them takes more than its width.
        one_side, other_side = shadow_a.max(1) - shadow_b.min(1), shadow_b.max(1) - shadow_a.min(1)
        shortest = np.minimum(shortest, np.minimum(one_side, other_side).min(axis=1))
    depths[near] = np.maximum(shortest, 0.0)
    return depths


def separation_along(a: np.ndarray, b: np.ndarray, direction: np.ndarray, clearance: float = CLEARANCE) -> float:
    """Return how far b's origin must lie from a's along a unit `direction` (2,) for a clear gap of `clearance`; see
    `separations_along`.
    """
    return float(separations_along(a, b, direction[None], clearance)[0])


def separations_along(a: np.ndarray, b: np.ndarray, directions: np.ndarray, clearance: float = CLEARANCE) -> np.ndarray:
    """Return how far b's origin must lie from a's for a clear gap of `clearance`, along unit directions (D, 2): (D,).

    Both outlines (K, 2) are convex, counter-clockwise, and about their own origins. They are closer than `clearance`
    as long as the vector between the origins lies inside a + (-b), rounded outward by `clearance`: the answer
    is where the ray leaves that region, through an edge moved outward or through the arc about a corner. It is the
    last of all such places, because parallel sides have collinear edges, and the ray may leave through any of them.
    """
    corners = _minkowski_sum(a, -b)
    edges = _following(corners) - corners
    lengths = np.linalg.norm(edges, axis=1)
    tangents = edges / (lengths[:, None] + 1e-12)
    normals = np.column_stack((tangents[:, 1], -tangents[:, 0]))  # outward
    rays = directions[:, :, None]  # one product for each: the product for all of them is rounded otherwise
    facing = (normals @ rays)[..., 0]  # (D, edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        leaves = ((normals * corners).sum(axis=1) + clearance) / facing
    leaves[(facing <= 1e-9) | (lengths < 1e-9)] = 0.0
    places = leaves * (tangents @ rays)[..., 0] - (tangents * corners).sum(axis=1)  # along each edge
    leaves[(places < -1e-9) | (places > lengths + 1e-9)] = 0.0
    along = (corners @ rays)[..., 0]
    beside = clearance**2 - ((corners**2).sum(axis=1) - along**2)
    arcs = np.where(beside >= 0.0, along + np.sqrt(np.maximum(beside, 0.0)), 0.0)
    return np.maximum(0.0, np.maximum(leaves.max(axis=1), arcs.max(axis=1)))


def _minkowski_sum(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the corners (K + L, 2) of the Minkowski sum of convex outlines (K, 2) and (L, 2), counter-clockwise."""
    edges = np.concatenate((_following(a) - a, _following(b) - b))
    headings = np.arctan2(edges[:, 1], edges[:, 0])
    # From the lowest corners (of several the leftmost) on, the edges of both follow each other by their headings.
    lowest = sum(outline[np.lexsort((outline[:, 0], outline[:, 1]))[0]] for outline in (a, b))
    order = np.argsort(np.where(headings < 0.0, headings + 2.0 * math.pi, headings), kind="stable")
    return lowest + np.concatenate((np.zeros((1, 2)), np.cumsum(edges[order], axis=0)[:-1]))


def tightest_ring_radius(outlines: Sequence[np.ndarray], directions: np.ndarray) -> float:
    """Return the smallest radius at which outlines (about their own origins), one per direction, clear by 1 cm.

    Args:
        outlines: N outlines (K, 2), already turned as they will stand.
        directions: (N, 2) unit vectors from the ring's centre.
    """
    return tightest_scale(outlines, directions)


def tightest_scale(outlines: Sequence[np.ndarray], places: np.ndarray, clearance: float = CLEARANCE) -> float:
    """Return the smallest factor of all places at which the outlines on them clear each other by `clearance`, 1 cm.

    Args:
        outlines: N outlines (K, 2), about their own origins, already turned as they will stand.
        places: (N, 2) of the origins, about any centre.
    """
    reach = [float(np.linalg.norm(outline, axis=1).max()) for outline in outlines]
    pairs = []
    for i in range(len(outlines)):
        for j in range(i + 1, len(outlines)):
            chord = places[j] - places[i]
            pairs.append((float(np.linalg.norm(chord)), i, j, chord))
    scale = 0.0
    for length, i, j, chord in sorted(pairs, key=lambda pair: pair[0]):
        # Neighbours decide; a pair far apart is skipped when even its reaches ask for no more than is given.
        if length > 1e-6 and (reach[i] + reach[j] + clearance) / length > scale:
            scale = max(scale, separation_along(outlines[i], outlines[j], chord / length, clearance) / length)
    return scale


def centre_range(outlines: Sequence[np.ndarray], centre: np.ndarray, table: Table) -> np.ndarray:
    """Return where a structure's centre can lie with everything on the table: [[x low, x high], [y low, y high]],
    metres.

    Args:
        outlines: N outlines (K, 2) in the world frame.
        centre: (2,) the structure's centre in the same frame.
    """
    points = np.concatenate(outlines)
    before, after = centre - points.min(axis=0), points.max(axis=0) - centre
    return np.array(
        [
            [table.x_min + before[0], table.x_max - after[0]],
            [table.y_min + before[1], table.y_max - after[1]],
        ]
    )


def fit_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Fit a least-squares circle to points (N, 2), N >= 3; return its centre (2,) and radius, metres.

    The fit starts from the algebraic solution and minimises the distances to the circle by Gauss-Newton.
    """
    system = np.column_stack((2 * points, np.ones(len(points))))
    solution, *_ = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)
    centre, radius = solution[:2], math.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-12))
    for _ in range(20):
        offset = points - centre
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
        jacobian = np.column_stack((-offset / distance[:, None], -np.ones(len(points))))
        step, *_ = np.linalg.lstsq(jacobian, -(distance - radius), rcond=None)
        centre, radius = centre + step[:2], radius + step[2]
        if np.abs(step).max() < 1e-9:
            break
    return centre, float(radius)


def stands_above(upper: int, lower: int, outlines: Sequence[BaseGeometry], bottoms: Sequence[float]) -> bool:
    """Return whether an object stands above another, directly or on other objects.

    Args:
        outlines: of every object, seen from above, metres. bottoms: z of what each stands on.
    """
    higher = bottoms[upper] > bottoms[lower] + LEAST_STEP
    return higher and outlines[upper].intersection(outlines[lower]).area > LEAST_OVERLAP

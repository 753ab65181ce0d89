"""Describe one object as the tracker knows it: a completed body, points on its surface, and its colours."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.completion.methods import complete
from structdiffusion.completion.view import View
from structdiffusion.observation import ObjectCloud

SAMPLES = 600  # points on the surface: 5 mm apart on a can
ROUND = 1.08  # times its smallest radius is the largest of a round outline, noise and facets included
DIRECTIONS = 24  # in which an outline's radius is measured
LEAST_THICKNESS = 0.002  # m: a body must have some volume
CONTRADICTION = 0.005  # m in front of what was seen: noise, and the spacing of the seen points on steep surfaces
SAME_PLACE = 1e-4  # m: where two parts of a body meet there is no surface
BRIGHTNESS = 0.1  # of a colour's logarithm beside its direction: shade changes the one by half and not the other
COLOR_STEP = 0.05  # colours nearer than this are one colour of the palette
RARE = 0.03  # share of the points below which a colour is not the object's own


@dataclass(frozen=True, eq=False)
class TrackedShape:
    """A body in its own frame: the origin in the middle of its footprint, at the height of what it stood on at first.

    Attributes:
        world_from_shape: (4, 4) its first pose, not rotated.
        planes: (K, 4) outward unit normals and offsets of its convex parts' faces, metres: inside, n p + d < 0.
        starts: (parts,) the first plane of each part.
        samples, normals: (S, 3) points on its surface where the first look does not rule it out, metres, and their
            outward unit normals.
        palette: (C, 4) its colours, as `color_features` gives them; empty where the camera has no colour.
        radius: the largest distance of a sample from the origin, metres.
        height: of the body, metres.
        rounded: whether its outline is a circle, so that a turn about the vertical cannot be seen.
    """

    world_from_shape: np.ndarray
    planes: np.ndarray
    starts: np.ndarray
    samples: np.ndarray
    normals: np.ndarray
    palette: np.ndarray
    radius: float
    height: float
    rounded: bool

    def distances(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return signed distances (P,), metres, of points (P, 3) in the shape's frame, and the nearest planes (P,).

        Inside the body a distance is negative; beyond an edge it is the farthest of the planes there.
        """
        return self._nearest(points @ self.planes[:, :3].T + self.planes[:, 3])

    def distances_seen(self, points: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the same, but from the plane on which the ray from an eye (3,) through each point meets the body.

        So a point of a cup's inner wall counts from that side of the wall. Only rays that miss the body count from
        its nearest plane.
        """
        at_eye = self.planes[:, :3] @ eye + self.planes[:, 3]
        above = points @ self.planes[:, :3].T + self.planes[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = at_eye / (at_eye - above)  # where the ray crosses each plane: 0 at the eye, 1 at the point
        outer = at_eye > 0
        entering = np.where(outer, np.where(above < at_eye, crossing, np.inf), -np.inf)
        leaving = np.where(~outer & (above > at_eye), crossing, np.inf)
        enters = np.maximum.reduceat(entering, self.starts, axis=1)
        misses = enters >= np.minimum.reduceat(leaving, self.starts, axis=1)
        enters[misses | np.isneginf(enters)] = np.inf
        rows, part = np.arange(len(points)), enters.argmin(axis=1)
        entering[self._owner[None] != part[:, None]] = -np.inf
        plane = entering.argmax(axis=1)
        distance = above[rows, plane]
        missed = np.isinf(enters[rows, part])
        distance[missed], plane[missed] = self._nearest(above[missed])
        return distance, plane

    @cached_property
    def _owner(self) -> np.ndarray:
        """Return the part (K,) of each plane."""
        return np.repeat(np.arange(len(self.starts)), np.diff(np.append(self.starts, len(self.planes))))

    def _nearest(self, above: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (P,) and planes (P,) of points that lie so far (P, K) above each plane."""
        of_parts = np.maximum.reduceat(above, self.starts, axis=1)
        part = of_parts.argmin(axis=1)
        own = np.where(self._owner[None] == part[:, None], above, -np.inf)
        return of_parts[np.arange(len(above)), part], own.argmax(axis=1)


def tracked_shape(cloud: ObjectCloud, world_from_camera: np.ndarray | None) -> TrackedShape:
    """Complete what was seen of an object, and describe it for tracking.

    Args:
        cloud: its points, world frame, metres.
        world_from_camera: (4, 4) the camera that saw it, or `None`.
    """
    parts = [_solid(np.asarray(part, dtype=np.float64)) for part in complete(cloud, world_from_camera).parts]
    vertices = np.concatenate(parts)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origin = np.array([*(low[:2] + high[:2]) / 2, cloud.bottom])
    pose = np.eye(4)
    pose[:3, 3] = origin
    hulls = [ConvexHull(part - origin) for part in parts]
    planes = [np.unique(hull.equations.round(6), axis=0) for hull in hulls]
    starts = np.cumsum([0, *(len(one) for one in planes)])[:-1]
    samples, normals = _surface(hulls, planes)
    if world_from_camera is not None:
        credible = _credible(samples + origin, View(cloud.points, world_from_camera[:3, 3]))
        samples, normals = samples[credible], normals[credible]
    outline = vertices[:, :2] - origin[:2]
    colors = np.empty((0, 3), dtype=np.uint8) if cloud.colors is None else cloud.colors
    return TrackedShape(
        pose, np.concatenate(planes), starts, samples, normals, _palette(color_features(colors)),
        float(np.linalg.norm(samples, axis=1).max()), float(high[2] - cloud.bottom), _is_round(outline),
    )  # fmt: skip


def color_features(colors: np.ndarray) -> np.ndarray:
    """Return features (..., 4) of colours (..., 3) uint8: their direction, which shade leaves alone, and brightness."""
    values = colors.astype(np.float64) + 1.0
    length = np.linalg.norm(values, axis=-1, keepdims=True)
    return np.concatenate((values / length, BRIGHTNESS * np.log(length)), axis=-1)


def _palette(features: np.ndarray) -> np.ndarray:
    if not len(features):
        return np.empty((0, 4))
    cells, member, counts = np.unique((features / COLOR_STEP).round(), axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(cells), 4))
    np.add.at(sums, member.ravel(), features)
    means = sums / counts[:, None]
    common = counts >= RARE * len(features)
    return means[common] if common.any() else means


def _solid(part: np.ndarray) -> np.ndarray:
    """Return vertices (V, 3) with some volume: flat things are seen without a thickness."""
    try:
        if ConvexHull(part).volume > 0 and np.ptp(part[:, 2]) >= LEAST_THICKNESS:
            return part
    except QhullError:
        pass
    around = LEAST_THICKNESS / 2 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return (part[:, None] + around[None]).reshape(-1, 3)


def _surface(hulls: list[ConvexHull], planes: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return samples and normals of the surface of a union of convex parts,
    spread evenly and always in the same way.
    """
    corners = np.concatenate([hull.points[hull.simplices] for hull in hulls])
    normals = np.concatenate([hull.equations[:, :3] for hull in hulls])
    part = np.repeat(np.arange(len(hulls)), [len(hull.simplices) for hull in hulls])
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.linalg.norm(np.cross(first, second), axis=1)
    count = SAMPLES if len(hulls) == 1 else 2 * SAMPLES  # half of them may lie where parts meet
    place = (np.arange(count) + 0.5) / count * areas.sum()
    chosen = np.searchsorted(np.cumsum(areas), place).clip(max=len(areas) - 1)
    golden = 1.32471795724474602596  # of the plastic number: the most even sequence in two dimensions
    u, v = (np.arange(count)[:, None] / np.array([golden, golden**2]) % 1.0).T
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    one, two, three = corners[chosen].transpose(1, 0, 2)
    points = one + u[:, None] * (two - one) + v[:, None] * (three - one)
    outer = np.ones(count, dtype=bool)
    for k, faces in enumerate(planes):
        inside = (points @ faces[:, :3].T + faces[:, 3]).max(axis=1) < SAME_PLACE
        outer &= ~inside | (part[chosen] == k)
    return points[outer], normals[chosen[outer]]


def _credible(samples: np.ndarray, view: View) -> np.ndarray:
    """Return which of the samples (S, 3) the first look does not rule out: completion fills gaps, as between tines."""
    behind, outside = view.behind(samples)
    credible = ~outside & (behind > -CONTRADICTION)
    return credible if credible.any() else np.ones(len(samples), dtype=bool)


def _is_round(outline: np.ndarray) -> bool:
    """Return whether the outline of points (P, 2) about the origin is a circle: equally wide in all directions."""
    angles = np.arange(DIRECTIONS) * 2 * math.pi / DIRECTIONS
    reach = (outline @ np.stack((np.cos(angles), np.sin(angles)))).max(axis=0)
    return bool(reach.max() < ROUND * reach.min())

"""Find the plane of the table among all planes that a depth camera sees, such as floors, walls and the tops of
boxes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from agent.errors import BadInput
from agent.recordings.plane_fitting import largest_plane, thinned
from structdiffusion.geometry import lengths, transform_points

FARTHEST = 2.5  # m; depth cameras measure to a centimetre up to there, and no Jaco reaches beyond
_CELL = 0.01  # m, of the thinned cloud: areas are counted in its cells
_INLIER = 0.012  # m: three sigma of a Kinect at 1.2 m
_MOST_PLANES = 6
_LEAST_AREA = 0.015  # m2 of table that must be seen: a sheet of A6
_NEAR = 1.2  # m; planes farther away count less
_TALLEST = 0.4  # m above a table: what stands on it
_MOST_THROUGH = 1.0  # times as many points behind a plane as in it: it is none, but a slice of something else
_GRID = 0.025  # m, of the cells by which the points of a plane are connected
_GAP = 2  # cells by which its points are closed
_WALL_AREA, _CROSSWISE = 0.2, 0.2  # m2 of a wall, and the cosine of its angle with a floor
_CONNECTED = 0.2  # of a plane's points lie in its largest part: otherwise they are scattered ones
_TABLE_AREA, _TABLE_HEIGHT = 0.12, 0.35  # m2 and m above the floor of the lowest and smallest table
_AT_WALL = 0.03  # m: noise of a wall behind the table
_SLANT = math.cos(math.radians(5.0)), math.cos(math.radians(40.0))
_LOWEST_CAMERA = 0.08  # m above the table
_UPRIGHT = math.cos(math.radians(25.0))  # a table may lean from a known up by a bad calibration's error
IMAGE_UP = np.array([0.0, -1.0, 0.0])  # camera frame


@dataclass(frozen=True)
class TablePlane:
    """The table's plane.

    Attributes:
        level_from_camera: (4, 4) to a frame in the plane below the camera: z up, x where the camera looks.
        walls: (W, 4) planes of large upright surfaces, camera frame: n . p + d = 0.
    """

    level_from_camera: np.ndarray
    walls: np.ndarray

    @property
    def up(self) -> np.ndarray:
        """Return the plane's normal (3,), camera frame, toward the camera."""
        return self.level_from_camera[2, :3]


def table_plane(points: np.ndarray, up: np.ndarray | None = None) -> TablePlane:
    """Find the plane that is most probably the table: near, level, large, with objects on it.

    Args:
        points: (P, 3) camera frame, metres, all finite.
        up: (3,) the world's up in the camera frame where it is known; otherwise the camera is held upright, or looks
            straight down.

    Raises:
        BadInput: when no plane can be a table.
    """
    near = points[lengths(points) < FARTHEST]
    thin = thinned(near, _CELL)
    if len(thin) * _CELL**2 < _LEAST_AREA:
        raise BadInput(
            f"there is no table to see: {len(near)} of {len(points)} measured points lie within {FARTHEST} m of the "
            f"camera and cover {len(thin) * _CELL**2 * 1e4:.0f} cm2; a table needs {_LEAST_AREA * 1e4:.0f} cm2"
        )
    candidates = _planes(thin)
    scores = [_score(plane, candidates, thin, up) for plane in candidates]
    if not scores or max(scores) <= 0.0:
        how = "upright by its known pose" if up is not None else "held upright or looking down"
        seen = ", ".join(_plane_in_words(plane, thin, up) for plane in candidates) or "none"
        raise BadInput(
            f"there is no table to see: no plane of at least {_LEAST_AREA * 1e4:.0f} cm2 lies level below the camera "
            f"({how}); planes seen: {seen}"
        )
    best = candidates[int(np.argmax(_floors_doubted(scores, candidates, thin)))]
    return TablePlane(_level(_refined(best, near)), _walls(best, candidates, thin))


def on_walls(points: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Return which points (P, 3) lie on one of the planes (W, 4) of walls, as far as noise reaches."""
    return np.any(np.abs(points @ walls[:, :3].T + walls[:, 3]) < _AT_WALL, axis=1)


def _planes(thin: np.ndarray) -> list[np.ndarray]:
    """Find planes (4,), n . p + d = 0 with n toward the camera, the one with the most points first."""
    rng = np.random.default_rng(0)  # the same cloud gives the same planes
    found: list[np.ndarray] = []
    rest = thin
    while len(found) < _MOST_PLANES and len(rest) * _CELL**2 >= _LEAST_AREA:
        plane, inliers = largest_plane(rest, _INLIER, rng)
        if inliers.sum() * _CELL**2 < _LEAST_AREA:
            break
        found.append(plane if plane[3] > 0 else -plane)
        rest = rest[~inliers]
    return found


def _score(plane: np.ndarray, others: list[np.ndarray], thin: np.ndarray, up: np.ndarray | None) -> float:
    """Rate how much a plane resembles a table among other planes; 0 if it cannot be one."""
    normal, height = plane[:3], plane[3]
    levelness = float(normal @ (IMAGE_UP if up is None else up))
    if _cuts_slantwise(plane, others, thin):
        return 0.0
    if height < _LOWEST_CAMERA or levelness < (-0.3 if up is None else _UPRIGHT):
        return 0.0
    above = thin @ normal + height
    flat = np.abs(above) < _INLIER
    # A wall in front of a level camera and a table below one that looks straight down have the same normal in the
    # picture, at right angles to its up: such a plane counts only where there is no other.
    upright = float(np.clip((levelness + 0.1) / 0.35, 0.05, 1.0)) if up is None else 1.0
    # Beyond half a square metre more is no better: the floor is always the largest.
    area = min(flat.sum() * _CELL**2, 0.5)
    lies = _level(plane)
    seen, share = _outline(transform_points(lies, thin[flat])[:, :2])
    if share < _CONNECTED:
        return 0.0
    # The foot of a wall is nothing that stands on a floor.
    standing = (above > _INLIER) & (above < _TALLEST) & ~on_walls(thin, _walls(plane, others, thin))
    on_it = transform_points(lies, thin[standing])[:, :2]
    things = int(shapely.contains_xy(seen, on_it).sum())
    nearness = 1.0 / (1.0 + (np.median(np.linalg.norm(thin[flat], axis=1)) / _NEAR) ** 2)
    # What lies below a table is hidden by it; what is seen through a plane makes it none.
    lower = above < -2 * _INLIER
    crossing = thin[lower] * (height / (height - above[lower]))[:, None]
    through = _within(transform_points(lies, thin[flat])[:, :2], transform_points(lies, crossing)[:, :2]) / flat.sum()
    if through > _MOST_THROUGH:
        return 0.0
    return upright * area * nearness * (0.2 + min(things, 400) / 400) / (1.0 + 3.0 * through)


def _floors_doubted(scores: list[float], candidates: list[np.ndarray], thin: np.ndarray) -> list[float]:
    """Return the scores, divided by 4 for planes that lie as far below a level one as a floor below a table."""
    large = [
        plane for plane, score in zip(candidates, scores, strict=True)
        if score > 0 and (np.abs(thin @ plane[:3] + plane[3]) < _INLIER).sum() * _CELL**2 > _TABLE_AREA
    ]  # fmt: skip
    return [
        score / 4  # half is too little for an empty table before a floor that carries much
        if any(plane[:3] @ one[:3] > _SLANT[0] and plane[3] > one[3] + _TABLE_HEIGHT for one in large)
        else score
        for plane, score in zip(candidates, scores, strict=True)
    ]


def _walls(plane: np.ndarray, others: list[np.ndarray], thin: np.ndarray) -> np.ndarray:
    """Return the large planes (W, 4) at right angles to a plane."""
    walls = [
        other for other in others
        if abs(other[:3] @ plane[:3]) < _CROSSWISE
        and (np.abs(thin @ other[:3] + other[3]) < _INLIER).sum() * _CELL**2 > _WALL_AREA
    ]  # fmt: skip
    return np.array(walls).reshape(-1, 4)


def _cuts_slantwise(plane: np.ndarray, others: list[np.ndarray], thin: np.ndarray) -> bool:
    """Return whether a plane meets a larger one at a small angle: it is a slice of that and of what stands on it."""
    flat = thin[np.abs(thin @ plane[:3] + plane[3]) < _INLIER]
    larger = others[: next(index for index, other in enumerate(others) if other is plane)]
    return any(
        _SLANT[1] < other[:3] @ plane[:3] < _SLANT[0]
        and np.percentile(np.abs(flat @ other[:3] + other[3]), 10) < 2 * _INLIER
        for other in larger
    )


def _outline(flat: np.ndarray) -> tuple[shapely.Geometry, float]:
    """Return the convex outline of the largest connected part of a plane's points (P, 2), and its share of them."""
    place = ((flat - flat.min(axis=0)) / _GRID).astype(int)
    cells = np.zeros(place.max(axis=0) + 1, dtype=bool)
    cells[place[:, 0], place[:, 1]] = True
    parts, _ = ndimage.label(cells, np.ones((3, 3)))
    part = parts[place[:, 0], place[:, 1]]
    largest = part == np.bincount(part).argmax()
    return shapely.MultiPoint(flat[largest]).convex_hull, float(largest.mean())


def _within(flat: np.ndarray, crossing: np.ndarray) -> int:
    """Return how many places (Q, 2) lie where a plane's points (P, 2) are all around, or in a gap between them.

    Not in their convex outline: between a table and the stand of an arm one sees the floor, and along every edge.
    """
    corner = flat.min(axis=0) - (_GAP + 1) * _GRID
    size = ((flat.max(axis=0) - corner) / _GRID).astype(int) + _GAP + 2
    cells = np.zeros(size, dtype=bool)
    cells[tuple(((flat - corner) / _GRID).astype(int).T)] = True
    cells = ndimage.binary_erosion(ndimage.binary_closing(cells, np.ones((3, 3)), iterations=_GAP), np.ones((3, 3)))
    place = np.floor((crossing - corner) / _GRID).astype(int)
    place = place[((place >= 0) & (place < size)).all(axis=1)]
    return int(cells[tuple(place.T)].sum())


def _plane_in_words(plane: np.ndarray, thin: np.ndarray, up: np.ndarray | None) -> str:
    flat = np.abs(thin @ plane[:3] + plane[3]) < _INLIER
    lean = math.degrees(math.acos(float(np.clip(plane[:3] @ (IMAGE_UP if up is None else up), -1.0, 1.0))))
    which = "the picture's up" if up is None else "up"
    return (
        f"one of {flat.sum() * _CELL**2 * 1e4:.0f} cm2, {plane[3]:.2f} m from the camera, its normal {lean:.0f} "
        f"degrees from {which}"
    )


def _refined(plane: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Fit the least-squares plane of the points near it, repeatedly, with fewer and fewer outliers."""
    for reach in (2 * _INLIER, 1.5 * _INLIER, _INLIER):
        heights = points @ plane[:3] + plane[3]
        flat = points[np.abs(heights) < reach]
        spread = 1.48 * float(np.median(np.abs(flat @ plane[:3] + plane[3])))
        flat = points[np.abs(heights) < min(reach, max(3 * spread, 0.003))].astype(np.float64)
        center = flat.mean(axis=0)
        normal = np.linalg.eigh((flat - center).T @ (flat - center))[1][:, 0]
        plane = np.append(normal, -normal @ center)
        plane = plane if plane[3] > 0 else -plane
    return plane


def _level(plane: np.ndarray) -> np.ndarray:
    """Return level_from_camera (4, 4) of a plane (4,)."""
    up, height = plane[:3], plane[3]
    forward = np.array([0.0, 0.0, 1.0])
    # Looking straight down, forward is what is up in the picture.
    ahead = forward - (forward @ up) * up
    if np.linalg.norm(ahead) < 0.2:
        ahead = IMAGE_UP - (IMAGE_UP @ up) * up
    ahead /= np.linalg.norm(ahead)
    pose = np.eye(4)
    pose[:3, :3] = np.stack((ahead, np.cross(up, ahead), up))
    pose[2, 3] = height
    return pose

"""Find out in which frame a cloud lies when nothing says so, and bring it into a camera's optical frame.

An organised cloud shows its camera: each of its points lies on the ray of its pixel, from which the pose of the camera
follows (camera resectioning). An unorganised cloud is taken to have z up where a level surface carries what is in
it, and to have x forward where points lie behind its z axis; otherwise it is optical.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from agent.recordings.recording import DepthFrame
from structdiffusion.geometry import transform_points

_MOST_POINTS = 3000  # that decide on a pose; a picture has 300 times as many
_MOST_OFF = 1.5  # pixels, the median: a cloud whose points miss their pixels by more is not a pinhole camera's
_LEAST_POINTS = 50
_SAME_TURN = math.radians(1.0)  # between two optical frames that count as one; lenses are seldom known better
_SAME_PLACE = 0.02  # m, likewise
_BIN = 0.01  # m of height
_BAND = 3  # bins: a table that leans by one degree spreads over them
_TABLE_SHARE = 0.12  # of all points lie in the table's surface, at least
_SLICE = 0.05  # m above and below a level surface in which its slope shows
_LEVEL = math.tan(math.radians(5.0))  # an arm's frame and its table differ by less
_THINGS = (0.02, 0.30)  # m above a table's surface: what stands on it
_BEHIND = 0.02  # share of the points on the other side of z = 0 from which on the z axis cannot be the view
_VIEW = (-0.7, 0.8)  # m: where a camera is assumed, behind the middle of the table and above it
OPTICAL_FROM_BODY = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], dtype=float)


@dataclass(frozen=True)
class CloudFrame:
    """The camera of a cloud that was not in an optical frame.

    Attributes:
        cloud_from_camera: (4, 4) its optical frame in the cloud's.
        exact: whether the picture's own rays say so; otherwise the camera's place is assumed.
        note: what was found, a sentence.
    """

    cloud_from_camera: np.ndarray
    exact: bool
    note: str


def in_optical_frame(frame: DepthFrame) -> tuple[DepthFrame, str]:
    """Bring a cloud whose frame is not known into its camera's optical frame.

    Returns:
        The cloud, unorganised where its camera's place is assumed, and a note; the same and "" where it was optical.
    """
    found = frame_of_cloud(frame.points, frame.frame_id)
    if found is None:
        return frame, ""
    points, color = frame.points, frame.color
    if not found.exact:
        points, color = points.reshape(1, -1, 3), None if color is None else color.reshape(1, -1, 3)
    moved = transform_points(np.linalg.inv(found.cloud_from_camera), points.reshape(-1, 3).astype(float))
    return replace(frame, points=moved.reshape(points.shape).astype(np.float32), color=color), found.note


def frame_of_cloud(points: np.ndarray, frame_id: str = "") -> CloudFrame | None:
    """Return the camera of a cloud, or `None` where the cloud lies in its optical frame, as far as its points show.

    Args:
        points: (H, W, 3) metres; NaN where nothing was measured. An unorganised cloud has one row.
        frame_id: the name of its frame, for the note.
    """
    if np.isfinite(points).all(axis=-1).sum() < _LEAST_POINTS:
        return None
    named = f"in the frame {frame_id!r} " if frame_id else ""
    pose = camera_of_picture(points)
    if pose is not None:
        turn = math.acos(max(-1.0, min(1.0, (np.trace(pose[:3, :3]) - 1) / 2)))
        if turn < _SAME_TURN and np.linalg.norm(pose[:3, 3]) < _SAME_PLACE:
            return None
        x, y, z = pose[:3, 3]
        return CloudFrame(
            pose, True,
            f"the cloud {named}is not in the camera's optical frame: by its rows and columns, the camera stands at "
            f"x {x:.2f}, y {y:.2f}, z {z:.2f} in it",
        )  # fmt: skip
    flat = points[np.isfinite(points).all(axis=-1)].astype(float)
    height = table_height(flat)
    if height is not None:
        note = f"the cloud {named}was taken to have z up: a level surface at z {height:.2f} carries what is in it"
        return CloudFrame(_assumed_camera(flat, height), False, note)
    if np.mean(flat[:, 2] <= 0) > _BEHIND and np.mean(flat[:, 0] <= 0) <= _BEHIND:
        note = f"the cloud {named}was taken to have x forward and z up: points lie behind its z axis, and none behind x"
        return CloudFrame(np.linalg.inv(OPTICAL_FROM_BODY), True, note)
    return None


def camera_of_picture(points: np.ndarray) -> np.ndarray | None:
    """Return the pose (4, 4) of the pinhole camera that took an organised cloud (H, W, 3), in the cloud's frame.

    By the direct linear transform: Hartley and Zisserman, Multiple View Geometry, 7.1.

    Returns:
        The pose of the optical frame, or `None` where the cloud is not organised, or not by a pinhole camera.
    """
    if points.shape[0] < 2:
        return None
    rows, columns = np.nonzero(np.isfinite(points).all(axis=-1) & (np.abs(points).max(axis=-1) > 0))
    if len(rows) < _LEAST_POINTS:
        return None
    chosen = np.linspace(0, len(rows) - 1, min(_MOST_POINTS, len(rows))).astype(int)
    rows, columns = rows[chosen], columns[chosen]
    places = points[rows, columns].astype(float)
    pixels = np.stack((columns, rows), axis=1).astype(float)
    world, pixel = _normalising(places), _normalising(pixels)
    x, p = transform_points(world, places), pixels * pixel[0, 0] + pixel[:2, 2]
    ones, zeros = np.ones((len(x), 1)), np.zeros((len(x), 4))
    each = np.hstack((x, ones))
    equations = np.vstack((np.hstack((each, zeros, -p[:, :1] * each)), np.hstack((zeros, each, -p[:, 1:] * each))))
    values, vectors = np.linalg.eigh(equations.T @ equations)
    if values[1] < 1e-9 * values[-1]:
        return None  # all in one plane: many cameras would see it so
    projection = np.linalg.inv(pixel) @ vectors[:, 0].reshape(3, 4) @ world
    homogeneous = np.hstack((places, ones)) @ projection.T
    off = np.linalg.norm(homogeneous[:, :2] / homogeneous[:, 2:] - pixels, axis=1)
    if not np.median(off) < _MOST_OFF:
        return None
    return _pose_of(projection, np.median(places, axis=0))


def _normalising(values: np.ndarray) -> np.ndarray:
    """Return the similarity that brings points (N, D) to the origin, at a mean distance of sqrt(D)."""
    middle, count = values.mean(axis=0), values.shape[1]
    scale = math.sqrt(count) / max(float(np.linalg.norm(values - middle, axis=1).mean()), 1e-12)
    turned = np.eye(count + 1) * scale
    turned[:count, count], turned[count, count] = -scale * middle, 1.0
    return turned


def _pose_of(projection: np.ndarray, seen: np.ndarray) -> np.ndarray | None:
    """Return the camera's pose (4, 4) of a projection (3, 4); `seen` (3,) lies before it.

    The projection is K [R | -R c] up to a factor, with K upper triangular and positive on its diagonal.
    """
    left = projection[:, :3]
    if abs(np.linalg.det(left)) < 1e-12 * np.linalg.norm(left) ** 3:
        return None
    centre = -np.linalg.solve(left, projection[:, 3])
    flip = np.eye(3)[::-1]
    turned, upper = np.linalg.qr((flip @ left).T)  # the RQ decomposition by that of the reversed matrix
    rotation, calibration = flip @ turned.T, flip @ upper.T @ flip
    signs = np.sign(np.diag(calibration))
    rotation = rotation * signs[:, None]
    if rotation[2] @ (seen - centre) < 0:
        rotation = -rotation
    if np.linalg.det(rotation) < 0:
        return None  # a mirrored picture
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.T, centre
    return pose


def table_height(points: np.ndarray) -> float | None:
    """Return the height of the highest level surface that carries something, or `None`.

    A camera that looks straight down sees a level surface too; but there, what stands on it has smaller depths.

    Args:
        points: (P, 3) metres.
    """
    z = points[:, 2]
    low, high = np.percentile(z, (0.5, 99.5))
    if high - low < _BAND * _BIN:
        return None
    counts, edges = np.histogram(z, bins=np.arange(low, high + 2 * _BIN, _BIN))
    band = np.convolve(counts, np.ones(_BAND), mode="same")
    peaks = np.flatnonzero((band >= _TABLE_SHARE * len(z)) & (band >= np.maximum(np.roll(band, 1), np.roll(band, -1))))
    for peak in peaks[::-1]:
        height = float(np.median(z[np.abs(z - edges[peak] - _BIN / 2) < _BAND / 2 * _BIN]))
        above = int(np.sum((z > height + _THINGS[0]) & (z < height + _THINGS[1])))
        below = int(np.sum((z < height - _THINGS[0]) & (z > height - _THINGS[1])))
        if above > max(3 * below, 20) and _slope(points, height) < _LEVEL:
            return height
    return None


def _slope(points: np.ndarray, height: float) -> float:
    """Return how steep the surface about a height is: a slice of a steep surface looks level by its heights alone."""
    slice_ = points[np.abs(points[:, 2] - height) < _SLICE]
    design = np.column_stack((slice_[:, :2], np.ones(len(slice_))))
    kept = np.ones(len(slice_), dtype=bool)
    for _ in range(4):  # what stands on the surface is left out step by step
        if kept.sum() < 3:
            return math.inf
        plane = np.linalg.lstsq(design[kept], slice_[kept, 2], rcond=None)[0]
        off = np.abs(slice_[:, 2] - design @ plane)
        kept = off < max(_BIN, float(np.median(off)))
    return float(np.hypot(*plane[:2]))


def _assumed_camera(points: np.ndarray, height: float) -> np.ndarray:
    """Return a camera that looks from -x down to the middle of a table, in the frame of the points (P, 3), z up."""
    level = points[np.abs(points[:, 2] - height) < _BAND * _BIN]
    middle = np.append(np.median(level[:, :2], axis=0), height)
    place = middle + (_VIEW[0], 0.0, _VIEW[1])
    ahead = (middle - place) / np.linalg.norm(middle - place)
    right = np.array([0.0, -1.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack((right, np.cross(ahead, right), ahead))
    pose[:3, 3] = place
    return pose

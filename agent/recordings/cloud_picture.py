"""Give an unorganised cloud the rows and columns of the picture that it was made of.

Each point of a depth picture lies on the ray of its pixel, in whatever order a file lists the points: x / z and y / z
are multiples of one step, the inverse of the focal length. Where they are, the pixels follow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from agent.recordings.recording import DepthFrame

UNORGANISED = (
    "the cloud has no rows and columns, and its points lie on no camera's pixels: objects are told apart by shape and "
    "colour, without the segmentation network"
)
_LEAST_POINTS = 1000  # that decide on a lens
_SAMPLED = 20_000
_FIRST_STEPS = 16  # steps about the middle to which the first fit is limited; it doubles until it holds all
_MOST_OFF, _SHARE = 0.2, 95  # steps, and percent of the points that lie nearer to a pixel; by chance, 40 percent do
_MOST_EMPTY = 8  # pixels for each point: less is a few points of a picture, whose neighbours are not there
_SQUARE = 1.1  # at most, the ratio of a pixel's sides


def as_picture(frame: DepthFrame) -> tuple[DepthFrame, str]:
    """Return an unorganised cloud as the picture that it was made of, and a note.

    Args:
        frame: in the camera's optical frame.

    Returns:
        The cloud with rows, columns and the lens (3, 3); the same and "" where it is organised, or where its points
        lie on no camera's pixels.
    """
    points = frame.points[0].astype(np.float64)
    own = np.flatnonzero(np.isfinite(points).all(axis=1) & (points[:, 2] > 0.0))
    if frame.organised or len(own) < _LEAST_POINTS:
        return frame, ""
    tangents = points[own, :2] / points[own, 2:]
    sample = tangents[np.linspace(0, len(own) - 1, min(_SAMPLED, len(own))).astype(int)]
    step = float(np.median(cKDTree(tangents).query(sample, k=2)[0][:, 1]))
    axes = [_pixels(sample[:, axis], step) for axis in (0, 1)]
    if axes[0] is None or axes[1] is None:
        return frame, ""
    starts, steps = np.transpose((axes[0], axes[1]))
    if steps.max() > _SQUARE * steps.min():
        return frame, ""
    pixels = np.rint((tangents - starts) / steps).astype(np.int64)
    first = pixels.min(axis=0)
    width, height = (pixels.max(axis=0) - first + 1).tolist()
    if height < 2 or width * height > _MOST_EMPTY * len(own):
        return frame, ""
    # Of two points in one pixel the nearer one is kept, which hides the other.
    order = np.argsort(-points[own, 2], kind="stable")
    columns, rows = (pixels - first)[order].T
    picture = np.full((height, width, 3), np.nan, np.float32)
    picture[rows, columns] = frame.points[0, own[order]]
    color = None
    if frame.color is not None:
        color = np.zeros((height, width, 3), np.uint8)
        color[rows, columns] = frame.color[0, own[order]]
    middle = -starts / steps - first
    lens = np.array([[1.0 / steps[0], 0.0, middle[0]], [0.0, 1.0 / steps[1], middle[1]], [0.0, 0.0, 1.0]])
    note = (
        f"the cloud has no rows and columns; by its points, it is a picture of {width} x {height} pixels with a focal "
        f"length of {1.0 / steps[0]:.0f} pixels"
    )
    return replace(frame, points=picture, color=color, intrinsics=lens), note


def _pixels(values: np.ndarray, step: float) -> tuple[float, float] | None:
    """Return the start and the step of the numbers of which values (P,) are multiples; `None` where they are of none.

    Args:
        values: x / z or y / z.
        step: nearly theirs; a small error grows with the distance from the middle, so that the fit widens by and by.
    """
    if not step > 0.0:
        return None
    start, reach = float(np.median(values)), _FIRST_STEPS * step
    farthest = float(np.abs(values - start).max())
    anchor = start
    while True:
        near = values[np.abs(values - anchor) <= reach]
        numbers = np.rint((near - start) / step)
        if np.ptp(numbers) < 2:
            return None
        step, start = np.polyfit(numbers, near, 1).tolist()
        if reach >= farthest:
            break
        reach *= 2.0
    numbers = (values - start) / step
    off = float(np.percentile(np.abs(numbers - np.rint(numbers)), _SHARE))
    return (start, step) if off < _MOST_OFF else None

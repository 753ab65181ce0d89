"""Decode ROS messages into arrays: clouds, camera infos, stamps; every length is checked before it is used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from textwrap import shorten
from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.byte_order import note_of
from agent.recordings.cloud_colors import COLOR_FIELDS, colors_of
from agent.recordings.sizes import check_points

CLOUD = "sensor_msgs/msg/PointCloud2"
IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
INFO = "sensor_msgs/msg/CameraInfo"
JOINTS = "sensor_msgs/msg/JointState"
ANGLES = "kinova_msgs/msg/JointAngles"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")

_FIELD_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}  # of sensor_msgs/PointField
FARTHEST = 100.0  # m; beyond it nothing of a table is measured, and some drivers write 1e10 for "nothing"
_MOST_PIXELS = 1e5  # of a focal length, and from a picture's corner to its middle
_SAME_RATIO = 0.02  # by which the ratio of a picture's sides may differ from the lens's
_SAME_MIDDLE = 0.02  # of a region's side: the middles of a lens's two matrices differ by less
_CLOCKS_APART = 5e9  # ns; a stamp that is further from the time of recording is of another clock


def frame_name(name: str) -> str:
    """Return a frame without the leading slash that it had before tf2."""
    return name.strip().lstrip("/")


def stamp(header: Any, recorded: int) -> int:
    """Return when something was measured, nanoseconds: its stamp, or the time of recording if the stamp is of
    another clock.
    """
    stamped = header.stamp.sec * 10**9 + header.stamp.nanosec
    return stamped if abs(stamped - recorded) < _CLOCKS_APART else recorded


def stored_cloud(message: Any) -> tuple[np.ndarray, np.ndarray | None, str]:
    """Return points (H, W, 3) float32 of a PointCloud2 in its own unit, colours (H, W, 3) uint8 or `None`, and what was
    corrected, or "".

    Raises:
        BadInput: if the message contradicts itself, or has no x, y and z.
    """
    height, width, step = message.height, message.width, message.point_step
    if height == 0 or width == 0:
        raise BadInput(f"a cloud of {width} x {height} points has none")
    row_step = message.row_step if height > 1 and message.row_step else width * step
    needed = (height - 1) * row_step + width * step
    if len(message.data) < needed or row_step < width * step:
        raise BadInput(
            f"a cloud of {width} x {height} points of {step} bytes, {row_step} a row, needs {needed} bytes "
            f"and has {len(message.data)}"
        )
    check_points(height * width, "a cloud")
    order, other = (">", "<") if message.is_bigendian else ("<", ">")
    kinds: dict[str, tuple[str, int]] = {}
    for field in message.fields:
        kind = _FIELD_TYPES.get(field.datatype)
        if kind is not None and field.offset + np.dtype(kind).itemsize <= step:
            kinds.setdefault(field.name.lower(), (order + kind, field.offset))
    missing = [axis for axis in "xyz" if axis not in kinds]
    if missing:
        named = shorten(", ".join(field.name for field in message.fields[:20]) or "none", 300, placeholder=" ...")
        raise BadInput(f"a cloud has no usable field {' and '.join(missing)}; its fields: {named}")

    def values(name: str) -> np.ndarray:
        """Return a field as a view (H, W) of the message."""
        kind, offset = kinds[name]
        dtype = np.dtype({"names": ["it"], "formats": [kind], "offsets": [offset], "itemsize": step})
        return np.ndarray((height, width), dtype, np.ascontiguousarray(message.data), 0, (row_step, step))["it"]

    note = note_of(values("x"), bool(message.is_bigendian))
    if note:
        order, kinds = other, {name: (other + kind[1:], offset) for name, (kind, offset) in kinds.items()}
    points = np.empty((height, width, 3), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for column, axis in enumerate("xyz"):
            points[..., column] = values(axis)
    colored = {name: values(name) for name in kinds.keys() & COLOR_FIELDS}
    return points, colors_of(colored, (height, width)), note


def without_nothing(points: np.ndarray) -> np.ndarray:
    """Return points (H, W, 3) with NaN for invalid ones: infinite, far beyond any table, or at the camera itself."""
    with np.errstate(invalid="ignore", over="ignore"):
        good = (np.abs(points) < FARTHEST).all(axis=-1) & (points != 0).any(axis=-1)
    points[~good] = np.nan
    return points


@dataclass(frozen=True)
class View:
    """A part of the whole picture of a camera.

    Attributes:
        x, y, width, height: the region, pixels of the whole picture.
        binning: how many of its columns and rows are joined to one pixel.
    """

    x: int
    y: int
    width: int
    height: int
    binning: tuple[int, int] = (1, 1)

    @property
    def size(self) -> tuple[int, int]:
        """Return the columns and rows of the picture."""
        return max(1, self.width // self.binning[0]), max(1, self.height // self.binning[1])


def views_of(message: Any) -> tuple[View, ...]:
    """Return the pictures that a CameraInfo may be about, the stated one first: the region of interest and the binning,
    either of them alone, and the whole picture; none if it states neither.
    """
    roi, width, height = getattr(message, "roi", None), message.width, message.height
    binning = max(1, getattr(message, "binning_x", 1)), max(1, getattr(message, "binning_y", 1))
    whole = region = View(0, 0, width, height)
    if roi is not None and roi.width and roi.height:
        region = View(roi.x_offset, roi.y_offset, roi.width, roi.height)
    if not (width and height) or (binning == (1, 1) and region == whole):
        return ()
    return tuple(dict.fromkeys((replace(region, binning=binning), region, replace(whole, binning=binning), whole)))


def _is_cut_out(matrix: np.ndarray, other: np.ndarray, region: View, size: tuple[int, int]) -> bool:
    """Return whether a matrix is already that of the region, which some drivers write: its middle is then outside of
    the region if that is cut out once more, or it is that of the message's other matrix with the region cut out, or the
    message's size (columns, rows) is the region's and the middle of the region is nearer than that of a
    region cut out once more.
    """
    shift, middle = np.array((region.x, region.y)), matrix[:2, 2]
    if not shift.any():
        return False
    apart = np.abs(middle + shift - other[:2, 2]).max()
    if _is_lens(other) and apart < _SAME_MIDDLE * max(region.width, region.height):
        return True
    if (region.width, region.height) == size:  # the stated size is the region's own
        half = np.array((region.width, region.height)) / 2
        return bool(np.linalg.norm(middle - half) < np.linalg.norm(middle - shift - half))
    return not _inside(middle - shift, region) and _inside(middle, region)


def _inside(middle: np.ndarray, region: View) -> bool:
    return bool(((middle > 0) & (middle < (region.width, region.height))).all())


def _resized(across: float, down: float) -> np.ndarray:
    """Return the matrix (3, 3) from the pixels of a picture to those of the same picture in another size."""
    half = np.array(((1.0, 0, 0.5), (0, 1, 0.5), (0, 0, 1)))  # from a pixel's middle to the picture's corner
    return np.linalg.inv(half) @ np.diag((across, down, 1.0)) @ half


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"


@dataclass(frozen=True)
class Lens:
    """The lens that a CameraInfo describes.

    Attributes:
        matrix: (3, 3) of the pinhole camera, pixels; pixel centres lie at whole numbers, as in ROS.
        distortion: the coefficients k1 k2 p1 p2 k3 k4 k5 k6; all zero for a rectified picture.
        width, height: of the picture, pixels.
        frame: the optical frame.
        note: a remark on ignored or adapted content, or "".
        views: the pictures that it may hold for; the matrix is that of the whole one.
    """

    matrix: np.ndarray
    distortion: np.ndarray
    width: int
    height: int
    frame: str
    note: str = ""
    views: tuple[View, ...] = ()

    def scaled(self, width: int, height: int) -> Lens:
        """Return the lens for a picture of a size: of the region and the binning that it states if they agree with
        the size, of the whole picture otherwise; scaled where the sides have the same ratio.

        Raises:
            BadInput: if the sides have another ratio.
        """
        if not (self.width and self.height) or not self.views and (width, height) == (self.width, self.height):
            return self
        views = self.views or (View(0, 0, self.width, self.height),)
        fitting = next((view for view in views if view.size == (width, height)), None)
        if fitting is not None:
            return replace(self._of(fitting), note=self._noted(self._contradiction(width, height)))
        for view in views:
            across, down = width / view.size[0], height / view.size[1]
            if abs(across / down - 1) <= _SAME_RATIO:
                told = f"the CameraInfo for {_by(view.size)} pixels was scaled to the picture of {_by((width, height))}"
                matrix = _resized(across, down) @ self._of(view).matrix
                return replace(self, matrix=matrix, width=width, height=height, note=self._noted(told), views=())
        sizes = " or ".join(dict.fromkeys(_by(view.size) for view in views))
        raise BadInput(f"a CameraInfo for {sizes} pixels does not fit a picture of {_by((width, height))}")

    def _of(self, view: View) -> Lens:
        """Return the lens of a view, for which its region is cut out and its pixels are joined."""
        cut = np.array(((1.0, 0, -view.x), (0, 1, -view.y), (0, 0, 1)))
        matrix = _resized(1 / view.binning[0], 1 / view.binning[1]) @ cut @ self.matrix
        return replace(self, matrix=matrix, width=view.size[0], height=view.size[1], views=())

    def _noted(self, told: str) -> str:
        return "; ".join(filter(None, (self.note, told)))

    def _contradiction(self, width: int, height: int) -> str:
        """Say so where the picture has not the size that the stated region and binning would give."""
        if self.views and self.views[0].size != (width, height):
            return (
                f"the CameraInfo's region and binning give a picture of {_by(self.views[0].size)} pixels, but it has "
                f"{_by((width, height))}"
            )
        return ""

    def rays(self, width: int, height: int) -> np.ndarray:
        """Return (H, W, 2): x / z and y / z of what each pixel shows."""
        fx, fy, cx, cy = self.matrix[0, 0], self.matrix[1, 1], self.matrix[0, 2], self.matrix[1, 2]
        seen = np.stack(np.meshgrid((np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy), axis=-1)
        if not self.distortion.any():
            return seen.astype(np.float32)
        rays = seen.copy()
        with np.errstate(all="ignore"):  # what no lens can show becomes infinite
            for _ in range(10):  # the inverse has no closed form; this halves the error of any usual lens each time
                factor, shift = self._bent(rays)
                rays = (seen - shift) / factor
            return rays.astype(np.float32)

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Return (..., 2): the column and row at which points (..., 3) of the optical frame appear; NaN behind the
        camera."""
        with np.errstate(all="ignore"):
            rays = np.where(points[..., 2:] > 0, points[..., :2] / points[..., 2:], np.nan)
            factor, shift = self._bent(rays)
            return (rays * factor + shift) * self.matrix[(0, 1), (0, 1)] + self.matrix[:2, 2]

    def _bent(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Apply the distortion to rays (..., 2): ROS's "plumb_bob" and "rational_polynomial"."""
        k1, k2, p1, p2, k3, k4, k5, k6 = self.distortion
        x, y = rays[..., 0], rays[..., 1]
        square = x * x + y * y
        factor = (1 + square * (k1 + square * (k2 + square * k3))) / (1 + square * (k4 + square * (k5 + square * k6)))
        shift = (2 * p1 * x * y + p2 * (square + 2 * x * x), p1 * (square + 2 * y * y) + 2 * p2 * x * y)
        return factor[..., None], np.stack(shift, axis=-1)


def lens_of(message: Any, rectified: bool) -> Lens:
    """Return the lens that a CameraInfo describes.

    Args:
        message: of ROS 1 (its matrices have capital letters) or ROS 2.
        rectified: whether it is wanted for the rectified picture.

    Raises:
        BadInput: if it has no focal length.
    """
    raw, of_rectified, bent = (
        np.asarray(getattr(message, name, getattr(message, name.upper(), ())), dtype=float) for name in "kpd"
    )
    raw_matrix, projection = raw.reshape(3, 3), of_rectified.reshape(3, 4)[:, :3]
    matrix = raw_matrix
    use_projection = _is_lens(projection) and (rectified or not _is_lens(matrix))
    if use_projection:
        matrix = projection
    if not _is_lens(matrix):
        raise BadInput(f"a CameraInfo has no focal length: its K is {raw.tolist()}")
    distortion, note = np.zeros(8), ""
    if not (use_projection or rectified) and bent.any():
        if message.distortion_model in ("plumb_bob", "rational_polynomial") and np.isfinite(bent).all():
            distortion[: min(8, len(bent))] = bent[:8]
        else:
            note = f"the lens's distortion ({message.distortion_model or 'no model named'}) was left out"
    views, size = views_of(message), (message.width, message.height)
    if views and _is_cut_out(matrix, projection if matrix is raw_matrix else raw_matrix, views[0], size):
        matrix = np.array(((1.0, 0, views[0].x), (0, 1, views[0].y), (0, 0, 1))) @ matrix  # as of the whole picture
    return Lens(
        matrix.copy(), distortion, message.width, message.height, frame_name(message.header.frame_id), note, views
    )


def _is_lens(matrix: np.ndarray) -> bool:
    """Return whether (3, 3) has two valid focal lengths."""
    focal, middle = matrix[(0, 1), (0, 1)], matrix[:2, 2]
    return bool(((focal > 1) & (focal < _MOST_PIXELS) & (np.abs(middle) < _MOST_PIXELS)).all())

"""Decode ROS messages into arrays: clouds, camera infos, stamps; every length is checked before it is used."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import shorten
from typing import Any

import numpy as np

from agent.errors import BadInput
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


def cloud_points(message: Any) -> tuple[np.ndarray, np.ndarray | None]:
    """Return points and colours of a PointCloud2: (H, W, 3) float32 with NaN where there is none, and uint8 RGB or
    `None`.

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
    order = ">" if message.is_bigendian else "<"
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

    points = np.empty((height, width, 3), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for column, axis in enumerate("xyz"):
            points[..., column] = values(axis)
    colored = {name: values(name) for name in kinds.keys() & COLOR_FIELDS}
    return without_nothing(points), colors_of(colored, (height, width))


def without_nothing(points: np.ndarray) -> np.ndarray:
    """Return points (H, W, 3) with NaN for invalid ones: infinite, far beyond any table, or at the camera itself."""
    with np.errstate(invalid="ignore", over="ignore"):
        good = (np.abs(points) < FARTHEST).all(axis=-1) & (points != 0).any(axis=-1)
    points[~good] = np.nan
    return points


@dataclass(frozen=True)
class Lens:
    """The lens that a CameraInfo describes.

    Attributes:
        matrix: (3, 3) of the pinhole camera, pixels; pixel centres lie at whole numbers, as in ROS.
        distortion: the coefficients k1 k2 p1 p2 k3 k4 k5 k6; all zero for a rectified picture.
        width, height: of the picture, pixels.
        frame: the optical frame.
        note: a remark on ignored content, or "".
    """

    matrix: np.ndarray
    distortion: np.ndarray
    width: int
    height: int
    frame: str
    note: str = ""

    def scaled(self, width: int, height: int) -> Lens:
        """Return the same lens for a picture of another size that shows the same view.

        Raises:
            BadInput: if the sides have another ratio.
        """
        if (width, height) == (self.width, self.height) or not (self.width and self.height):
            return self
        across, down = width / self.width, height / self.height
        if abs(across / down - 1) > 0.02:
            raise BadInput(
                f"a CameraInfo for {self.width} x {self.height} pixels does not fit a picture of {width} x {height}"
            )
        half = np.array(((1.0, 0, 0.5), (0, 1, 0.5), (0, 0, 1)))  # from a pixel's middle to the picture's corner
        matrix = np.linalg.inv(half) @ np.diag((across, down, 1.0)) @ half @ self.matrix
        return Lens(matrix, self.distortion, width, height, self.frame, self.note)

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
    matrix, projection = raw.reshape(3, 3), of_rectified.reshape(3, 4)[:, :3]
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
    return Lens(
        matrix.copy(), distortion, message.width, message.height, frame_name(message.header.frame_id), note
    )


def _is_lens(matrix: np.ndarray) -> bool:
    """Return whether (3, 3) has two valid focal lengths."""
    focal, middle = matrix[(0, 1), (0, 1)], matrix[:2, 2]
    return bool(((focal > 1) & (focal < _MOST_PIXELS) & (np.abs(middle) < _MOST_PIXELS)).all())

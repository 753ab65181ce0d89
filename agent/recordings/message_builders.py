"""Build the messages of a session from arrays: pictures, lenses, poses, joints and transforms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.recordings.bag_writer import BagWriter
from structdiffusion.geometry import quaternion_from_matrix

_MILLIMETRE = 0.001


def color_message(writer: BagWriter, color: np.ndarray, seconds: float, frame: str) -> Any:
    """Return a picture (H, W, 3) uint8 RGB as sensor_msgs/Image, rgb8."""
    return _image(writer, np.ascontiguousarray(color, dtype=np.uint8), "rgb8", seconds, frame)


def depth_message(writer: BagWriter, depth: np.ndarray, seconds: float, frame: str) -> Any:
    """Return depth (H, W), metres, NaN where nothing was measured, as sensor_msgs/Image: 16UC1, mm, 0 where nothing
    was.

    Depths beyond 65.535 m count as not measured.
    """
    rounded = np.rint(np.nan_to_num(depth / _MILLIMETRE, nan=0.0))
    pixels = np.where((rounded > 0) & (rounded <= np.iinfo(np.uint16).max), rounded, 0).astype("<u2")
    return _image(writer, pixels, "16UC1", seconds, frame)


def fine_depth_message(writer: BagWriter, depth: np.ndarray, seconds: float, frame: str) -> Any:
    """Return depth (H, W) as `depth_message` does, but as 32FC1: metres, NaN where nothing was measured."""
    return _image(writer, np.ascontiguousarray(depth, dtype="<f4"), "32FC1", seconds, frame)


def _image(writer: BagWriter, pixels: np.ndarray, encoding: str, seconds: float, frame: str) -> Any:
    height, width = pixels.shape[:2]
    data = pixels.view(np.uint8).ravel()
    return writer.message(
        "sensor_msgs/msg/Image", header=writer.header(seconds, frame), height=height, width=width, encoding=encoding,
        is_bigendian=0, step=data.size // height, data=data,
    )  # fmt: skip


def cloud_message(writer: BagWriter, points: np.ndarray, color: np.ndarray | None, seconds: float, frame: str) -> Any:
    """Return points (H, W, 3), metres, NaN where nothing was measured, as sensor_msgs/PointCloud2: x, y, z, and rgb if
    known.

    Args:
        color: (H, W, 3) uint8 RGB, or `None`.
    """
    height, width = points.shape[:2]
    names = ("x", "y", "z") if color is None else ("x", "y", "z", "rgb")
    data = np.empty((height, width, len(names)), dtype="<f4")
    data[..., :3] = points
    if color is not None:
        red, green, blue = np.moveaxis(color.astype("<u4"), -1, 0)
        data[..., 3] = (red << 16 | green << 8 | blue).view("<f4")
    fields = [
        writer.message("sensor_msgs/msg/PointField", name=name, offset=4 * place, datatype=7, count=1)  # 7 is float32
        for place, name in enumerate(names)
    ]
    step = 4 * len(names)
    return writer.message(
        "sensor_msgs/msg/PointCloud2", header=writer.header(seconds, frame), height=height, width=width, fields=fields,
        is_bigendian=False, point_step=step, row_step=step * width, data=data.view(np.uint8).ravel(), is_dense=False,
    )  # fmt: skip


def lens_message(writer: BagWriter, intrinsics: np.ndarray, size: tuple[int, int], seconds: float, frame: str) -> Any:
    """Return a pinhole lens without distortion as sensor_msgs/CameraInfo.

    Args:
        intrinsics: (3, 3), pixels; pixel centres lie at whole numbers, as everywhere in ROS.
        size: height and width of the pictures, pixels.
    """
    k = np.asarray(intrinsics, dtype=np.float64)
    projection = np.hstack((k, np.zeros((3, 1))))
    matrices = {"d": np.zeros(5), "k": k.ravel(), "r": np.eye(3).ravel(), "p": projection.ravel()}
    if writer.ros1:
        matrices = {name.upper(): matrix for name, matrix in matrices.items()}
    whole = writer.message(
        "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return writer.message(
        "sensor_msgs/msg/CameraInfo", header=writer.header(seconds, frame), height=size[0], width=size[1],
        distortion_model="plumb_bob", **matrices, binning_x=0, binning_y=0, roi=whole,
    )  # fmt: skip


def transforms_message(writer: BagWriter, transforms: Mapping[tuple[str, str], np.ndarray], seconds: float) -> Any:
    """Return transforms as tf2_msgs/TFMessage: (parent, child) -> parent_from_child (4, 4)."""
    stamped = [
        writer.message(
            "geometry_msgs/msg/TransformStamped",
            header=writer.header(seconds, parent),
            child_frame_id=child,
            transform=writer.message(
                "geometry_msgs/msg/Transform",
                translation=writer.message("geometry_msgs/msg/Vector3", **_position(pose)),
                rotation=_quaternion(writer, pose),
            ),
        )
        for (parent, child), pose in transforms.items()
    ]
    return writer.message("tf2_msgs/msg/TFMessage", transforms=stamped)


def pose_message(writer: BagWriter, pose: np.ndarray, seconds: float, frame: str) -> Any:
    """Return a pose (4, 4) in a frame as geometry_msgs/PoseStamped."""
    here = writer.message(
        "geometry_msgs/msg/Pose",
        position=writer.message("geometry_msgs/msg/Point", **_position(pose)),
        orientation=_quaternion(writer, pose),
    )
    return writer.message("geometry_msgs/msg/PoseStamped", header=writer.header(seconds, frame), pose=here)


def joints_message(writer: BagWriter, names: Sequence[str], angles: Sequence[float], seconds: float) -> Any:
    """Return joints at rest, radians, as sensor_msgs/JointState of the arm's driver, which has no frame."""
    return writer.message(
        "sensor_msgs/msg/JointState", header=writer.header(seconds), name=list(names),
        position=np.asarray(angles, dtype=np.float64), velocity=np.zeros(len(names)), effort=np.zeros(0),
    )  # fmt: skip


def _position(pose: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", pose[:3, 3].tolist(), strict=True))


def _quaternion(writer: BagWriter, pose: np.ndarray) -> Any:
    turned = quaternion_from_matrix(pose).tolist()
    return writer.message("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", turned, strict=True)))

"""Convert pictures and clouds from disk to the bag of a camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from agent.recordings.bag_writer import BagWriter
from agent.recordings.message_builders import (
    cloud_message,
    color_message,
    depth_message,
    fine_depth_message,
    lens_message,
)
from agent.recordings.rgbd_folder import RgbdPicture

_OPTICAL = "camera_color_optical_frame"
_WHOLE = 0.01  # mm; single precision is that exact up to 100 m


def write_rgbd(picture: RgbdPicture, out: Path, force: bool = False) -> None:
    """Write a bag with one measurement of a camera, with the topic names of a RealSense.

    Args:
        picture: the measurement; depths that are not whole millimetres are kept in metres.
        out: the new bag, as for `BagWriter`.
        force: overwrite a bag that is there.

    Raises:
        UsageError: for a path that cannot be a new bag.
        BadInput: if nothing can be written.
    """
    depth, size = picture.depth, picture.depth.shape
    in_millimetres = depth[np.isfinite(depth)] * 1000.0
    is_whole = bool((np.abs(in_millimetres - np.rint(in_millimetres)) < _WHOLE).all())
    with BagWriter(out, force) as writer:
        message = depth_message if is_whole else fine_depth_message
        images = {"aligned_depth_to_color": message(writer, depth, 0.0, _OPTICAL)}
        if picture.color is not None:
            images["color"] = color_message(writer, picture.color, 0.0, _OPTICAL)
        for name, image in images.items():
            writer.write(f"/camera/{name}/image_raw", image, 0.0)
            lens = lens_message(writer, picture.intrinsics, size, 0.0, _OPTICAL)
            writer.write(f"/camera/{name}/camera_info", lens, 0.0)


def write_cloud(points: np.ndarray, color: np.ndarray | None, out: Path, force: bool = False) -> None:
    """Write a bag with one cloud in its own frame, with the topic names of a RealSense.

    Args:
        points: (H, W, 3) the camera's optical frame, metres; NaN where nothing was measured.
        color: (H, W, 3) uint8 RGB, or `None`.
        out, force: as `write_rgbd`.

    Raises: as `write_rgbd`.
    """
    with BagWriter(out, force) as writer:
        writer.write("/camera/depth/color/points", cloud_message(writer, points, color, 0.0, _OPTICAL), 0.0)

"""Pictures from disk as the bag of a camera."""

from __future__ import annotations

from pathlib import Path

from agent.bags.composing import color_message, depth_message, lens_message
from agent.bags.rgbd import RgbdPicture
from agent.bags.writing import BagWriter

_OPTICAL = "camera_color_optical_frame"


def write_rgbd(picture: RgbdPicture, out: Path, force: bool = False) -> None:
    """Writes a bag with one look of a camera, under a RealSense's names.

    Args:
        picture: what it saw.
        out: the new bag, as `BagWriter` takes it.
        force: overwrite a bag that is there.

    Raises:
        UsageError: for a path that cannot be a new bag.
        BadInput: where nothing can be written.
    """
    size = picture.depth.shape
    with BagWriter(out, force) as writer:
        images = {"aligned_depth_to_color": depth_message(writer, picture.depth, 0.0, _OPTICAL)}
        if picture.color is not None:
            images["color"] = color_message(writer, picture.color, 0.0, _OPTICAL)
        for name, image in images.items():
            writer.write(f"/camera/{name}/image_raw", image, 0.0)
            lens = lens_message(writer, picture.intrinsics, size, 0.0, _OPTICAL)
            writer.write(f"/camera/{name}/camera_info", lens, 0.0)

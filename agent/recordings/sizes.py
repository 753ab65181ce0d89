"""Check how many points and pixels data claim before any array is made for them."""

from __future__ import annotations

import struct

from agent.errors import BadInput
from structdiffusion.limits import (
    BAG_POINT_FIELDS,
    BAG_SMALL_MESSAGE_BYTES,
    BAG_TRANSFORMS_BYTES,
    MOST_PIXELS,
    MOST_POINTS,
)

_CLOUD = "sensor_msgs/msg/PointCloud2"
_LARGE = (_CLOUD, "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")  # their bytes stay bytes
_TRANSFORMS = "tf2_msgs/msg/TFMessage"


def check_points(count: int, what: str = "it") -> None:
    """Refuse a cloud without points, or with too many.

    Raises:
        BadInput: if their number is not legal.
    """
    if count <= 0:
        raise BadInput(f"{what} is empty")
    if count > MOST_POINTS:
        raise BadInput(
            f"{what} claims {count} points; at most {MOST_POINTS} are read: thin it, for example to one point in each "
            "cube of 2 mm"
        )


def check_pixels(width: int, height: int, what: str = "it") -> None:
    """Refuse a picture without pixels, or with too many.

    Raises:
        BadInput: if its size is not legal.
    """
    if width <= 0 or height <= 0 or width * height > MOST_PIXELS:
        raise BadInput(f"{what} claims {width} x {height} pixels; from 1 to {MOST_PIXELS} in all are read")


def check_message(kind: str, raw: bytes, ros1: bool) -> None:
    """Refuse a message from which far more objects would be made than any driver sends.

    Args:
        kind: its type.
        raw: its bytes.
        ros1: whether they are packed as in ROS 1.

    Raises:
        BadInput: if so.
    """
    most = BAG_TRANSFORMS_BYTES if kind == _TRANSFORMS else BAG_SMALL_MESSAGE_BYTES
    if kind not in _LARGE and len(raw) > most:
        raise BadInput(f"a message of the type {kind} has {len(raw)} bytes; at most {most} are read")
    if kind == _CLOUD and (fields := _claimed_fields(raw, ros1)) > BAG_POINT_FIELDS:
        raise BadInput(f"a cloud claims {fields} fields a point; at most {BAG_POINT_FIELDS} are read")


def _claimed_fields(raw: bytes, ros1: bool) -> int:
    """Return the number of fields that a PointCloud2 claims; 0 for one that is cut short before it."""
    frame = 12  # behind the stamp and, before that, a count (ROS 1) or the encapsulation
    order = ">" if not ros1 and raw[1:2] == b"\0" else "<"
    try:
        (length,) = struct.unpack_from(f"{order}I", raw, frame)
        rest = frame + 4 + length
        if not ros1:  # numbers stand at multiples of their size, counted behind the four bytes of the encapsulation
            rest += -rest % 4
        return struct.unpack_from(f"{order}I", raw, rest + 8)[0]
    except struct.error:
        return 0

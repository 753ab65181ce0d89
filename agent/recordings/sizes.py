"""Check how many points and pixels data claim before any array is made for them."""

from __future__ import annotations

from agent.errors import BadInput
from structdiffusion.limits import MOST_PIXELS, MOST_POINTS


def check_points(count: int) -> None:
    """Refuse a cloud without points, or with too many.

    Raises:
        BadInput: the message does not name the cloud.
    """
    if count <= 0:
        raise BadInput("it is empty")
    if count > MOST_POINTS:
        raise BadInput(
            f"it claims {count} points; at most {MOST_POINTS} are read: thin it, for example to one point in each cube "
            "of 2 mm"
        )


def check_pixels(width: int, height: int, what: str = "a picture") -> None:
    """Refuse a picture without pixels, or with too many.

    Raises:
        BadInput: if its size is not legal.
    """
    if width <= 0 or height <= 0:
        raise BadInput(f"{what} of {width} x {height} pixels has none")
    if width * height > MOST_PIXELS:
        raise BadInput(f"{what} claims {width} x {height} pixels; at most {MOST_PIXELS} are read")

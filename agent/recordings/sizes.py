"""Check how many points and pixels data claim before any array is made for them."""

from __future__ import annotations

from agent.errors import BadInput
from structdiffusion.limits import MOST_PIXELS, MOST_POINTS


def check_points(count: int, what: str = "it") -> None:
    """Refuse a cloud without points, or with too many.

    Raises:
        BadInput: if their number is not legal.
    """
    if count <= 0:
        raise BadInput(f"{what} is empty")
    if count > MOST_POINTS:
        raise BadInput(
            f"{what} claims {count} points; at most {MOST_POINTS} are read: thin it, for example to one point in each cube "
            "of 2 mm"
        )


def check_pixels(width: int, height: int, what: str = "it") -> None:
    """Refuse a picture without pixels, or with too many.

    Raises:
        BadInput: if its size is not legal.
    """
    if width <= 0 or height <= 0 or width * height > MOST_PIXELS:
        raise BadInput(f"{what} claims {width} x {height} pixels; from 1 to {MOST_PIXELS} in all are read")

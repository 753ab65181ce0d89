"""The words and numbers in which a run is told, shared by the terminal and the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def number(value: float | None, digits: int = 1) -> str:
    """A number for people; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    return f"{value:.{digits}f}"


def duration(seconds: float | None) -> str:
    """Seconds for people, such as "0.4 s"."""
    return f"{number(seconds, 1)} s"


def slot_label(slot: str) -> str:
    """A slot's name without underscores."""
    return slot.replace("_", " ")


def place(position: Any) -> str:
    """A position in the world frame (metres) in words: "52 cm ahead, 10 cm to the left"."""
    x, y = round(100 * position[0]), round(100 * position[1])
    side = "straight ahead" if y == 0 else f"{abs(y)} cm to the {'left' if y > 0 else 'right'}"
    return f"{x} cm ahead, {side}" if y else f"{x} cm {side}"


def arm_sentence(told: Mapping[str, Any]) -> str:
    """One sentence for an event of the arm (its JSON form)."""
    raise_kind = told["kind"]
    return raise_kind.replace("_", " ")

"""What a picture of the table from above shows of each object, from what was told of a run.

Made from the JSON form of events, so that a recorded run looks as it did. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.colors import FAINT, RGB, color_of

_DOT = 0.02  # m: the side of an object whose cloud spans no area
_TAKING_PART = string.digits[1:] + string.ascii_uppercase
_STAYING = string.ascii_lowercase


@dataclass(frozen=True)
class Marker:
    """One object as it is drawn.

    Attributes:
        letter: the character that stands on it.
        label: its name.
        outline: (K, 2) its corners seen from above, world frame.
        color: RGB.
        faint: whether it takes no part.
    """

    letter: str
    label: str
    outline: np.ndarray
    color: RGB
    faint: bool


def markers_of_scene(told: Mapping[str, Any]) -> list[Marker]:
    """The objects where they were seen, the lowest first, as they are drawn one over the other.

    Args:
        told: the JSON form of `Perceived`.
    """
    positions = [seen["position"] for seen in told["objects"] if seen["takes_part"]]
    return markers_of_candidate(told, positions, ())


def markers_of_candidate(
    told: Mapping[str, Any], positions: Sequence[Sequence[float]], turns: Sequence[float]
) -> list[Marker]:
    """The objects where an arrangement puts them, the lowest first; those that take no part stay.

    Args:
        told: the JSON form of `Perceived`.
        positions: (N, 3) where the cloud's mean of each object that takes part goes, world frame.
        turns: (N,) how far each turns about z, or empty.

    Raises:
        ValueError: when there are more or fewer positions, or turns, than objects that take part.
    """
    part = [seen for seen in told["objects"] if seen["takes_part"]]
    stay = [seen for seen in told["objects"] if not seen["takes_part"]]
    angles = turns if len(turns) else [0.0] * len(part)
    placed = [
        (goal[2], Marker(_letter(_TAKING_PART, index), seen["name"], _moved(seen, goal, turn), color_of(index), False))
        for index, (seen, goal, turn) in enumerate(zip(part, positions, angles, strict=True))
    ]
    staying = [
        (seen["position"][2], Marker(_letter(_STAYING, index), seen["name"], _outline(seen), FAINT, True))
        for index, seen in enumerate(stay)
    ]
    return [marker for _, marker in sorted(staying + placed, key=lambda entry: entry[0])]


def _letter(letters: str, index: int) -> str:
    return letters[index] if index < len(letters) else "*"


def _outline(seen: Mapping[str, Any]) -> np.ndarray:
    """(K, 2); a small square where the cloud spans no area."""
    if len(seen.get("outline") or ()):
        return np.array(seen["outline"], dtype=float)
    return np.array(seen["position"][:2]) + np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * (_DOT / 2)


def _moved(seen: Mapping[str, Any], goal: Sequence[float], turn: float) -> np.ndarray:
    """(K, 2) the outline turned about the cloud's mean, which goes to `goal`."""
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return (_outline(seen) - seen["position"][:2]) @ turned.T + goal[:2]

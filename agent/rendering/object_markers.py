"""Compute how each object appears in a picture of the table from above, from the payloads of events.

Made from the JSON form of events, so that a recorded run looks as it did. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import re
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from agent.rendering.palette import FAINT, RGB, color_of

_NUMBERED = re.compile(r".* ([1-9]\d{0,2})")
_DOT = 0.02  # m: the side of an object whose cloud spans no area
_HIGHER = 0.01  # m: so much higher is the cloud's mean of what stands on something
_LIFTED = 0.005  # m: so much an arrangement lifts what it stacks
_LETTERS, _NUMBERS = string.ascii_letters.swapcase(), string.digits[1:] + string.ascii_uppercase


@dataclass(frozen=True)
class Marker:
    """One object as it is drawn.

    Attributes:
        letter: the character that stands on it: the same in every picture of the table, whatever takes part.
        label: its name.
        outline: (K, 2) its corners seen from above, world frame.
        color: RGB, its own.
        faint: whether it takes no part.
        below: the name of the object below it; empty for the table.
    """

    letter: str
    label: str
    outline: np.ndarray
    color: RGB
    faint: bool
    below: str = ""


def markers_of_scene(scene: Mapping[str, Any]) -> list[Marker]:
    """Return markers of the objects at their observed places, the lowest first, in drawing order.

    Args:
        scene: the JSON form of `Perceived`.
    """
    positions = [seen["position"] for seen in scene["objects"] if seen["takes_part"]]
    return markers_of_candidate(scene, positions, ())


def markers_of_candidate(
    scene: Mapping[str, Any], positions: Sequence[Sequence[float]], turns: Sequence[float]
) -> list[Marker]:
    """Return markers of the objects at their goals, the lowest first; distractors stay in place.

    Args:
        scene: the JSON form of `Perceived`.
        positions: (N, 3) goal of the mean of each participant's cloud, world frame.
        turns: (N,) how far each turns about z, or empty.

    Raises:
        ValueError: if there are more or fewer positions, or turns, than objects that take part.
    """
    part = [seen for seen in scene["objects"] if seen["takes_part"]]
    stay = [seen for seen in scene["objects"] if not seen["takes_part"]]
    angles = turns if len(turns) else [0.0] * len(part)
    on_another = _on_another(scene["objects"])
    letter_of = _letters(scene["objects"])
    placed = []
    for index, (seen, goal, turn) in enumerate(zip(part, positions, angles, strict=True)):
        color = color_of(index, seen.get("color"))
        marker = Marker(letter_of[seen["name"]], seen["name"], _moved(seen, goal, turn), color, False)
        # What an arrangement pushes over another without lifting it collides with it, and stands on the table.
        lifted = goal[2] - seen["position"][2] > _LIFTED or seen["name"] in on_another
        placed.append((float(goal[2]), marker, lifted))
    staying = []
    for index, seen in enumerate(stay):
        color = color_of(index, seen.get("color") or FAINT)
        marker = Marker(letter_of[seen["name"]], seen["name"], _outline(seen), color, True)
        staying.append((float(seen["position"][2]), marker, seen["name"] in on_another))
    return _stacked(sorted(staying + placed, key=lambda entry: entry[0]))


def _on_another(objects: Sequence[Mapping[str, Any]]) -> set[str]:
    """Return the names of the objects that stood on others when they were seen."""
    upward = sorted(objects, key=lambda seen: seen["position"][2])
    entries = [
        (float(seen["position"][2]), Marker("", seen["name"], _outline(seen), FAINT, True), True) for seen in upward
    ]
    return {marker.label for marker in _stacked(entries) if marker.below}


def _stacked(entries: Sequence[tuple[float, Marker, bool]]) -> list[Marker]:
    """Return the markers, each with the object that it stands on: the highest one below its middle."""
    out: list[Marker] = []
    for number, (height, marker, may) in enumerate(entries):
        below = ""
        for lower_height, lower, _ in reversed(entries[:number]) if may else ():
            if height - lower_height > _HIGHER and _inside(lower.outline, _middle(marker.outline)):
                below = lower.label
                break
        out.append(replace(marker, below=below))
    return out


def _middle(outline: np.ndarray) -> np.ndarray:
    return (outline.min(axis=0) + outline.max(axis=0)) / 2


def _inside(outline: np.ndarray, point: np.ndarray) -> bool:
    """Return whether a point is inside a polygon (K, 2): a ray from it crosses an odd number of sides."""
    inside = False
    for (x, y), (next_x, next_y) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if (x > point[0]) != (next_x > point[0]):
            inside ^= bool(y + (point[0] - x) / (next_x - x) * (next_y - y) > point[1])
    return inside


def stacks(markers: Sequence[Marker]) -> list[list[Marker]]:
    """Return the stacks of two or more objects, each from the bottom upward."""
    root: dict[str, str] = {}
    for marker in markers:  # the lowest first
        root[marker.label] = root.get(marker.below) or marker.label
    groups = [[marker for marker in markers if root[marker.label] == name] for name in dict.fromkeys(root.values())]
    return [group for group in groups if len(group) > 1]


def stack_sentence(stack: Sequence[Marker]) -> str:
    """Describe a stack from the top, as in "3 on 2 on 1", or "2 on 1, 3 on 1" if several objects stand on one."""
    if all(upper.below == lower.label for lower, upper in zip(stack, stack[1:], strict=False)):
        return " on ".join(marker.letter for marker in reversed(stack))
    letter_of = {marker.label: marker.letter for marker in stack}
    return ", ".join(f"{marker.letter} on {letter_of[marker.below]}" for marker in stack if marker.below)


def _letters(objects: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return the character of each object by its name.

    It is the number in its name, as in "object 3", where no two names have the same; what has none gets a small letter.
    Otherwise all get capital letters by their places on the table: "box 2" has no number besides that in its name.
    """
    matches = {seen["name"]: _NUMBERED.fullmatch(seen["name"]) for seen in objects}
    numbers = {name: int(match[1]) for name, match in matches.items() if match}
    places = {seen["name"]: seen.get("number") or index for index, seen in enumerate(objects, start=1)}
    if not numbers or len(set(numbers.values())) < len(numbers):
        return {name: _letter(_LETTERS, place - 1) for name, place in places.items()}
    others = sorted(matches.keys() - numbers.keys(), key=places.__getitem__)
    of_others = {name: _letter(string.ascii_lowercase, index) for index, name in enumerate(others)}
    return of_others | {name: _letter(_NUMBERS, number - 1) for name, number in numbers.items()}


def _letter(letters: str, index: int) -> str:
    return letters[index] if index < len(letters) else "*"


def _outline(seen: Mapping[str, Any]) -> np.ndarray:
    """Return the outline (K, 2); a small square if the cloud spans no area."""
    if len(seen.get("outline") or ()):
        return np.array(seen["outline"], dtype=float)
    return np.array(seen["position"][:2]) + np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * (_DOT / 2)


def _moved(seen: Mapping[str, Any], goal: Sequence[float], turn: float) -> np.ndarray:
    """Return the outline (K, 2) turned about the cloud's mean, which moves to `goal`."""
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return (_outline(seen) - seen["position"][:2]) @ turned.T + goal[:2]

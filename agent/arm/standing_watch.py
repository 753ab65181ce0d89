"""Watch whether what the arm has placed goes on standing as placed, and say so when it does not."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from shapely import MultiPoint, Point

from agent.arm.events import StandingChanged
from agent.arm.eyes import Eyes
from structdiffusion.footprints import LEAST_OVERLAP
from structdiffusion.geometry import tilt_between
from structdiffusion.protocol.standing import Standing, support_name
from structdiffusion.simulation.world import TABLE

AS_HIGH = 0.02  # m from its goal's height: what is no farther off rests on something as high as its support
OVER = 0.01  # m that the middle of what rests on something may lie beyond what was seen of that


class StandingWatch:
    """The objects that were placed so far, and which of them do not stand as placed, as far as the camera tells.

    Args:
        eyes: what is known of where everything is.
    """

    def __init__(self, eyes: Eyes) -> None:
        self._eyes = eyes
        self._placed: dict[int, tuple[np.ndarray, int | None]] = {}
        self._down: set[int] = set()

    def __contains__(self, index: int) -> bool:
        return index in self._placed

    def place(self, index: int, goal_from_initial: np.ndarray, support: int | None) -> tuple[str, str]:
        """Take an object that was just placed.

        Args:
            index: the object.
            goal_from_initial: (4, 4) where it was to stand.
            support: the object, or `TABLE`, that it was to rest on; `None` if that is not known.

        Returns:
            Why it does not stand as placed, in words that follow its name, empty if it does; and what it was to rest
            on.
        """
        self._placed[index] = goal_from_initial, support
        trouble = self.trouble(index) or self._eyes.doubts.get(index, "")
        self._down = self._down | {index} if trouble else self._down - {index}
        return trouble, support_name(support, self._eyes.names)

    def take_away(self, index: int) -> None:
        """Forget an object that is in the hand."""
        self._placed.pop(index, None)
        self._down.discard(index)

    def changes(self, during: str) -> Iterator[StandingChanged]:
        """Yield which objects stand otherwise than when this was asked last.

        Args:
            during: what the arm has done since: "can 3 was placed".
        """
        for index in sorted(self._placed):
            trouble = self.trouble(index) or self._eyes.doubts.get(index, "")
            if bool(trouble) != (index in self._down):
                self._down ^= {index}
                yield StandingChanged(index, self._eyes.names[index], not trouble, trouble, during)

    def trouble(self, index: int) -> str:
        """Say why a placed object does not stand as placed, in words that follow its name; empty if it does."""
        if index in self._eyes.gone:
            return "is gone"
        if index in self._eyes.unconfirmed:
            return "cannot be seen where it was put"
        goal, support = self._placed[index]
        return standing_at(self._eyes, index, goal, support).trouble(support_name(support, self._eyes.names))


def standing_at(eyes: Eyes, index: int, goal_from_initial: np.ndarray, support: int | None = None) -> Standing:
    """Return how an object stands, as far as the camera tells, against where it was to stand.

    Args:
        eyes: what is known of where everything is.
        index: the object, which is not gone.
        goal_from_initial: (4, 4) where it was to stand.
        support: the object, or `TABLE`, that it was to rest on; `None` if that is not known.
    """
    now = eyes.motions[index]
    off = eyes.middle(index, now) - eyes.middle(index, goal_from_initial)
    supported = support is None or abs(off[2]) <= AS_HIGH or _over(eyes, index, support)
    outline, middle = eyes.outline(index), eyes.middle(index, now)[2]
    strange = (MultiPoint(one[:, :2]).convex_hull for one in eyes.unknown if one[:, 2].min() < middle)
    on_strange = any(one.intersection(outline).area > LEAST_OVERLAP for one in strange)
    supported = supported and not on_strange
    return Standing(float(np.hypot(*off[:2])), tilt_between(now, goal_from_initial), supported=supported)


def _over(eyes: Eyes, index: int, support: int) -> bool:
    """Return whether an object rests on the table, or over what was seen of its support: on that, or in its hollow."""
    if support == TABLE:
        return eyes.bottom(index) == 0.0
    outline = eyes.outline(support).buffer(OVER)
    return outline.contains(Point(eyes.cloud(index)[:, :2].mean(axis=0)))

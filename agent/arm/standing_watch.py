"""Watch whether what the arm has placed goes on standing as placed, and say so when it does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from agent.arm.events import StandingChanged
from structdiffusion.protocol.standing import standing, support_name
from structdiffusion.simulation.world import TabletopWorld


class StandingWatch:
    """The objects that were placed so far, and which of them do not stand as placed.

    Args:
        world: the true objects.
        names: of the objects, as the world counts them.
    """

    def __init__(self, world: TabletopWorld, names: Sequence[str]) -> None:
        self.world, self.names = world, names
        self._placed: dict[int, tuple[np.ndarray, int | None]] = {}
        self._down: set[int] = set()

    def __contains__(self, index: int) -> bool:
        return index in self._placed

    def place(self, index: int, world_from_goal: np.ndarray, support: int | None) -> tuple[str, str]:
        """Take an object that was just placed.

        Args:
            index: the object.
            world_from_goal: (4, 4) where it was to stand.
            support: the object, or `TABLE`, that it was to rest on; `None` if that is not known.

        Returns:
            Why it does not stand as placed, in words that follow its name, empty if it does; and what it was to rest
            on.
        """
        self._placed[index] = world_from_goal, support
        trouble = self._trouble(index)
        self._down = self._down | {index} if trouble else self._down - {index}
        return trouble, support_name(support, self.names)

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
            trouble = self._trouble(index)
            if bool(trouble) != (index in self._down):
                self._down ^= {index}
                yield StandingChanged(index, self.names[index], not trouble, trouble, during)

    def _trouble(self, index: int) -> str:
        goal, support = self._placed[index]
        return standing(self.world, index, goal, support).trouble(support_name(support, self.names))

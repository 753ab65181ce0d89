"""Describe what is left to do of a build, for whoever lays it out anew or wants something else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from structdiffusion.observation import Arrangement, ObjectCloud, Scene


@dataclass(frozen=True, eq=False)
class Remainder:
    """What is left of a build that cannot go on as it was planned. Indices are those of the N objects of `first`.

    Attributes:
        first: the scene that the build began with.
        others: what is no object of it, as it stands now: its distractors, and what has appeared.
        left: the objects that are still there.
        now_from_initial: (N, 4, 4) how every object has moved so far, as far as known.
        goal_from_initial: (N, 4, 4) where the last arrangement has them.
        standing: the objects that stand there.
    """

    first: Scene
    others: tuple[ObjectCloud, ...]
    left: tuple[int, ...]
    now_from_initial: np.ndarray
    goal_from_initial: np.ndarray
    standing: frozenset[int]


class Replanner(Protocol):
    """Anyone who knows the goal of a build."""

    def concerns(self, name: str) -> bool:
        """Return whether the goal speaks of the distractor with this name."""

    def lay_out(self, remainder: Remainder) -> Sequence[Arrangement]:
        """Propose arrangements of the same goal, best first, for the objects of the first scene; those that are gone
        have the identity as motion, those that stay their present one.
        """

    def missed(self, remainder: Remainder) -> Sequence[str]:
        """Say which checks of the goal fail where things are, as far as was seen, and would hold where the last
        arrangement has them.
        """


# Asked where the hand is empty and the arm is folded, with a function that describes what is left: whether the build
# ends there. It may wait.
EndsHere: TypeAlias = Callable[[Callable[[], Remainder]], bool]

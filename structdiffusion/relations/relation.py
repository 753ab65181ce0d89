"""The protocol of a relation: what the rest of the package needs to know about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from grounding.goals.parts import RelationPart
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.structures.checks import Check

COMFORT = 1.0  # the margin from which on a condition holds so surely that more is no better


class Relation(Protocol):
    """One relation: its checks, and where an object can go so that they hold.

    A relation has no state. Directions are in the world frame. Methods implemented here are defaults.

    Attributes:
        name: its name in `grounding.goals.parts.RELATIONS`.
        references: how many figures it holds with.
        apart: whether it applies to each object individually, so that it cannot apply to a structure as a whole.
        carried: whether the reference carries the object, so that the reference is placed first.
        hollow: whether the reference carries it inside.
        on_stacks: whether the reference may be a whole structure of objects on one another.
        mutual: whether each of its two objects is the other's reference.
        exact: whether the initial places determine the place, so that there is little to choose.
    """

    name: str
    references: int = 1
    apart: bool = False
    carried: bool = False
    hollow: bool = False
    on_stacks: bool = False
    mutual: bool = False
    exact: bool = False

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check every condition of the evaluation protocol.

        Args:
            figure: the object, or a structure as a whole.
            references: the reference objects.
            part: the relation, with its distance, position or direction.
        """
        ...

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) for the figure at which the checks are likely to hold, metres, world frame."""
        ...

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return how surely the checks hold at each of C candidate places, (C,): 0 at a limit, below 0 outside, at most
        1.
        """
        ...


def within(value: np.ndarray, low: float, high: float, comfort: float) -> np.ndarray:
    """Return how far values lie inside limits, as a share of a comfortable distance, at most 1; below 0 outside."""
    return np.minimum(COMFORT, np.minimum(value - low, high - value) / comfort)


def beside(centroid: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split vectors (..., 2) into their parts along a unit direction (2,), and to its left."""
    return centroid @ direction, centroid @ np.array([-direction[1], direction[0]])

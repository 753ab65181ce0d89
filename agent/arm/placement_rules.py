"""Define what a goal says about placements besides the poses: their order, and what goes into what."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

# How a planning scene names an obstacle: the index of an object of the scene, or of one that stays.
ObstacleKey: TypeAlias = int | tuple[str, int]


@dataclass(frozen=True)
class PlacementRules:
    """What is known of the placements besides the poses.

    Attributes:
        after: object -> those that must be in place before it, such as the bowl that an apple goes into.
        into: object -> the open containers that it goes into; only their walls are in its way.
    """

    after: Mapping[int, frozenset[int]] = field(default_factory=dict)
    into: Mapping[int, frozenset[ObstacleKey]] = field(default_factory=dict)

    def with_first(self, first: Collection[int], count: int) -> PlacementRules:
        """Return the rules by which some of `count` objects are placed before all others."""
        if not first:
            return self
        before = frozenset(first)
        after = {
            index: self.after.get(index, frozenset()) | (frozenset() if index in before else before)
            for index in range(count)
        }
        return replace(self, after=after)

    def in_order(self, order: Sequence[int]) -> PlacementRules:
        """Return the rules by which objects are placed in an order; the same rules for none."""
        after = {
            index: self.after.get(index, frozenset()) | frozenset(order[:place]) for place, index in enumerate(order)
        }
        return replace(self, after={**self.after, **after})


def moving(goal_from_initial: np.ndarray) -> list[int]:
    """Return which of the motions (N, 4, 4) are not the identity: the indices of the objects that have to be moved."""
    return np.flatnonzero((np.asarray(goal_from_initial) != np.eye(4)).any(axis=(1, 2))).tolist()

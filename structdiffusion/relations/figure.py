"""The figures that relations connect: objects, or structures as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.footprints import outline_centroid
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import PlacedBody


@dataclass(frozen=True)
class Standing:
    """Everything that stands on a table, at rest, in the world frame, metres.

    Attributes:
        bodies: all M of them; their `rests_on` are indices among all. One that leans on the table and on another body
            rests on both, and the table is -1; one on the table alone rests on nothing.
        before: (M, 2) the centroid of each before anything moved.
        touches: (M) the indices of the bodies that each touches.
        table: the table top.
    """

    bodies: tuple[PlacedBody, ...]
    before: np.ndarray
    touches: tuple[tuple[int, ...], ...]
    table: Table

    def figure(self, members: Sequence[int], name: str | None = None) -> Figure:
        """Return some of the bodies as one figure; one body keeps its name."""
        return Figure(name or ", ".join(self.bodies[i].name for i in members), tuple(members), self)

    def among(self, members: Sequence[int]) -> list[PlacedBody]:
        """Return a subset of the bodies; `rests_on` is reindexed, without bodies outside the subset."""
        number = {index: k for k, index in enumerate(members)}
        return [
            replace(self.bodies[index], rests_on=tuple(number[i] for i in self.bodies[index].rests_on if i in number))
            for index in members
        ]


@dataclass(frozen=True)
class Figure:
    """One object, or several as a whole.

    Attributes:
        name: what checks call it.
        members: the indices of its bodies.
        standing: the bodies on the table.
    """

    name: str
    members: tuple[int, ...]
    standing: Standing

    @property
    def bodies(self) -> list[PlacedBody]:
        """Return its bodies; `rests_on` counts among all bodies."""
        return [self.standing.bodies[i] for i in self.members]

    @cached_property
    def outline(self) -> np.ndarray:
        """Return the footprint (K, 2) of one object, or the convex hull of several."""
        if len(self.members) == 1:
            return self.bodies[0].footprint
        points = np.concatenate([body.footprint for body in self.bodies])
        return points[ConvexHull(points).vertices]

    @cached_property
    def centroid(self) -> np.ndarray:
        """Return the centroid (2,) of one object, or the centre of the hull of several."""
        return self.bodies[0].centroid if len(self.members) == 1 else outline_centroid(self.outline)

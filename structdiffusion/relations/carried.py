"""On and in: an object that another carries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from grounding.goals.parts import RelationPart
from structdiffusion.evaluation_protocol import MIN_DEPTH_INSIDE
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, within
from structdiffusion.structures.checks import Check

_SURE = 0.01  # m from the edge of what carries, from where on more is no better
_SPREAD = 0.15  # of the reference's smallest radius: how far from its middle places are drawn


class _Carried(Relation):
    """What on and in have in common: the object's centroid lies over the reference."""

    apart = True
    carried = True

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) about the middle of the reference, the first exactly there."""
        (reference,) = references
        radius = np.linalg.norm(reference.outline - reference.centroid, axis=1).min()
        spread = _SPREAD * radius * rng.standard_normal((count, 2))
        spread[:1] = 0.0
        return reference.centroid + spread

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return how far (C,) the centroids lie inside the reference's footprint; physics decides about the rest."""
        (reference,) = references
        footprint = shapely.Polygon(reference.outline)
        points = shapely.points(figures.centroids)
        inside = shapely.distance(footprint.exterior, points)
        return within(np.where(shapely.contains(footprint, points), inside, -inside), 0.0, np.inf, _SURE)


class On(_Carried):
    """An object that rests on its reference and on nothing else."""

    name = "on"
    on_stacks = True

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check the object's support, and that its centroid lies above it."""
        (reference,) = references
        (body,) = figure.bodies
        foreign = len(set(body.rests_on) - set(reference.members)) + (not body.rests_on)
        return [
            Check("supports other than the reference", foreign == 0, foreign, "0"),
            _over(figure, reference),
        ]


class In(_Carried):
    """An object that lies inside its reference."""

    name = "in"
    hollow = True

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check that the object's centroid is over the reference, that it is inside, and that it touches nothing
        outside.
        """
        (reference,) = references
        (index,), (vessel,) = figure.members, reference.members
        depth = reference.bodies[0].z_top - figure.bodies[0].z_bottom
        touching = [i for i in figure.standing.touches[index] if not _inside(figure, i, vessel)]
        return [
            _over(figure, reference),
            Check("bottom below the rim (m)", depth >= MIN_DEPTH_INSIDE, depth, f">= {MIN_DEPTH_INSIDE:g}"),
            Check("things outside that it touches", not touching, len(touching), "0"),
        ]


def _over(figure: Figure, reference: Figure) -> Check:
    over = bool(shapely.Polygon(reference.outline).covers(shapely.Point(figure.centroid)))
    return Check("centroid over the reference", over, float(over), "1")


def _inside(figure: Figure, index: int, vessel: int) -> bool:
    """Return whether a body is the vessel, or lies in it with its centroid and below its rim."""
    if index == vessel:
        return True
    if index < 0:  # the table
        return False
    body, around = figure.standing.bodies[index], figure.standing.bodies[vessel]
    over = shapely.Polygon(around.footprint).covers(shapely.Point(body.centroid))
    return bool(over) and body.z_bottom <= around.z_top - MIN_DEPTH_INSIDE

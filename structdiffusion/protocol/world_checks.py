"""The semantic checks of a simulated world, by the true models and their contacts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from grounding.spec import StructureSpec
from structdiffusion.geometry import transform_points
from structdiffusion.objects.model import footprint_centroid, unique_names
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.protocol.slot_measurement import realised_shape
from structdiffusion.simulation.world import REST_SECONDS, TABLE, TabletopWorld
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check


def semantic_checks(
    world: TabletopWorld, indices: Sequence[int], spec: StructureSpec, names: Sequence[str] | None = None
) -> tuple[Check, ...]:
    """Check a world against the evaluation protocol, by the true models and their contacts.

    Args:
        world: the world, at rest; physics runs in it for 0.1 s while contacts are recorded.
        indices: the objects of the structure; all others are distractors.
        spec: the requested structure.
        names: the names of the objects in the checks; by default their categories, numbered.
    """
    number = {index: k for k, index in enumerate(indices)}
    names = names or unique_names([world.models[index] for index in indices])
    supports = world.supports(REST_SECONDS)
    bodies = [
        placed_body(world, index, name, [number[other] for other in supports[index] if other in number])
        for name, index in zip(names, indices)
    ]
    # `rests_on` can tell neither a distractor nor the table beside another support.
    own = {TABLE, *indices}
    foreign = sum(not own.issuperset(supports[index]) for index in indices)
    checks = [*check_structure(bodies, spec, world.table)]
    checks.append(Check("objects that rest on a distractor", foreign == 0, foreign, "0"))
    if structure_named(spec.shape or realised_shape(bodies, world.table)).stacks:
        leaning = sum(TABLE in supports[index] and len(supports[index]) > 1 for index in indices)
        checks.append(Check("objects that rest on the table and on another", leaning == 0, leaning, "0"))
    return tuple(checks)


def placed_body(world: TabletopWorld, index: int, name: str, rests_on: Sequence[int]) -> PlacedBody:
    """Return an object of a world as checks see it, by its true model.

    Args:
        world: the world.
        index: of the object in the world.
        name: what checks call it.
        rests_on: the numbers of the bodies that carry it, as the checks count them.
    """
    pose, model = world.pose(index), world.models[index]
    points = transform_points(pose, np.concatenate(model.hulls))
    outline = points[ConvexHull(points[:, :2]).vertices, :2]
    return PlacedBody(
        name=name,
        category=model.category,
        footprint=outline,
        centroid=footprint_centroid(outline),
        z_bottom=float(points[:, 2].min()),
        z_top=float(points[:, 2].max()),
        front_yaw=math.atan2(pose[1, 0], pose[0, 0]),
        rests_on=tuple(rests_on),
    )

"""The checks of a simulated world against a goal of several parts or one structure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.goals.goal import Goal
from grounding.spec import StructureSpec
from structdiffusion.geometry import transform_points
from structdiffusion.objects.model import footprint_centroid, unique_names
from structdiffusion.protocol.goal_semantic import check_goal
from structdiffusion.protocol.world_checks import placed_body, semantic_checks
from structdiffusion.relations.figure import Standing
from structdiffusion.simulation.world import REST_SECONDS, TABLE, TabletopWorld
from structdiffusion.structures.checks import Check

_TOUCHING = 0.001  # m between two surfaces that count as touching: what the engine leaves between bodies at rest


def asked_checks(
    world: TabletopWorld,
    indices: Sequence[int],
    asked: StructureSpec | Goal,
    world_from_initial: np.ndarray,
    names: Sequence[str] | None = None,
    *,
    count: int | None = None,
    aside: Sequence[int] = (),
    colors: Sequence[str] | None = None,
) -> tuple[Check, ...]:
    """Check a world against one structure of these objects, or a goal.

    Args: see `goal_checks`. For a structure, the first `count` objects are the participants, and the last two arguments
        are not used.
    """
    if isinstance(asked, Goal):
        return goal_checks(world, indices, asked, world_from_initial, names, count=count, aside=aside, colors=colors)
    return semantic_checks(world, indices[:count], asked, None if names is None else names[:count])


def goal_checks(
    world: TabletopWorld,
    indices: Sequence[int],
    goal: Goal,
    world_from_initial: np.ndarray,
    names: Sequence[str] | None = None,
    *,
    count: int | None = None,
    aside: Sequence[int] = (),
    colors: Sequence[str] | None = None,
) -> tuple[Check, ...]:
    """Check a world against the evaluation protocol, by the true models and their contacts.

    Args:
        world: the world, at rest; physics runs in it for 0.1 s while contacts are recorded.
        indices: the world's index of each of N objects: those that the goal indexes, then others that have to stay.
        goal: the goal.
        world_from_initial: (N, 4, 4) the poses of these objects before anything moved.
        names: the names of the objects in the checks; by default their nouns, numbered.
        count: how many of them the goal counts; by default all.
        aside: the indices of objects that were set aside because they were in the way.
        colors: the name of each object's colour, for goals that group by it.

    Raises:
        GoalError: for a goal that these objects cannot be checked for.
    """
    names = names or unique_names([world.models[index] for index in indices])
    standing = standing_of(world, indices, np.asarray(world_from_initial), names)
    return tuple(check_goal(standing, goal, len(indices) if count is None else count, colors, aside))


def standing_of(
    world: TabletopWorld, indices: Sequence[int], world_from_initial: np.ndarray, names: Sequence[str]
) -> Standing:
    """Return the bodies in a world: the N objects of a goal first, then all others, which were not moved on purpose.

    Args: see `goal_checks`.
    """
    others = [index for index in range(len(world.bodies)) if index not in set(indices)]
    order = [*indices, *others]
    number = {index: k for k, index in enumerate(order)}
    every_name = [*names, *unique_names([world.models[index] for index in others])]
    supports = world.supports(REST_SECONDS)
    bodies, touches = [], []
    for name, index in zip(every_name, order, strict=True):
        # What leans on the table and on another rests on more than the other: the table is listed where it is not
        # alone.
        carriers = supports[index] if len(supports[index]) > 1 else [i for i in supports[index] if i != TABLE]
        bodies.append(placed_body(world, index, name, [number.get(i, TABLE) for i in carriers]))
        near = world.clearances(index)
        touches.append(tuple(number.get(i, TABLE) for i, gap in near.items() if gap < _TOUCHING))
    before = [
        footprint_centroid(transform_points(pose, np.concatenate(world.models[index].hulls))[:, :2])
        for index, pose in zip(indices, world_from_initial, strict=True)
    ]
    before += [body.centroid for body in bodies[len(indices) :]]
    return Standing(tuple(bodies), np.array(before), tuple(touches), world.table)

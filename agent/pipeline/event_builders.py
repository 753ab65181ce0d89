"""Build events from the results of a run's steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from agent import events

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from grounding.interpreter import Interpretation
    from structdiffusion.observation import Arrangement, ObjectCloud, Scene

_OUTLINE_DETAIL = 0.002  # m: finer than a character, and than most of the pictures


def parsed_event(goal: Interpretation, seconds: float) -> events.Parsed:
    """Make the event of an instruction that was parsed, with the nouns that name its objects."""
    parse = goal.parse
    return events.Parsed(
        goal.spec,
        parse.confidence,
        parse.evidence,
        parse.parser,
        parse.dropped,
        goal.named,
        goal.viewpoint,
        parse.prompt_sha256,
        goal.fallback,
        seconds,
    )


def perceived_event(scene: Scene, seconds: float, table: TableScene | None = None) -> events.Perceived:
    """Make the event of a look at the table, with the descriptions and notes of `table` where it is given."""
    display_names = {} if table is None else dict(zip(table.names, table.display_names, strict=True))
    colors = {} if table is None else dict(zip(table.names, table.color_names, strict=True))
    seen = [
        events.SeenObject(
            cloud.name,
            cloud.category,
            number < len(scene.objects),
            tuple(cloud.centroid.tolist()),
            len(cloud.points),
            _outline(cloud),
            None if cloud.colors is None else tuple(cloud.colors.mean(axis=0).round().astype(int).tolist()),
            display_names.get(cloud.name, cloud.name),
            colors.get(cloud.name, ""),
        )
        for number, cloud in enumerate((*scene.objects, *scene.distractors))
    ]
    top = scene.table
    rectangle = (top.x_min, top.x_max, top.y_min, top.y_max)
    notes, labelled = ((), None) if table is None else (table.notes, table.labelled)
    return events.Perceived(tuple(seen), rectangle, seconds, notes, scene=scene, labelled=labelled)


def describe_shortfall(table: TableScene, what: str) -> str:
    """Say how many of the objects that were asked for do `what`, and why the others do not.

    Args:
        table: the scene, whose `missing` names the others.
        what: a verb phrase in the plural, such as "take part".

    Returns:
        A sentence; empty where all of them take part.
    """
    if not table.missing:
        return ""
    reasons = "; ".join(f"{name} is left where it is: {why}" for name, why in table.missing.items())
    return f"{table.count} of {table.count + len(table.missing)} objects {what}; {reasons}"


def _outline(cloud: ObjectCloud) -> tuple[tuple[float, float], ...]:
    hull = shapely.MultiPoint(cloud.points[:, :2]).convex_hull
    if hull.geom_type != "Polygon":
        return ()
    corners = shapely.get_coordinates(hull.simplify(_OUTLINE_DETAIL))[:-1]
    return tuple((round(x, 4), round(y, 4)) for x, y in corners.tolist())


def chosen_event(rank: int, arrangement: Arrangement, scene: Scene) -> events.Chosen:
    """Make the event of choosing an arrangement; `rank` counts from 1."""
    motions = arrangement.goal_from_initial
    goals = tuple(
        {"name": cloud.name, "position": position, "goal_from_initial": motion}
        for cloud, position, motion in zip(scene.objects, goal_positions(motions, scene), motions, strict=True)
    )
    return events.Chosen(rank, dict(arrangement.scores), goals, arrangement=arrangement, scene=scene)


def turns_about_z(motions: np.ndarray) -> tuple[float, ...]:
    """Return how far rigid motions (N, 4, 4) turn about z: (N,) radians."""
    return tuple(round(angle, 4) for angle in np.arctan2(motions[:, 1, 0], motions[:, 0, 0]).tolist())


def goal_positions(motions: np.ndarray, scene: Scene) -> list[tuple[float, float, float]]:
    """Return where motions (N, 4, 4) take the means of the clouds: N points (x, y, z), metres."""
    return [
        tuple((motion[:3, :3] @ cloud.centroid + motion[:3, 3]).tolist())
        for motion, cloud in zip(motions, scene.objects, strict=True)
    ]

"""Build events from the results of a run's steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from agent import events
from agent.arm.placement_rules import moving
from agent.pipeline.table_goal import described_parts
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart

if TYPE_CHECKING:
    from agent.pipeline.table_goal import TableGoal
    from agent.scenes.table_scene import TableScene
    from grounding.interpretation import Interpretation
    from structdiffusion.observation import Arrangement, ObjectCloud, Scene

_OUTLINE_DETAIL = 0.002  # m: finer than a character, and than most of the pictures


def why_not(goal: Interpretation, names: Sequence[str] | None = None, hint: str = "") -> str:
    """Return why an instruction is not carried out: the question, or why it is refused and what it may mean instead.

    Args:
        goal: of the instruction; its status is not "ok".
        names: of the objects that are there; `None` where the suggestions are in the instruction's words.
        hint: advice where the instruction names objects that are not there.
    """
    meant = [describe_parts(one.parts, names) for one in goal.suggestions] if goal.status == "refused" else []
    may_mean = f"it may mean {' or '.join(map(repr, meant))}" if meant else ""
    advice = hint if "there is only" in goal.message else ""
    return "; ".join(filter(None, (goal.message, may_mean, advice, goal.fallback)))


def parsed_event(goal: Interpretation, seconds: float, names: Sequence[str] = ()) -> events.Parsed:
    """Make the event of an instruction that was parsed, with the nouns that name its objects.

    Args:
        goal: the goal of the instruction.
        seconds: how long it took.
        names: of the objects that the indices in a goal of several parts mean.
    """
    parse, several = goal.parse, goal.goal.plain_spec is None
    plain = Goal((StructurePart.of(goal.spec, tuple(dict.fromkeys(goal.named)) or None),))
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
        goal=(goal.goal if several else plain).to_dict(),
        parts=described_parts(goal.goal, names) if several else (),
        objects=tuple(names) if several else (),
    )


def perceived_event(scene: Scene, seconds: float, table: TableScene | None = None) -> events.Perceived:
    """Make the event of an observation, with the descriptions and notes of `table` if given."""
    display_names = {} if table is None else dict(zip(table.names, table.display_names, strict=True))
    colors = {} if table is None else dict(zip(table.names, table.color_names, strict=True))
    clouds = (*scene.objects, *scene.distractors)
    every_name = [cloud.name for cloud in clouds] if table is None else table.original_names
    numbers = {name: number for number, name in enumerate(every_name, start=1)}
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
            None if table is None else table.confidences.get(cloud.name),
            numbers[cloud.name],
        )
        for number, cloud in enumerate(clouds)
    ]
    top = scene.table
    rectangle = (top.x_min, top.x_max, top.y_min, top.y_max)
    if table is None:
        return events.Perceived(tuple(seen), rectangle, seconds, scene=scene)
    return events.Perceived(
        tuple(seen), rectangle, seconds, table.notes, scene=scene, labelled=table.labelled, surfaces=table.surfaces(),
        base=table.arm.kinematics.world_from_base[:3, 3],
    )  # fmt: skip


def describe_shortfall(table: TableScene, what: str) -> str:
    """Say how many of the objects that were asked for do `what`, and why the others do not.

    Args:
        table: the scene, whose `missing` names the others.
        what: a verb phrase in the plural, such as "take part".

    Returns:
        A sentence; empty if all of them take part.
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


def chosen_event(rank: int, arrangement: Arrangement, scene: Scene, wanted: TableGoal | None = None) -> events.Chosen:
    """Make the event of choosing an arrangement.

    Args:
        rank: its place among all, from 1.
        arrangement: where everything goes.
        scene: what takes part.
        wanted: a goal of several parts.
    """
    motions = arrangement.goal_from_initial
    goals: tuple[dict[str, Any], ...] = tuple(
        {"name": cloud.name, "position": position, "goal_from_initial": motion}
        for cloud, position, motion in zip(scene.objects, goal_positions(motions, scene), motions, strict=True)
    )
    if wanted is not None:
        moves = moving(motions)
        for index, goal in enumerate(goals):
            parts = [number + 1 for number in wanted.parts_of(goal["name"])]
            goal |= {"parts": parts, "stays": index not in moves, "aside": index in moves and not parts}
    return events.Chosen(rank, dict(arrangement.scores), goals, arrangement=arrangement, scene=scene)


def describe_aside(chosen: events.Chosen) -> str:
    """Say which objects a chosen arrangement of a goal of several parts sets aside; empty if there are none."""
    names = ", ".join(goal["name"] for goal in chosen.goals if goal.get("aside"))
    return f"set aside, because it stands in the way: {names}" if names else ""


def turns_about_z(motions: np.ndarray) -> tuple[float, ...]:
    """Return how far rigid motions (N, 4, 4) turn about z: (N,) radians."""
    return tuple(round(angle, 4) for angle in np.arctan2(motions[:, 1, 0], motions[:, 0, 0]).tolist())


def goal_positions(motions: np.ndarray, scene: Scene) -> list[tuple[float, float, float]]:
    """Return where motions (N, 4, 4) take the means of the clouds: N points (x, y, z), metres."""
    return [
        tuple((motion[:3, :3] @ cloud.centroid + motion[:3, 3]).tolist())
        for motion, cloud in zip(motions, scene.objects, strict=True)
    ]

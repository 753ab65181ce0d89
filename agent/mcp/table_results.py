"""Turn what the conversation knows into the fields of results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from agent import events
from agent.chat.table_facts import object_facts
from agent.event_base import Event, json_value
from agent.mcp.results import Check, Move, SeenObject
from agent.pipeline.event_builders import turns_about_z
from agent.reporting.event_text import parse_notes
from structdiffusion.geometry import quaternion_from_matrix

_CM = 100.0


def seen_objects(seen: events.Perceived) -> list[SeenObject]:
    """Return the objects that were seen, with their places and sizes."""
    return [
        SeenObject(
            name=one.name,  # plans and questions call it so too
            category=one.category,
            color=one.color_name,
            position=_rounded(one.position),
            size_cm=(round(_CM * fact.sides[0], 1), round(_CM * fact.sides[1], 1), round(_CM * fact.sides[2], 1)),
        )
        for one, fact in zip(seen.objects, object_facts(seen), strict=True)
    ]


def moves_of(chosen: events.Chosen) -> list[Move]:
    """Return the objects that an arrangement moves, and where to."""
    moving = [goal for goal in chosen.goals if not goal.get("stays")]
    if not moving:
        return []
    motions = np.array([goal["goal_from_initial"] for goal in moving])
    turns = np.degrees(turns_about_z(motions)).round(1).tolist()
    return [
        Move(
            name=goal["name"],
            position=_rounded(goal["position"]),
            turn_deg=turn,
            orientation=tuple(quaternion_from_matrix(motion).round(4).tolist()),
            aside=bool(goal.get("aside")),
        )
        for goal, turn, motion in zip(moving, turns, motions, strict=True)
    ]


def checks_of(checks: Sequence[Any]) -> list[Check]:
    """Return the checks of a verdict, given as JSON values."""
    return [Check.model_validate({key: check[key] for key in Check.model_fields}) for check in checks]


def notes_of(heard: Sequence[Event]) -> list[str]:
    """Return the remarks in some events, each once."""
    notes = [note for event in heard if isinstance(event, events.Parsed) for note in parse_notes(event.to_dict())]
    notes += [event.message for event in heard if isinstance(event, events.Noted)]
    return list(dict.fromkeys(notes))


def checked_of(event: events.Checked | None) -> list[Check]:
    """Return the checks of an event; none without one."""
    return [] if event is None else checks_of(json_value(event.checks))


def _rounded(position: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 4) for value in position)
    return x, y, z

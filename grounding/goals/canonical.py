"""Spell the parts of a goal in one way, and turn them to the opposite viewpoint."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from grounding.goals.parts import Part, RelationPart
from grounding.spec import OPPOSITE

_FIRST_END = {"right": "left", "far": "near", "top": "bottom"}
_OTHER_DIRECTION = {"ascending": "descending", "descending": "ascending"}


def canonical_part(part: Part) -> Part:
    """Return the one spelling of a part: objects ascending where their order says nothing, orders from one end.

    "Descending from the right" is "ascending from the left"; the same holds for near and far, bottom and top.
    """
    if isinstance(part, RelationPart):
        return replace(part, objects=_sorted(part.objects), reference=_sorted(part.reference))
    order, objects = part.order, part.objects
    if order is not None and order.by == "listed" and objects is not None:
        if order.direction == "descending":
            order, objects = replace(order, direction=None), objects[::-1]
        if order.start in _FIRST_END:
            order, objects = replace(order, start=_FIRST_END[order.start]), objects[::-1]
        return replace(part, order=replace(order, direction=None), objects=objects)
    if order is not None and order.start in _FIRST_END and order.direction is not None:
        order = replace(order, start=_FIRST_END[order.start], direction=_OTHER_DIRECTION[order.direction])
    return replace(part, order=order, objects=_sorted(objects))


def _sorted(objects: Any) -> Any:
    return (
        tuple(sorted(objects, key=lambda one: (isinstance(one, str), one))) if isinstance(objects, tuple) else objects
    )


def turned_part(part: Part) -> Part:
    """Turn every direction of a part by 180 degrees: the same part, spoken from the opposite side."""

    def other(value: str | None) -> str | None:
        return None if value is None else OPPOSITE.get(value, value)

    if isinstance(part, RelationPart):
        return replace(
            part, relation=OPPOSITE.get(part.relation, part.relation), x_position=other(part.x_position),
            y_position=other(part.y_position), direction=other(part.direction),
        )  # fmt: skip
    order = part.order
    if order is not None and order.start in ("left", "right", "near", "far"):
        order = replace(order, start=other(order.start))
    slots: dict[str, Any] = dict(part.spec.turned().to_dict())
    return replace(part, **slots, along=other(part.along), order=order)

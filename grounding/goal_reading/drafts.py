"""Define the drafts of parts, to which more can be said, and make the parts of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from typing import Any

from grounding.goal_reading.feasibility import LEAST_OBJECTS
from grounding.goal_reading.frame import Frame
from grounding.goal_reading.scene_references import ReadingError, SceneReferences
from grounding.goals.parts import Part, RelationPart, StructurePart
from grounding.parse_result import shortened


class ImpossibleError(ReadingError):
    """A structure that these objects cannot form."""


class ContradictionError(ReadingError):
    """An instruction that asks for what excludes another wish of it."""


class TwoValuesError(ReadingError):
    """An instruction that asks for two values of one key, as far as it was understood."""


@dataclass
class Draft:
    """A part with the frame that it came from; `keys` of a structure are collected before it is made."""

    frame: Frame
    values: dict[str, Any] | None = None  # of a structure
    relation: RelationPart | None = None
    objects: tuple[Any, ...] | None = None


def draft_of(part: Part) -> Draft:
    """Make a draft of a part that was asked for before, so that more can be said of it."""
    if isinstance(part, RelationPart):
        return Draft(Frame(), relation=part)
    values = {each.name: getattr(part, each.name) for each in fields(part) if each.name != "objects"}
    return Draft(Frame(), values, objects=part.objects)  # type: ignore[arg-type]


def made_part(
    part: Draft, drafts: Sequence[Draft], text: str, find: SceneReferences, left_out: Collection[Any]
) -> Part:
    """Make a part of its draft.

    Args:
        part: the draft.
        drafts: all drafts of the goal.
        text: the instruction, for errors.
        find: what is there.
        left_out: objects that stay as they are.

    Raises:
        ImpossibleError: for a structure that these objects cannot form.
        GoalError: for a part that is not legal.
    """
    if part.relation is not None:
        return part.relation
    values = dict(part.values or {})
    objects = part.objects
    if objects is None and left_out and find.count is not None:
        objects = tuple(i for i in range(find.count) if i not in left_out and i not in _named_elsewhere(part, drafts))
    elif isinstance(objects, tuple) and set(left_out) & set(
        objects
    ):  # "line up the cups but keep the red one where it is"
        objects = tuple(one for one in objects if one not in left_out)
        if not objects:
            raise ImpossibleError(f"{shortened(text)!r} leaves alone all the objects that it asks to move")
    _enough(values, objects, text, find)
    return StructurePart(**values, objects=objects)


def refuse_touching(drafts: Sequence[Draft], untouched: Collection[Any], text: str) -> None:
    """Refuse to move what must not be touched: "don't touch the mug but put it in the middle".

    Raises:
        ContradictionError: for a relation that moves it.
    """
    for draft in drafts:
        moved = draft.relation.objects if draft.relation is not None else ()
        if isinstance(moved, tuple) and set(moved) & set(untouched):
            raise ContradictionError(f"{shortened(text)!r} contradicts itself: it moves what must not be touched")


def refuse_another_shape(frame: Frame, shape: str | None, last: Draft, text: str) -> None:
    """Refuse a frame that only names another shape for the objects of the structure before it: "..., then in a line".

    Raises:
        ContradictionError: for such a frame.
    """
    linked = any(each.said.lower().startswith(("in ", "into ", "as ", "to ")) for each in frame.get("shape"))
    before = (last.values or {}).get("shape")
    if linked and not frame.objects and last.objects is not None and before not in (None, shape):
        raise ContradictionError(
            f"{shortened(text)!r} asks for a {before} and a {shape} of the same objects, and only what stands in the end can be "
            "built; say only that, or name the objects of each"
        )


def _enough(values: dict[str, Any], objects: Any, text: str, find: SceneReferences) -> None:
    """Refuse a shape that needs more objects than it gets, and a grid that they cannot fill."""
    if find.count is None or find.catalogue or objects is None and find.count == 0:
        return
    count = len(objects) if objects is not None else find.count
    shape, rows, columns = values.get("shape"), values.get("rows"), values.get("columns")
    least = LEAST_OBJECTS.get(shape or "", 1)
    if count < least:
        raise ImpossibleError(f"a {shape} needs {least} objects or more, but {shortened(text)!r} means {count}")
    if rows and columns and objects is not None and not (rows - 1) * columns < count <= rows * columns:
        raise ImpossibleError(
            f"{rows} rows of {columns} need {rows * columns} objects, and {shortened(text)!r} has {count} for them"
        )


def _named_elsewhere(part: Draft, drafts: Sequence[Draft]) -> set[Any]:
    named: set[Any] = set()
    for other in drafts:
        if other is part:
            continue
        for objects in (
            other.objects,
            (other.values or {}).get("around"),
            *((other.relation.objects, other.relation.reference) if other.relation else ()),
        ):
            named.update(objects if isinstance(objects, tuple) else ())
    named.update((part.values or {}).get("around") or ())
    return named


def objects_of(relation: RelationPart | None) -> tuple[Any, ...]:
    """Return the single objects that a relation names."""
    if relation is None:
        return ()
    return tuple(
        one for objects in (relation.objects, relation.reference) if isinstance(objects, tuple) for one in objects
    )

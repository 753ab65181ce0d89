"""Change single parts of a goal: a length, a place on the table, a heading, a side, the way that an order runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from grounding.edits.tokens import TO, Token, Tokens
from grounding.goals.parts import (
    DIRECTIONAL,
    WITH_DISTANCE,
    Part,
    PartReference,
    RelationPart,
    StructurePart,
    takes_key,
)
from grounding.spec import OPPOSITE, ROTATIONS, SIZES, X_POSITIONS, Y_POSITIONS, StructureSpec, slots_of
from grounding.structure_words import words_of

_ACROSS: Mapping[str, tuple[str, Sequence[str], int]] = {  # direction -> the slot, its values, and which way it goes
    "left": ("x_position", X_POSITIONS, -1), "right": ("x_position", X_POSITIONS, 1),
    "away": ("y_position", Y_POSITIONS, -1), "closer": ("y_position", Y_POSITIONS, 1),
}  # fmt: skip
_DIRECTION_OF = {"left of": "left", "right of": "right", "behind": "away", "in front of": "closer"}
_LENGTHS = ("gap", "radius", "length")
_SIZING = frozenset("wider longer bigger larger roomier looser shorter tighter narrower smaller".split())
_HALF = Token("angle", 180.0)


class CannotEdit(Exception):
    """An edit that a part cannot take; the message says why, and what to say instead."""


@dataclass(frozen=True)
class Standing:
    """What is known of a part besides the goal.

    Attributes:
        slots: that the arrangement which was shown realises, said or not.
        stood: whether the part is built already.
    """

    slots: StructureSpec = StructureSpec()
    stood: bool = False


PartEdit: TypeAlias = Callable[[Part, Tokens, Standing], Part]


def longer(part: Part, said: Tokens, known: Standing) -> Part:
    """Add to a length, or take from it: "5 cm more", "2 cm tighter"."""
    amount = said.value("length")
    metres = float(amount if amount is not None else 0.01 * float(said.value("number") or 0))  # of bare numbers: cm
    sign = float(said.value("change") or (1 if said.value("more") is not None else -1))
    moved_closer = isinstance(part, RelationPart) and part.relation == "moved" and part.direction == "closer"
    if moved_closer and said.value("less") in ("closer", "nearer"):
        sign = 1
    if said.value("less") in ("closer", "nearer") and said.value("key") is None and _given(part) is None:
        return _shifted(part, "closer", metres, known)
    key = _length_key(part, said)
    return _with_length(part, key, getattr(part, key) + sign * metres, known)


def scaled(part: Part, said: Tokens, known: Standing) -> Part:
    """Multiply a length: "double the gap", "half as far"; a structure without one is made larger or smaller."""
    if (
        isinstance(part, StructurePart)
        and said.value("key") is None
        and not any(getattr(part, key) for key in _LENGTHS)
    ):
        return _sized(part, 1 if float(said.value("factor") or 1) > 1 else -1, known)
    key = _length_key(part, said)
    return _with_length(part, key, getattr(part, key) * float(said.value("factor") or 1), known)


def as_long(part: Part, said: Tokens, known: Standing) -> Part:
    """Give a length another value: "a bit further, like 10 cm"."""
    metres = float(said.value("length") or 0)
    key = _length_key(part, said, given=False)
    now = getattr(part, key)
    compared = said.value("more") is not None or said.value("less") is not None
    told = said.value("be") == TO
    if compared and not told and now is not None and (metres > now) != (said.value("more") is not None):
        return longer(part, said, known)  # "a bit wider, like 2 cm" is meant on top
    return _with_length(part, key, metres, known)


def back(part: Part, said: Tokens, known: Standing) -> Part:
    """Take back some of a move: "back by 3"; of anything else, move it away."""
    metres = float(said.value("length") or 0.01 * float(said.value("number") or 0))
    if isinstance(part, RelationPart) and part.relation == "moved":
        return _with_length(part, "distance", (part.distance or 0.0) - metres, known)
    return _shifted(part, "away", metres, known)


def shifted(part: Part, said: Tokens, known: Standing) -> Part:
    """Move a part by centimetres: "move the line 5 cm to the left"."""
    metres = float(said.value("length") or 0.01 * float(said.value("number") or 0))
    if isinstance(part, RelationPart) and not {"more", "less"} & set(said.kinds.split()) and not known.stood:
        raise CannotEdit(f"is that the total or the increase? Say '{metres * 100:.4g} cm more', or the total")
    return _shifted(part, str(said.value("direction")), metres, known)


def resized(part: Part, said: Tokens, known: Standing) -> Part:
    """Make a structure a size larger or smaller: "bigger", "a bit tighter"."""
    word = str(said.value("more") or said.value("less"))
    if not isinstance(part, StructurePart) or word not in _SIZING:
        raise CannotEdit("how much? Say it in centimetres, for example '5 cm more'")
    if any(getattr(part, key) is not None for key in _LENGTHS):
        raise CannotEdit(f"how much {word}? Say it in centimetres, for example '5 cm {word}'")
    step = 1 if said.value("more") is not None else -1
    if part.size is None and known.slots.size is None and "size" in slots_of(part.shape):
        return replace(part, size=SIZES[-1 if step > 0 else 0])  # nothing is known of it: the largest, or the smallest
    return _sized(part, step, known)


def stepped(part: Part, said: Tokens, known: Standing) -> Part:
    """Move a part to the next place on the table: "a bit further left"."""
    direction = str(said.value("direction"))
    slot, values, step = _ACROSS[direction]
    if isinstance(part, RelationPart) and part.relation != "at":
        raise CannotEdit(f"how far? Say it in centimetres, for example '5 cm {_way(direction)}'")
    if isinstance(part, StructurePart) and slot not in slots_of(part.shape):
        raise CannotEdit(f"a {part.shape} cannot be placed there")
    now = getattr(part, slot) or getattr(known.slots, slot) or values[1]
    at = values.index(now) + step
    if not 0 <= at < len(values):
        raise CannotEdit(f"it is already on that side; after the build, '5 cm {_way(direction)}' moves it")
    new: dict[str, Any] = {slot: values[at]}
    return replace(part, **new)


def turned(part: Part, said: Tokens, known: Standing) -> Part:
    """Turn a structure by quarters: "turn it by 90 degrees", clockwise unless the other way is said."""
    if not isinstance(part, StructurePart):
        raise CannotEdit("only a structure can be turned, for example 'a line that faces left'")
    if "rotation" not in slots_of(part.shape):
        raise CannotEdit(f"a {part.shape} has no rotation: it looks the same from every side")
    sign = float(said.value("rotation") or (-1 if said.value("direction") == "left" else 1))
    quarters = float(said.value("angle") or (180 if said.value("way") is not None else 90)) / 90
    if quarters != int(quarters):
        raise CannotEdit("a structure turns in steps of 90 degrees; say 'turn it by 90 degrees'")
    now = part.rotation or known.slots.rotation
    if now is None:
        unrotated = words_of(part.shape).unrotated if part.shape else ""
        raise CannotEdit(f"{unrotated or 'which way should it face'}? Say 'facing left', or another side")
    if part.shape and words_of(part.shape).half_turn and quarters % 2 == 0:
        raise CannotEdit(words_of(part.shape).half_turn)
    return replace(part, rotation=ROTATIONS[(ROTATIONS.index(now) + int(sign * quarters)) % 4])


def other_side(part: Part, said: Tokens, known: Standing) -> Part:
    """Put a part on the opposite side of the table, or of what it is placed by."""
    if isinstance(part, RelationPart) and part.relation in DIRECTIONAL:
        return replace(part, relation=OPPOSITE[part.relation])
    if isinstance(part, RelationPart) and part.relation == "moved":
        return replace(part, direction=OPPOSITE[str(part.direction)])
    if isinstance(part, StructurePart) and part.along is not None:
        return replace(part, along=OPPOSITE[part.along])
    for slot, middle in (("x_position", "center"), ("y_position", "middle")):
        now = getattr(part, slot, None)
        if now is None and isinstance(part, StructurePart) and not (part.x_position or part.y_position):
            now = getattr(known.slots, slot) if slot in slots_of(part.shape) else None
        if now is not None and now != middle:
            new: dict[str, Any] = {slot: OPPOSITE[now]}
            return replace(part, **new)
    raise CannotEdit("it has no side yet; say which side it should be on, for example 'on the left'")


def other_way(part: Part, said: Tokens, known: Standing) -> Part:
    """Reverse a part: its order, the two that a relation names, or where it faces."""
    if isinstance(part, RelationPart):
        if (
            part.relation not in (*DIRECTIONAL, "on", "in")
            or isinstance(part.objects, PartReference)
            or part.reference is None
        ):
            raise CannotEdit(f"{part.relation!r} cannot be reversed")
        return replace(part, objects=part.reference, reference=part.objects)
    if part.order is None:
        if known.slots.rotation is None and part.rotation is None:
            raise CannotEdit("it has no order and no direction yet; say one, for example 'from short to tall'")
        return turned(part, replace(said, tokens=(*said.tokens, _HALF)), known)
    order = part.order
    if order.start is not None:
        return replace(part, order=replace(order, start=OPPOSITE[order.start]))
    if order.by == "listed":
        return replace(part, objects=(part.objects or ())[::-1])
    direction = "ascending" if order.direction == "descending" else "descending"
    return replace(part, order=replace(order, direction=direction))


def _sized(part: StructurePart, step: int, known: Standing) -> Part:
    if "size" not in slots_of(part.shape):
        raise CannotEdit(f"a {part.shape} has no size")
    at = SIZES.index(part.size or known.slots.size or SIZES[1]) + step
    if not 0 <= at < len(SIZES):
        raise CannotEdit(f"it is already {SIZES[at - step]}; give a length in centimetres, for example 'gap 10 cm'")
    return replace(part, size=SIZES[at])


def _given(part: Part) -> str | None:
    """Return the length that a part says, where it says one alone."""
    keys = [key for key in ("distance", *_LENGTHS) if getattr(part, key, None) is not None]
    return keys[0] if len(keys) == 1 else None


def _length_key(part: Part, said: Tokens, given: bool = True) -> str:
    """Return which length of a part is meant: the one that is named, or else the only one that it says."""
    key = str(said.value("key") or _given(part) or "")
    key = "radius" if key == "diameter" else key
    if isinstance(part, RelationPart):
        key = "distance" if part.relation in WITH_DISTANCE else ""
    elif key == "distance":
        key = "gap"
    legal = [each for each in _LENGTHS if takes_key(getattr(part, "shape", None), each)]
    if key != "distance" and key not in legal:
        example = f"; give one, for example '{legal[0]} 10 cm'" if legal else ""
        raise CannotEdit(f"it has no such length yet{example}")
    if given and getattr(part, key) is None:
        raise CannotEdit(f"it has no {key} yet; give one in centimetres, for example '{key} 10 cm'")
    return key


def _with_length(part: Part, key: str, metres: float, known: Standing) -> Part:
    if isinstance(part, RelationPart) and part.relation == "moved" and known.stood:
        metres -= part.distance or 0.0  # it stands that far away already
    if isinstance(part, RelationPart) and part.relation == "moved" and metres < 0:
        return replace(part, direction=OPPOSITE[str(part.direction)], distance=round(-metres, 6))
    if metres < 0 or (metres == 0 and key != "gap"):
        raise CannotEdit(f"its {key} would be {metres * 100:.4g} cm; give its length, for example '{key} 5 cm'")
    new: dict[str, Any] = {key: round(metres, 6)}
    return replace(part, **new)


def _shifted(part: Part, direction: str, metres: float, known: Standing) -> Part:
    """Return a part that goes some way further in a direction."""
    if (
        isinstance(part, RelationPart)
        and part.relation == "moved"
        and direction in (part.direction, OPPOSITE[str(part.direction)])
    ):
        sign = 1 if direction == part.direction else -1
        return _with_length(part, "distance", (part.distance or 0.0) + sign * metres, known)
    if (
        isinstance(part, RelationPart)
        and part.distance is not None
        and direction in ("away", "closer", *_line_of(part))
    ):
        outward = direction == (_DIRECTION_OF.get(part.relation) or "away") or (
            direction == "away" and not _line_of(part)
        )
        return _with_length(part, "distance", part.distance + (metres if outward else -metres), known)
    if known.stood and isinstance(part.objects, tuple):
        return RelationPart("moved", part.objects, direction=direction, distance=round(metres, 6))
    raise CannotEdit(
        "a move in centimetres starts from where the objects stand, and this is not built yet: build it first, or say "
        f"'further {_way(direction)}'"
    )


def _line_of(part: RelationPart) -> tuple[str, ...]:
    """Return the two directions along which a relation with a side runs."""
    own = _DIRECTION_OF.get(part.relation)
    return () if own is None else (own, OPPOSITE[own])


def _way(direction: str) -> str:
    return {"away": "back", "closer": "forward"}.get(direction, f"to the {direction}")

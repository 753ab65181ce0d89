"""Define the parts of a goal: structures with the five slots and further keys, and relations between objects.

Evaluation protocol, part two (`docs/protocol.md`). A key that was not requested is `None`, and stays so. Lengths are
metres; directions are the speaker's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeAlias

from grounding.spec import SLOTS, X_POSITIONS, Y_POSITIONS, SpecError, StructureSpec
from grounding.structure_words import KEYS, STRUCTURES, words_of

ORDER_KEYS = ("height", "width", "volume", "listed")
ORDER_DIRECTIONS = ("ascending", "descending")
_HEIGHTS = ("bottom", "top")
ORDER_STARTS = ("left", "right", "near", "far", *_HEIGHTS)
EDGES = ("near", "far", "left", "right")
GROUPINGS = ("colour", "kind")
DIRECTIONAL = ("left of", "right of", "in front of", "behind")
RELATIONS = (*DIRECTIONAL, "next to", "between", "on", "in", "at", "moved", "swapped")
MOVE_DIRECTIONS = ("left", "right", "away", "closer")
# Relations that take a clear distance, or the way of a move.
WITH_DISTANCE = (*DIRECTIONAL, "next to", "moved")
# Which shapes take which key.
SHAPES_OF_KEY: Mapping[str, tuple[str, ...]] = {
    key: tuple(shape for shape, words in STRUCTURES.items() if key in words.keys) for key in KEYS
}
MAX_LENGTH = 3.0  # m: longer than any table that an arm serves
MAX_ROWS = 20


class GoalError(SpecError):
    """A goal that is not legal; the message names the part, the key, the value and the legal values.

    Args:
        message: for somebody who wrote the goal as JSON.
        said: the same for somebody who spoke, without numbers of parts; "" where the message serves both.
        objects: whose names take the place of {} in `said`, in this order.
    """

    def __init__(self, message: str, said: str = "", objects: Sequence[int | str] = ()) -> None:
        super().__init__(message)
        self.said, self.objects = said, tuple(objects)

    def spoken(self, names: Sequence[str]) -> str:
        """Return the message for somebody who spoke of objects with these names."""
        cause = self.__cause__
        if not self.said:
            return cause.spoken(names) if isinstance(cause, GoalError) else str(cause or self)
        return self.said.format(*(names[each] if isinstance(each, int) else each for each in self.objects))


@dataclass(frozen=True)
class PartReference:
    """The structure of another part, as a whole, in place of objects.

    Attributes:
        part: its number among the goal's parts, from 0.
    """

    part: int


# Indices into the scene's objects, or the text's words where no scene is known; or the structure of another part.
Members: TypeAlias = tuple[int | str, ...]
Objects: TypeAlias = Members | PartReference


@dataclass(frozen=True)
class Order:
    """How the objects follow one another along a structure.

    Attributes:
        by: one of `ORDER_KEYS`; "listed" is the order of the part's objects.
        direction: one of `ORDER_DIRECTIONS`, or `None`.
        start: one of `ORDER_STARTS`: the end at which the order begins ("from" in JSON), or `None`.
    """

    by: str
    direction: str | None = None
    start: str | None = None

    def __post_init__(self) -> None:
        _require("order.by", self.by, ORDER_KEYS)
        _require("order.direction", self.direction, (*ORDER_DIRECTIONS, None))
        _require("order.from", self.start, (*ORDER_STARTS, None))

    def to_dict(self) -> dict[str, str | None]:
        """Return the order as JSON values."""
        return {"by": self.by, "direction": self.direction, "from": self.start}


@dataclass(frozen=True)
class StructurePart:
    """A structure that some of the objects form.

    Attributes:
        shape, size, x_position, y_position, rotation: the five slots (`grounding.spec`).
        objects: the objects of the structure; `None` means all objects that no other part names.
        order: how they follow one another; of a line, an arc or a tower.
        gap: clear distance between neighbours, metres.
        radius: of a circle or an arc, to the centroids, metres.
        length: of a line, between the centroids at its ends, metres.
        rows: of a grid; rows run left to right for the speaker.
        columns: of a grid.
        around: an object that the structure is laid around.
        along: the edge of the table that a line follows, one of `EDGES`.
        group_by: one of `GROUPINGS`: one cluster for each value.

    Raises:
        GoalError: for an illegal value, or a key that the shape does not take.
    """

    shape: str | None = None
    size: str | None = None
    x_position: str | None = None
    y_position: str | None = None
    rotation: str | None = None
    objects: Members | None = None
    order: Order | None = None
    gap: float | None = None
    radius: float | None = None
    length: float | None = None
    rows: int | None = None
    columns: int | None = None
    around: Members | None = None
    along: str | None = None
    group_by: str | None = None

    def __post_init__(self) -> None:
        _ = self.spec
        if isinstance(self.objects, PartReference):
            raise GoalError("the objects of a structure are objects, not another part")
        _require_objects("objects", self.objects)
        _require_objects("around", self.around, exactly=1)
        for key, shapes in SHAPES_OF_KEY.items():
            if getattr(self, key) is not None and not takes_key(self.shape, key):
                raise GoalError(
                    f"a {self.shape or 'structure without a shape'} cannot have the key {key}; shapes that can: "
                    f"{', '.join(shapes)}"
                )
        for key in ("gap", "radius", "length"):
            _require_length(key, getattr(self, key), zero=key == "gap")
        for key in ("rows", "columns"):
            value = getattr(self, key)
            if value is not None and not (type(value) is int and 1 <= value <= MAX_ROWS):
                raise GoalError(f"{key} cannot be {value!r}; legal values: 1 to {MAX_ROWS}")
        _require("along", self.along, (*EDGES, None))
        _require("group_by", self.group_by, (*GROUPINGS, None))
        if self.order is not None:
            self._check_order(self.order)
        if isinstance(self.objects, tuple) and set(self.around or ()) & set(self.objects):
            raise GoalError("the object that a structure is laid around cannot be one of its own objects")

    def _check_order(self, order: Order) -> None:
        _require(f"order.from of a {self.shape}", order.start, (*order_starts(self.shape), None))
        if order.by == "listed" and self.objects is None:
            raise GoalError("the order 'listed' needs the objects, one by one")

    @property
    def spec(self) -> StructureSpec:
        """Return the five slots."""
        return StructureSpec(*(getattr(self, slot) for slot in SLOTS))

    @property
    def keys(self) -> dict[str, Any]:
        """Return the further keys that were asked for."""
        return {key: value for key in KEYS if (value := getattr(self, key)) is not None}

    @classmethod
    def of(cls, spec: StructureSpec, objects: Sequence[int] | Sequence[str] | None = None) -> StructurePart:
        """Make the part of five slots and some objects."""
        return cls(**spec.to_dict(), objects=None if objects is None else tuple(objects))  # type: ignore[arg-type]

    @property
    def indices(self) -> tuple[int, ...]:
        """Return its objects where these are indices; empty where they are words, or all that are left."""
        return tuple(one for one in self.objects or () if isinstance(one, int))

    def to_dict(self) -> dict[str, Any]:
        """Return the part as JSON values."""
        values = {field.name: _json(getattr(self, field.name)) for field in fields(self)}
        return {"kind": "structure"} | values


@dataclass(frozen=True)
class RelationPart:
    """The place of some objects relative to others, to the table, or to their initial places.

    Attributes:
        relation: one of `RELATIONS`.
        objects: the objects to place; two for "swapped".
        reference: the reference objects: two for "between", none for "at", "moved" and "swapped".
        distance: the clear gap, or how far an object moves, metres.
        x_position, y_position: of "at", one of `X_POSITIONS` and `Y_POSITIONS`; a corner is both.
        direction: of "moved", one of `MOVE_DIRECTIONS`.

    Raises:
        GoalError: for an illegal value, or a key that the relation does not take.
    """

    relation: str
    objects: Objects
    reference: Objects | None = None
    distance: float | None = None
    x_position: str | None = None
    y_position: str | None = None
    direction: str | None = None

    def __post_init__(self) -> None:
        _require("relation", self.relation, RELATIONS)
        if self.objects is None:
            raise GoalError(f"the relation {self.relation!r} needs objects")
        _require_objects("objects", self.objects, exactly=2 if self.relation == "swapped" else None)
        alone = self.relation in ("at", "moved", "swapped")
        if alone and self.reference is not None:
            raise GoalError(f"the relation {self.relation!r} cannot have a reference")
        if not alone and self.reference is None:
            raise GoalError(f"the relation {self.relation!r} needs a reference")
        _require_objects("reference", self.reference, exactly=2 if self.relation == "between" else None)
        self._check_keys()
        if isinstance(self.objects, tuple) and isinstance(self.reference, tuple):
            shared = set(self.objects) & set(self.reference)
            if shared:
                one = sorted(shared, key=str)[0]
                raise GoalError(
                    f"an object cannot be {self.relation!r} itself: {one}",
                    f"{{}} cannot be {self.relation} itself",
                    (one,),
                )

    def _check_keys(self) -> None:
        if self.distance is not None and self.relation not in WITH_DISTANCE:
            raise GoalError(
                f"the relation {self.relation!r} cannot have a distance; those that can: {', '.join(WITH_DISTANCE)}"
            )
        _require_length("distance", self.distance, zero=self.relation != "moved")
        _require("x_position", self.x_position, (*X_POSITIONS, None))
        _require("y_position", self.y_position, (*Y_POSITIONS, None))
        _require("direction", self.direction, (*MOVE_DIRECTIONS, None))
        placed = self.x_position is not None or self.y_position is not None
        if placed != (self.relation == "at"):
            raise GoalError("the relation 'at' needs x_position or y_position, and no other relation takes them")
        if self.relation == "moved" and (self.direction is None or self.distance is None):
            raise GoalError("the relation 'moved' needs a direction and a distance")
        if self.relation != "moved" and self.direction is not None:
            raise GoalError(f"the relation {self.relation!r} cannot have a direction")

    def to_dict(self) -> dict[str, Any]:
        """Return the part as JSON values."""
        values = {field.name: _json(getattr(self, field.name)) for field in fields(self)}
        return {"kind": "relation"} | values


Part: TypeAlias = StructurePart | RelationPart


def takes_key(shape: str | None, key: str) -> bool:
    """Return whether a shape or figure takes a key, one of `KEYS`."""
    return shape is not None and key in words_of(shape).keys


def order_starts(shape: str | None) -> tuple[str, ...]:
    """Return the ends at which an order along a shape may begin, of `ORDER_STARTS`."""
    stacked = shape is not None and words_of(shape).stacked
    return tuple(start for start in ORDER_STARTS if (start in _HEIGHTS) == stacked)


def _require(key: str, value: Any, legal: Sequence[Any]) -> None:
    if value not in legal:
        listed = ", ".join("null" if each is None else each for each in legal)
        raise GoalError(f"{key} cannot be {value!r}; legal values: {listed}")


def _require_length(key: str, value: Any, zero: bool = False) -> None:
    if value is None:
        return
    number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if not number or value > MAX_LENGTH or value < 0 or (value == 0 and not zero):
        low = "0" if zero else "more than 0"
        raise GoalError(f"{key} cannot be {value!r} m; legal values: {low} to {MAX_LENGTH:g} m")


def _require_objects(key: str, objects: Any, exactly: int | None = None) -> None:
    if objects is None or isinstance(objects, PartReference):
        return
    each_legal = (
        isinstance(objects, tuple)
        and bool(objects)
        and (all(type(one) is int and one >= 0 for one in objects) or all(isinstance(one, str) for one in objects))
    )
    if not each_legal:
        raise GoalError(f"{key} cannot be {objects!r:.80}; legal: indices of objects, or words where no scene is known")
    if len(set(objects)) < len(objects):
        twice = next(each for place, each in enumerate(objects) if each in objects[:place])
        raise GoalError(f"{key} names an object twice: {objects!r:.80}", "{} is named twice", (twice,))
    if exactly is not None and len(objects) != exactly and not isinstance(objects[0], str):
        needed = f"{exactly} object{'s' * (exactly > 1)}"
        raise GoalError(f"{key} must name {needed}, not {len(objects)}", f"this takes {needed}, not {len(objects)}")


def _json(value: Any) -> Any:
    if isinstance(value, PartReference):
        return {"part": value.part}
    if isinstance(value, Order):
        return value.to_dict()
    return list(value) if isinstance(value, tuple) else value

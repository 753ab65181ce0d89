"""Define the goal of an instruction: one or more parts that must all hold together in the end.

Evaluation protocol, part two (`docs/protocol.md`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from grounding.goals.canonical import canonical_part, turned_part
from grounding.goals.description import describe_parts
from grounding.goals.parts import GoalError, Objects, Order, Part, PartReference, RelationPart, StructurePart
from grounding.spec import SpecError, StructureSpec

MAX_PARTS = 12  # more parts than a table has objects are no goal of a person


@dataclass(frozen=True)
class Goal:
    """The goal of an instruction: its parts in the order of the text; empty if it is refused.

    Raises:
        GoalError: for parts that cannot hold together: an object in two structures, two structures of all that
            remains, a reference to a part that is not there or is no structure.
    """

    parts: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        if len(self.parts) > MAX_PARTS:
            raise GoalError(f"{len(self.parts)} parts are more than a goal can have; legal: 1 to {MAX_PARTS}")
        owner: dict[int | str, int] = {}
        rest: int | None = None
        for number, part in enumerate(self.parts):
            if isinstance(part, RelationPart):
                for objects in (part.objects, part.reference):
                    self._check_reference(objects, number)
                continue
            if part.objects is None:
                if rest is not None:
                    raise GoalError(
                        f"parts {rest} and {number} both take all objects that no other part names",
                        "two structures of it take everything",
                    )
                rest = number
            for index in part.objects or ():
                if index in owner:
                    raise GoalError(
                        f"object {index!r} is in parts {owner[index]} and {number}; legal: one structure at most",
                        "{} would be in two structures", (index,),
                    )  # fmt: skip
                owner[index] = number

    def _check_reference(self, objects: Objects | None, number: int) -> None:
        if not isinstance(objects, PartReference):
            return
        structures = [i for i, part in enumerate(self.parts) if isinstance(part, StructurePart)]
        if objects.part not in structures:
            legal = ", ".join(map(str, structures)) or "none"
            raise GoalError(
                f"part {number} refers to part {objects.part}; structures that it can refer to: {legal}",
                "it is not clear which structure is meant",
            )

    @property
    def structures(self) -> tuple[StructurePart, ...]:
        """Return the structures among the parts."""
        return tuple(part for part in self.parts if isinstance(part, StructurePart))

    @property
    def relations(self) -> tuple[RelationPart, ...]:
        """Return the relations among the parts."""
        return tuple(part for part in self.parts if isinstance(part, RelationPart))

    @property
    def plain_spec(self) -> StructureSpec | None:
        """Return the five slots of a goal that is one structure without further keys, as in part one; else `None`."""
        if len(self.parts) == 1 and isinstance(self.parts[0], StructurePart) and not self.parts[0].keys:
            return self.parts[0].spec
        return None

    @property
    def is_open(self) -> bool:
        """Return whether the goal says nothing but which objects take part."""
        part = self.parts[0] if len(self.parts) == 1 else None
        return isinstance(part, StructurePart) and not part.keys and not part.spec.tokens()

    def named_objects(self) -> tuple[int | str, ...]:
        """Return every object that a part names, as object, reference or centre, in the order of the parts."""
        named: dict[int | str, None] = {}
        for part in self.parts:
            second = part.around if isinstance(part, StructurePart) else part.reference
            for objects in (part.objects, second):
                named.update(dict.fromkeys(objects if isinstance(objects, tuple) else ()))
        return tuple(named)

    def resolved(self, count: int) -> Goal:
        """Return the goal in a scene of `count` objects, with the objects of `objects: null` listed.

        Raises:
            GoalError: if a part takes all other objects, and there are none.
        """
        others = self.named_objects()
        rest = tuple(i for i in range(count) if i not in others)
        for number, part in enumerate(self.parts):
            if isinstance(part, StructurePart) and part.objects is None and not rest:
                raise GoalError(
                    f"part {number} takes all objects that no other part names, but there are none",
                    "nothing is left for a structure of everything else",
                )
        return Goal(tuple(
            replace(part, objects=rest) if isinstance(part, StructurePart) and part.objects is None else part
            for part in self.parts
        ))  # fmt: skip

    def turned(self) -> Goal:
        """Turn every direction by 180 degrees: the same goal, spoken from the opposite side."""
        return Goal(tuple(turned_part(part) for part in self.parts))

    def canonical(self) -> Goal:
        """Return the one spelling of the goal; see `canonical_part`."""
        return Goal(tuple(canonical_part(part) for part in self.parts))

    def to_dict(self) -> dict[str, Any]:
        """Return the goal as JSON values: every key of every part."""
        return {"parts": [part.to_dict() for part in self.parts]}

    def to_json(self) -> str:
        """Return the canonical JSON: every key, objects ascending where their order says nothing."""
        return json.dumps(self.canonical().to_dict(), separators=(", ", ": "))

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Goal:
        """Make the goal of JSON values; keys that are missing are `None`.

        A mapping of the five slots, as in files of part one, is the goal of one structure.

        Raises:
            GoalError: for anything that is not a legal goal; the message names the part, the value and the legal
                values.
        """
        if not isinstance(values, Mapping):
            raise GoalError(f"a goal is a JSON object with the key 'parts', not {values!r:.80}")
        if "parts" not in values:
            return cls((_part_from({"kind": "structure", **values}, 0),))
        if unknown := sorted(set(values) - {"parts"}):
            raise GoalError(f"unknown key {unknown[0]!r} of a goal; legal keys: parts")
        if not isinstance(values["parts"], (list, tuple)):
            raise GoalError(f"the parts of a goal are a list, not {values['parts']!r:.80}")
        return cls(tuple(_part_from(part, number) for number, part in enumerate(values["parts"])))

    def __str__(self) -> str:
        return describe_parts(self.parts) or "nothing"


def _part_from(values: Any, number: int) -> Part:
    if not isinstance(values, Mapping):
        raise GoalError(f"part {number} is a JSON object, not {values!r:.80}")
    kind = values.get("kind")
    made = {"structure": StructurePart, "relation": RelationPart}.get(kind)  # type: ignore[arg-type]
    if made is None:
        raise GoalError(f"part {number}: kind cannot be {kind!r}; legal values: structure, relation")
    legal = [field.name for field in fields(made)]
    entries = {key: value for key, value in values.items() if key != "kind"}
    if unknown := sorted(set(entries) - set(legal)):
        raise GoalError(f"part {number}: unknown key {unknown[0]!r} of a {kind}; legal keys: {', '.join(legal)}")
    try:
        for key in ("objects", "reference", "around"):
            if key in entries:
                entries[key] = _objects_from(entries[key])
        if entries.get("order") is not None:
            entries["order"] = _order_from(entries["order"])
        return made(**entries)
    except TypeError as error:
        raise GoalError(f"part {number}: {error}") from error
    except SpecError as error:
        raise GoalError(f"part {number}: {error}") from error


def _objects_from(value: Any) -> Any:
    if isinstance(value, Mapping):
        if set(value) != {"part"} or type(value["part"]) is not int:
            raise GoalError(f'a reference to a part is {{"part": NUMBER}}, not {value!r:.80}')
        return PartReference(value["part"])
    return tuple(value) if isinstance(value, list) else value


def _order_from(value: Any) -> Order:
    if not isinstance(value, Mapping) or "by" not in value or set(value) - {"by", "direction", "from"}:
        raise GoalError(f"an order has the keys by, direction and from, not {value!r:.80}")
    return Order(value["by"], value.get("direction"), value.get("from"))

"""Read goals as they are written in tests: "tower of 3, 4, left; 5 behind part 1; 2 moved left by 5 cm"."""

import re

from grounding.goals.goal import Goal
from grounding.goals.parts import ORDER_STARTS, RELATIONS, Order, PartReference, RelationPart, StructurePart
from grounding.spec import SHAPES, SIZES, X_POSITIONS, Y_POSITIONS
from grounding.structure_words import KEYS

_RELATION = re.compile(
    rf"(?P<objects>.+?) (?P<relation>{'|'.join(sorted(RELATIONS, key=len, reverse=True))})\b ?(?P<rest>.*)"
)


def goal_of_words(text: str) -> Goal:
    """Return the goal that `str` writes so; "nothing" is the goal without parts."""
    return Goal() if text in ("", "nothing") else Goal(tuple(_part(one.strip()) for one in text.split(";")))


def _part(text):
    shape, found, rest = text.partition(" of ")
    if found and shape in (*SHAPES, "structure"):
        return _structure(None if shape == "structure" else shape, [one.strip() for one in rest.split(",")])
    match = _RELATION.fullmatch(text)
    rest, _, length = match["rest"].partition("by ")
    values = {"distance": float(length.split()[0]) / 100} if length else {}
    words = rest.split()
    if match["relation"] == "at":
        values |= {"y_position" if word in Y_POSITIONS else "x_position": word for word in words}
    elif match["relation"] == "moved":
        values["direction"] = words[0]
    elif words:
        values["reference"] = _objects(rest.strip())
    return RelationPart(match["relation"], _objects(match["objects"]), **values)


def _structure(shape, items):
    objects = [int(one) for one in items if one.isdecimal()]
    values = {}
    for one in items:
        key, _, value = one.partition(" ")
        for slot, legal in (("size", SIZES), ("x_position", X_POSITIONS), ("y_position", Y_POSITIONS)):
            values |= {slot: one} if one in legal else {}
        if key == "facing":
            values["rotation"] = value
        elif key in ("rows", "columns"):
            values[key] = int(value)
        elif one.startswith("order by "):
            words = one.split()[2:]
            direction = next((word for word in words if word.endswith("scending")), None)
            values["order"] = Order(words[0], direction, next((word for word in words if word in ORDER_STARTS), None))
        elif one.startswith("group by "):
            values["group_by"] = one.split()[-1]
        elif key == "around":
            values["around"] = (int(value),)
        elif key in KEYS and value:
            values[key] = value if key == "along" else float(value.split()[0]) / 100
    return StructurePart(shape, objects=tuple(objects) or None, **values)


def _objects(text):
    if text.startswith("part "):
        return PartReference(int(text.split()[1]) - 1)
    return tuple(int(one) for one in text.split(","))

"""Generate the templated benchmark of goals: instructions of a grammar over goals, about the benchmark's scenes.

Every family of goals is in it. The instructions are enumerated and thinned evenly: nothing is drawn at random.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import Any

from grounding.goal_benchmark.rows import GoalRow, goal_scenes
from grounding.goals.goal import Goal
from grounding.goals.parts import Order, PartReference, RelationPart, StructurePart
from grounding.resolve.attributes import SceneObject

FAMILIES = (
    "two structures", "structure and relation", "relations", "metric", "order", "new shapes", "edges and groups",
    "single objects", "not to be built",
)  # fmt: skip
ROWS_OF_FAMILY = 400  # at most
_SCENES = (
    "breakfast", "cans and cups", "blocks", "tall and short", "fruit and plate", "desk", "workshop", "party", "dinner",
    "toys",
)  # fmt: skip

# Shape -> the fewest objects, and phrases of which {} are the objects.
_FIRST_SHAPES: Mapping[str, tuple[int, tuple[str, ...]]] = {
    "circle": (3, ("put {} in a circle", "arrange {} in a ring")),
    "line": (2, ("line up {}", "put {} in a row")),
    "tower": (2, ("stack {}", "pile {} on top of each other")),
}
_NEW_SHAPES: Mapping[str, tuple[int, tuple[str, ...]]] = {
    "cluster": (2, ("gather {}", "put {} together")),
    "rectangle": (4, ("arrange {} in a rectangle", "form a rectangle with {}")),
    "square": (4, ("arrange {} in a square", "form a square out of {}")),
    "triangle": (3, ("arrange {} in a triangle", "make a triangle out of {}")),
    "arc": (3, ("arrange {} in an arc", "lay {} out in an arc")),
    "grid": (4, ("arrange {} in a grid", "lay out {} as a grid")),
    "cross": (5, ("arrange {} in a cross", "make a cross with {}")),
    "pyramid": (3, ("build a pyramid with {}", "make a pyramid out of {}")),
}
_PLACES: tuple[tuple[str, dict[str, Any]], ...] = (  # how a place is said, and the slots of it
    ("", {}),
    (" on the left", {"x_position": "left"}),
    (" on the right", {"x_position": "right"}),
    (" at the back", {"y_position": "top"}),
    (" in the front left corner", {"x_position": "left", "y_position": "bottom"}),
    (" in the back right corner", {"x_position": "right", "y_position": "top"}),
)
_SIDES = (
    ("to the left of", "left of"),
    ("to the right of", "right of"),
    ("in front of", "in front of"),
    ("behind", "behind"),
)
_BESIDE = (*_SIDES, ("next to", "next to"))
_LENGTHS = (("5 cm", 0.05), ("80 mm", 0.08), ("2 inches", 0.0508), ("three centimetres", 0.03), ("0.1 m", 0.1))
_LONG = (("40 cm", 0.4), ("half a metre", 0.5), ("a foot", 0.3048))
_CORNERS = (
    ("top left", "left", "top"), ("top right", "right", "top"), ("bottom left", "left", "bottom"),
    ("bottom right", "right", "bottom"),
)  # fmt: skip
_EDGES = (("front", "near"), ("back", "far"), ("left", "left"), ("right", "right"))
_FLAT, _HOLLOW = ("plate", "box"), ("bowl", "mug", "cup")
# What can stand on another, and carry one: nobody can stack the rest.
_STACKABLE = ("block", "bowl", "box", "can", "cup", "jar", "mug", "plate", "tape")
_EQUAL = ("block", "can", "cup")  # what a pyramid can be built of
_IN_BOWLS = ("apple", "spoon", "marker", "ball", "block", "screwdriver")
_PLURALS = {"knife": "knives", "box": "boxes"}


@dataclass(frozen=True)
class _Words:
    """A phrase for some objects of a scene, and their indices."""

    text: str
    indices: tuple[int, ...]


def templated_goal_rows() -> list[GoalRow]:
    """List the instructions of the grammar; the strata are `FAMILIES`."""
    makers: tuple[Callable[[tuple[SceneObject, ...]], Iterator[tuple[str, Goal | str]]], ...] = (
        _two_structures, _structure_and_relation, _relations, _metric, _order, _new_shapes, _edges_and_groups,
        _single_objects, _not_to_be_built,
    )  # fmt: skip
    rows: list[GoalRow] = []
    for family, make in zip(FAMILIES, makers, strict=True):
        found = [
            GoalRow(
                text, scene, family, "ok" if isinstance(made, Goal) else made, (made,) if isinstance(made, Goal) else ()
            )
            for scene, objects in ((name, goal_scenes()[name]) for name in _SCENES)
            for text, made in make(objects)
        ]
        step = max(1.0, len(found) / ROWS_OF_FAMILY)
        rows += [found[int(k * step)] for k in range(int(len(found) / step))]
    return list({(row.text, row.scene): row for row in rows}.values())


def _kind(thing: SceneObject) -> str:
    return thing.name.rstrip(" 0123456789")


def _color(thing: SceneObject) -> str:
    assert thing.attributes is not None  # those of the benchmark are known
    return thing.attributes.colors[0]


def _plural(noun: str) -> str:
    return _PLURALS.get(noun, noun + "s")


def _groups(objects: tuple[SceneObject, ...], least: int = 2) -> list[_Words]:
    """Name the groups of `least` objects or more that a noun, or a colour and a noun, names."""
    found: dict[str, list[int]] = {}
    for i, thing in enumerate(objects):
        found.setdefault(f"the {_plural(_kind(thing))}", []).append(i)
        found.setdefault(f"the {_color(thing)} {_plural(_kind(thing))}", []).append(i)
    groups = [_Words(text, tuple(indices)) for text, indices in found.items() if len(indices) >= least]
    pairs = [
        _Words(f"{one.text} and {other.text}", tuple(sorted(one.indices + other.indices)))
        for one, other in combinations(_singles(objects), 2)
        if least <= 2
    ]
    return groups + pairs[:6]


def _singles(objects: tuple[SceneObject, ...]) -> list[_Words]:
    """Name each object that a noun, or a colour and a noun, tells from all others."""
    kinds = [_kind(thing) for thing in objects]
    full = [f"{_color(thing)} {kind}" for thing, kind in zip(objects, kinds)]
    found = []
    for i, kind in enumerate(kinds):
        if kinds.count(kind) == 1:
            found.append(_Words(f"the {kind}", (i,)))
        elif full.count(full[i]) == 1:
            found.append(_Words(f"the {full[i]}", (i,)))
    return found


def _structures(
    objects: tuple[SceneObject, ...], shapes: Mapping[str, tuple[int, tuple[str, ...]]]
) -> Iterator[tuple[str, str, _Words]]:
    """Give (clause, shape, objects) of every shape and group that it can be made of."""
    for shape, (least, phrases) in shapes.items():
        for k, group in enumerate(_groups(objects, least)):
            if not _suits(shape, group, objects):
                continue
            yield phrases[k % len(phrases)].format(group.text), shape, group


def _suits(shape: str, group: _Words, objects: tuple[SceneObject, ...]) -> bool:
    """Tell whether a person would build this shape of these objects."""
    usable = {"tower": _STACKABLE, "pyramid": _EQUAL}.get(shape)
    return usable is None or all(_kind(objects[i]) in usable for i in group.indices)


def _goal(*parts: Any) -> Goal:
    return Goal(tuple(parts))


def _two_structures(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    clauses = list(_structures(objects, {**_FIRST_SHAPES, **_NEW_SHAPES}))
    joins = (" and ", ", then ", ". Then ", " and also ")
    for k, (one, other) in enumerate(permutations(clauses, 2)):
        if set(one[2].indices) & set(other[2].indices):
            continue
        (where, place), (there, elsewhere) = (_PLACES[k % 6], _PLACES[(k // 6 + 2) % 6])
        text = f"{one[0]}{where}{joins[k % 4]}{other[0]}{there}"
        yield (
            text,
            _goal(
                StructurePart(one[1], objects=one[2].indices, **place),
                StructurePart(other[1], objects=other[2].indices, **elsewhere),
            ),
        )


def _structure_and_relation(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    for k, (clause, shape, group) in enumerate(_structures(objects, {**_FIRST_SHAPES, **_NEW_SHAPES})):
        structure = StructurePart(shape, objects=group.indices)
        for n, one in enumerate(one for one in _singles(objects) if one.indices[0] not in group.indices):
            phrase, relation = _BESIDE[(k + n) % len(_BESIDE)]
            after = RelationPart(relation, one.indices, PartReference(0))
            yield f"{clause} and put {one.text} {phrase} it", _goal(structure, after)
            whole = RelationPart(relation, PartReference(0), one.indices)
            yield f"{clause} {phrase} {one.text}", _goal(structure, whole)


def _relations(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    singles = _singles(objects)
    for k, (a, b, c) in enumerate(permutations(singles, 3)):
        phrase, relation = _BESIDE[k % 5]
        first = RelationPart(relation, a.indices, b.indices)
        if k % 3 == 0:
            yield (
                f"put {a.text} between {b.text} and {c.text}",
                _goal(RelationPart("between", a.indices, (*b.indices, *c.indices))),
            )
        elif k % 3 == 1:
            phrase2, relation2 = _BESIDE[(k // 5) % 5]
            text = f"put {a.text} {phrase} {b.text} and {c.text} {phrase2} {b.text}"
            yield text, _goal(first, RelationPart(relation2, c.indices, b.indices))
        else:
            yield f"put {a.text} {phrase} {b.text}", _goal(first)
    for a, b, c, d in combinations(singles, 4):
        text = f"put {a.text} to the left of {b.text}, then put {c.text} behind {d.text}"
        yield text, _goal(RelationPart("left of", a.indices, b.indices), RelationPart("behind", c.indices, d.indices))


def _metric(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    singles = _singles(objects)
    for k, group in enumerate(_groups(objects)):
        words, gap = _LENGTHS[k % 5]
        yield f"put {group.text} in a row, {words} apart", _goal(StructurePart("line", objects=group.indices, gap=gap))
        yield (
            f"line up {group.text} with {words} between them",
            _goal(StructurePart("line", objects=group.indices, gap=gap)),
        )
        words, length = _LONG[k % 3]
        yield (
            f"make a line {words} long out of {group.text}",
            _goal(StructurePart("line", objects=group.indices, length=length)),
        )
    for group in _groups(objects, 3):
        for words, radius in (("15 cm", 0.15), ("six inches", 0.1524), ("120 mm", 0.12)):
            structure = StructurePart("circle", objects=group.indices, radius=radius)
            yield f"put {group.text} in a circle with a radius of {words}", _goal(structure)
    for k, (a, b) in enumerate(permutations(singles, 2)):
        (words, distance), (phrase, relation) = _LENGTHS[k % 5], _SIDES[k % 4]
        yield f"put {a.text} {words} {phrase} {b.text}", _goal(RelationPart(relation, a.indices, b.indices, distance))
    ways = (("to the left", "left"), ("to the right", "right"), ("away from me", "away"), ("towards me", "closer"))
    for k, one in enumerate(singles):
        for n, (phrase, direction) in enumerate(ways):
            words, distance = _LENGTHS[(k + n) % 5]
            moved = RelationPart("moved", one.indices, distance=distance, direction=direction)
            yield f"move {one.text} {words} {phrase}", _goal(moved)


def _order(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    ways = (
        ("line", "line up {} by height, tallest on the left", Order("height", "descending", "left")),
        ("line", "line up {} by height, shortest on the left", Order("height", "ascending", "left")),
        ("line", "put {} in a row from short to tall", Order("height", "ascending")),
        ("line", "line up {} by size, the biggest on the right", Order("volume", "descending", "right")),
        ("line", "put {} in a row from largest to smallest", Order("volume", "descending")),
        ("line", "line up {} by width, the widest nearest to me", Order("width", "descending", "near")),
        ("line", "put {} in a row by height", Order("height")),
        ("tower", "stack {} with the biggest at the bottom", Order("volume", "descending", "bottom")),
        ("tower", "stack {} with the tallest at the bottom", Order("height", "descending", "bottom")),
        ("arc", "arrange {} in an arc from short to tall", Order("height", "ascending")),
    )
    for shape, phrase, order in ways:
        for group in _groups(objects, 3 if shape == "arc" else 2):
            if not _suits(shape, group, objects):
                continue
            yield phrase.format(group.text), _goal(StructurePart(shape, objects=group.indices, order=order))
    for k, (a, b, c) in enumerate(permutations(_singles(objects), 3)):
        indices = (*a.indices, *b.indices, *c.indices)
        named = f"{a.text}, {b.text} and {c.text}"
        if k % 2 or not _suits("tower", _Words("", indices), objects):
            part = StructurePart("line", objects=indices, order=Order("listed", None, "left"))
            yield f"put {named} in a row in this order from left to right", _goal(part)
        else:
            part = StructurePart("tower", objects=indices, order=Order("listed", None, "bottom"))
            yield f"stack {named} in this order from bottom to top", _goal(part)


def _new_shapes(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    shapes = {shape: (least, phrases) for shape, (least, phrases) in _NEW_SHAPES.items()}
    for clause, shape, group in _structures(objects, shapes):
        for where, place in _PLACES:
            yield clause + where, _goal(StructurePart(shape, objects=group.indices, **place))
    for shape, (least, phrases) in shapes.items():
        everything = _Words("", tuple(range(len(objects))))
        if least <= len(objects) and _suits(shape, everything, objects):
            for phrase in phrases:
                yield phrase.format("everything"), _goal(StructurePart(shape))
    for rows, columns in ((3, 3), (2, 4), (4, 2), (2, 3), (3, 2)):
        if (rows - 1) * columns < len(objects) <= rows * columns:
            yield (
                f"arrange all objects in a {rows} by {columns} grid",
                _goal(StructurePart("grid", rows=rows, columns=columns)),
            )


def _edges_and_groups(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    for group in _groups(objects):
        for side, edge in _EDGES:
            yield (
                f"line up {group.text} along the {side} edge",
                _goal(StructurePart("line", objects=group.indices, along=edge)),
            )
    for side, edge in _EDGES:
        yield f"put everything in a row along the {side} edge of the table", _goal(StructurePart("line", along=edge))
    for text, key in (("colour", "colour"), ("color", "colour"), ("kind", "kind"), ("type", "kind")):
        yield f"sort everything by {text}", _goal(StructurePart("cluster", group_by=key))
        yield f"group all the objects by {text}", _goal(StructurePart("cluster", group_by=key))
    for group in _groups(objects, 3):
        yield f"sort {group.text} by colour", _goal(StructurePart("cluster", objects=group.indices, group_by="colour"))
        for one in _singles(objects):
            if one.indices[0] not in group.indices:
                part = StructurePart("circle", objects=group.indices, around=one.indices)
                yield f"put {group.text} in a circle around {one.text}", _goal(part)


def _single_objects(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, Goal]]:
    singles = _singles(objects)
    for one in singles:
        for words, x, y in _CORNERS:
            yield (
                f"put {one.text} in the {words} corner",
                _goal(RelationPart("at", one.indices, x_position=x, y_position=y)),
            )
        yield f"put {one.text} on the left side of the table", _goal(RelationPart("at", one.indices, x_position="left"))
        yield (
            f"move {one.text} to the right side of the table",
            _goal(RelationPart("at", one.indices, x_position="right")),
        )
    for k, (one, other) in enumerate(combinations(singles, 2)):
        verb = ("swap {} and {}", "swap the places of {} and {}")[k % 2]
        yield verb.format(one.text, other.text), _goal(RelationPart("swapped", (*one.indices, *other.indices)))
    for one, other in permutations(singles, 2):
        if _kind(objects[other.indices[0]]) in _FLAT and _kind(objects[one.indices[0]]) in (*_STACKABLE, *_IN_BOWLS):
            yield f"put {one.text} on {other.text}", _goal(RelationPart("on", one.indices, other.indices))
        if _kind(objects[other.indices[0]]) in _HOLLOW and _kind(objects[one.indices[0]]) in _IN_BOWLS:
            yield f"put {one.text} in {other.text}", _goal(RelationPart("in", one.indices, other.indices))


def _not_to_be_built(objects: tuple[SceneObject, ...]) -> Iterator[tuple[str, str]]:
    singles = _singles(objects)
    kinds = {_kind(thing) for thing in objects}
    absent: Iterable[str] = [noun for noun in ("teapot", "lamp", "candle", "vase", "pencil") if noun not in kinds]
    for k, one in enumerate(singles):
        for phrase, _ in _BESIDE:
            yield f"put the {list(absent)[k % 5]} {phrase} {one.text}", "refused"
        yield f"put {one.text} in the corner", "ask"
        yield f"throw {one.text} away", "refused"
    for one, other in combinations(singles, 2):
        for phrase, _ in _SIDES:
            yield f"put {one.text} {phrase} {other.text} and {other.text} {phrase} {one.text}", "refused"
    for group in _groups(objects, 3):
        yield f"write the letter A with {group.text}", "refused"
        yield f"build a bridge out of {group.text}", "refused"

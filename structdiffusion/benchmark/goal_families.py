"""Draw the goals of the goal benchmark, family by family, with the objects on the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from grounding.goals.goal import Goal
from grounding.goals.parts import (
    DIRECTIONAL,
    MOVE_DIRECTIONS,
    Order,
    Part,
    PartReference,
    RelationPart,
    StructurePart,
)
from grounding.spec import ROTATIONS, SLOTS_OF_SHAPE, X_POSITIONS, Y_POSITIONS
from structdiffusion.data.scene_sampling import SceneError, eligible
from structdiffusion.evaluation_protocol import ORDER_TIE
from structdiffusion.objects.model import ObjectModel
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.structure import LayoutError

NEW_SHAPES = ("cluster", "rectangle", "square", "triangle", "arc", "grid", "cross", "pyramid")
_COMPOSED = ("line", "circle", "tower", "cluster", "triangle", "arc")
# Fewest and most objects of a structure, where it stands beside others and by itself.
_COUNTS: Mapping[str, tuple[int, int]] = {
    "line": (2, 4), "circle": (3, 4), "tower": (2, 3), "cluster": (2, 4), "triangle": (3, 3), "arc": (3, 4),
    "rectangle": (4, 6), "square": (4, 4), "grid": (4, 6), "cross": (5, 5), "pyramid": (3, 3),
}  # fmt: skip
_HOLLOW = ("bowl", "mug", "cup", "pan")
_LEAST_STEP = 2 * ORDER_TIE  # m between the measures of objects that are ordered: a person sees that
_LENGTHS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.08)  # m: gaps and distances that are asked for
Rng = np.random.Generator


@dataclass(frozen=True)
class DrawnGoal:
    """The objects of a scene and a goal for them.

    Attributes:
        models: the N objects.
        goal: with indices into them.
        kind: which of its family's kinds it is, such as a shape or a relation.
    """

    models: tuple[ObjectModel, ...]
    goal: Goal
    kind: str


class Cast:
    """Choose objects of a library for a scene, each at most once.

    Attributes:
        chosen: the objects so far; indices count in it.
    """

    def __init__(self, library: Sequence[ObjectModel], rng: Rng) -> None:
        self._library, self._rng = library, rng
        self.chosen: list[ObjectModel] = []

    def structure(self, shape: str, count: int | None = None) -> tuple[int, ...]:
        """Choose the objects of a structure; return their indices.

        Raises:
            SceneError: if too few of the others suit it.
        """
        low, high = _COUNTS[shape]
        wanted = int(self._rng.integers(low, high + 1)) if count is None else count
        pool = self._free(eligible(self._library, shape))
        try:
            models = STRUCTURES[shape].choose(pool, wanted, self._rng, named=False)
        except LayoutError as error:
            raise SceneError(str(error)) from error
        if len(models) < max(STRUCTURES[shape].least, wanted if count is not None else 0):
            raise SceneError(f"only {len(models)} of the other objects suit a {shape}")
        return self.add(models)

    def single(self, suits: Callable[[ObjectModel], bool] = lambda model: True) -> int:
        """Choose an object that stands level and suits; return its index.

        Raises:
            SceneError: if there is none.
        """
        pool = [model for model in self._free(eligible(self._library, None)) if suits(model) and model.radius < 0.09]
        if not pool:
            raise SceneError("no other object of the library suits")
        return self.add(pool[:1])[0]

    def add(self, models: Sequence[ObjectModel]) -> tuple[int, ...]:
        """Add objects; return their indices."""
        first = len(self.chosen)
        self.chosen += models
        return tuple(range(first, first + len(models)))

    def free(self, shape: str | None) -> list[ObjectModel]:
        """Return the objects that suit a shape and are not chosen, in random order."""
        return self._free(eligible(self._library, shape))

    def _free(self, pool: Sequence[ObjectModel]) -> list[ObjectModel]:
        taken = {model.name for model in self.chosen}
        rest = [model for model in pool if model.name not in taken]
        return [rest[i] for i in self._rng.permutation(len(rest))]


def draw_goal(family: Family, library: Sequence[ObjectModel], number: int, rng: Rng) -> DrawnGoal:
    """Draw the objects and the goal of a scene; the kinds of a family take turns by its number.

    Raises:
        SceneError: if the library lacks objects for it.
    """
    draw, kinds = family
    possible = [kind for kind in kinds if kind not in _NEEDS or any(map(_NEEDS[kind], library))]
    kind = possible[number % len(possible)]
    cast = Cast(library, rng)
    parts = draw(cast, kind, rng)
    for _ in range(int(rng.integers(0, 2))):  # what no part names
        cast.single(lambda model: model.radius < 0.06)
    return DrawnGoal(tuple(cast.chosen), Goal(tuple(parts)), kind)


def _one(rng: Rng, values: Sequence[Any]) -> Any:
    return values[int(rng.integers(len(values)))]


def _two_structures(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    first, second = cast.structure(kind), cast.structure(other := str(rng.choice(_COMPOSED)))
    places: list[dict[str, Any]] = [{}, {}]
    if (sides := rng.random()) < 0.5:
        left = int(rng.integers(2))
        places[left], places[1 - left] = {"x_position": "left"}, {"x_position": "right"}
    elif sides < 0.7:
        places[int(rng.integers(2))] = {"x_position": str(rng.choice(X_POSITIONS))}
    return [StructurePart(kind, objects=first, **places[0]), StructurePart(other, objects=second, **places[1])]


def _structure_and_relation(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    shape = str(rng.choice(("line", "circle", "tower", "cluster", "arc")))
    structure, single = cast.structure(shape), (cast.single(lambda model: model.radius < 0.07),)
    whole = rng.random() < 0.3
    objects, reference = (PartReference(0), single) if whole else (single, PartReference(0))
    return [StructurePart(shape, objects=structure), RelationPart(kind, objects, reference)]


def _relations(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    count = int(kind.split()[0])
    placed = [cast.single(_small), cast.single(_small)]  # these stay
    parts: list[Part] = []
    for _ in range(count):
        relation = str(rng.choice((*DIRECTIONAL, "next to", "between")))
        one = cast.single(_small)
        references = 2 if relation == "between" else 1
        # Mostly the ones that stay: where everything hangs on one chain, one misfit spoils the whole.
        near = placed[:2] if rng.random() < 0.6 else placed[-2:]
        chosen = tuple(int(i) for i in rng.permutation(near)[:references])
        parts.append(RelationPart(relation, (one,), chosen))
        placed.append(one)
    return parts


def _metric(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    if kind == "gap":
        return [StructurePart("line", objects=cast.structure("line"), gap=float(_one(rng, _LENGTHS)))]
    if kind == "length":
        members = cast.structure("line")
        least = sum(2 * cast.chosen[i].radius for i in members)
        return [StructurePart("line", objects=members, length=round(float(rng.uniform(least, least + 0.25)), 2))]
    if kind.startswith("radius"):
        shape = kind.split()[-1]
        members = cast.structure(shape)
        # Neighbours on the ring must clear each other; twice the mean reach is about what they need.
        least = sum(2 * cast.chosen[i].radius + 0.02 for i in members) / (2 * np.pi if shape == "circle" else np.pi)
        return [
            StructurePart(
                shape, objects=members, radius=round(float(np.clip(rng.uniform(least, least + 0.07), 0.08, 0.2)), 2)
            )
        ]
    if kind == "moved":
        one, distance = cast.single(), float(_one(rng, (0.05, 0.08, 0.1, 0.15, 0.2)))
        return [RelationPart("moved", (one,), distance=distance, direction=str(rng.choice(MOVE_DIRECTIONS)))]
    relation = "next to" if kind == "distance next to" else str(rng.choice(DIRECTIONAL))
    reference, one = cast.single(_small), cast.single(_small)
    return [RelationPart(relation, (one,), (reference,), distance=float(_one(rng, _LENGTHS)))]


def _order(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    shape, by = kind.split(" by ")
    if by == "listed":
        listed = list(cast.structure(shape, 3 if shape == "line" else 2))
        if shape == "line":  # a tower of these stands as it was chosen: what cannot carry is on top
            rng.shuffle(listed)
        first = "bottom" if shape == "tower" else str(rng.choice(("left", "right", "near", "far")))
        return [StructurePart(shape, objects=tuple(listed), order=Order("listed", None, first))]
    models = _apart(cast.free(shape), by, int(rng.integers(3, 5)) if shape == "line" else 3, rng)
    members = cast.add(models)
    if shape == "tower":
        return [StructurePart(shape, objects=members, order=Order(by, "descending", "bottom"))]
    start = None if shape == "arc" else _one(rng, ("left", "right", "near", "far"))
    order = Order(by, str(rng.choice(("ascending", "descending"))), start)
    return [StructurePart(shape, objects=members, order=order)]


def measure(model: ObjectModel, by: str) -> float:
    """Return the true measure, metres, that an order goes by; of a volume the cube root."""
    length, width = sorted(np.ptp(model.footprint, axis=0))[::-1]
    if by == "height":
        return model.height
    return float(width) if by == "width" else float(np.cbrt(length * width * model.height))


def _apart(pool: Sequence[ObjectModel], by: str, count: int, rng: Rng) -> list[ObjectModel]:
    """Return up to `count` objects, in random order, whose measures differ by a step that a person sees.

    Raises:
        SceneError: if there are fewer than three.
    """
    found: list[ObjectModel] = []
    for model in sorted(pool[: 8 * count], key=lambda model: measure(model, by)):
        if not found or measure(model, by) - measure(found[-1], by) > _LEAST_STEP:
            found.append(model)
    if len(found) < 3:
        raise SceneError(f"only {len(found)} objects differ enough in {by}")
    return [found[i] for i in rng.permutation(len(found))[:count]]


def _new_shapes(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    values: dict[str, Any] = {}
    if kind == "grid" and rng.random() < 0.5:
        values["rows"], values["columns"] = _one(rng, ((2, 2), (2, 3), (3, 2)))
    members = cast.structure(kind, values["rows"] * values["columns"] if values else None)
    slots = SLOTS_OF_SHAPE[kind]
    for slot, legal, share in (
        ("x_position", X_POSITIONS, 0.3),
        ("y_position", Y_POSITIONS, 0.2),
        ("rotation", ROTATIONS, 0.4),
    ):
        if slot in slots and rng.random() < share:
            values[slot] = str(rng.choice(legal))
    return [StructurePart(kind, objects=members, **values)]


def _edges_and_groups(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    if kind.startswith("along"):
        return [StructurePart("line", objects=cast.structure("line"), along=kind.split()[1])]
    if kind.startswith("around"):
        middle = cast.single(_small)
        shape = kind.split()[1]
        return [StructurePart(shape, objects=cast.structure(shape, 4), around=(middle,))]
    by = kind.split()[1]
    groups: dict[str, list[ObjectModel]] = {}
    for model in cast.free("cluster"):
        if model.radius < 0.06:
            groups.setdefault(color_of(model) if by == "colour" else model.category, []).append(model)
    usable = [group for group in groups.values() if len(group) >= 2]
    if len(usable) < 2:
        raise SceneError(f"the library has no two groups of one {by}")
    chosen = [usable[i] for i in rng.permutation(len(usable))[: int(rng.integers(2, 4))]]
    members = cast.add([model for group in chosen for model in group[: int(rng.integers(2, 4))]])
    return [StructurePart("cluster", objects=members, group_by=by)]


def _single_objects(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    if kind == "in":
        outer = cast.single(lambda model: model.category in _HOLLOW)
        room = 0.6 * cast.chosen[outer].radius
        return [RelationPart("in", (cast.single(lambda model: model.radius < room),), (outer,))]
    if kind == "on":
        below = cast.single(lambda model: model.stackable and model.height < 0.12)
        room = cast.chosen[below].radius
        return [RelationPart("on", (cast.single(lambda model: model.radius < room),), (below,))]
    one, other = cast.single(_small), cast.single(_small)
    if kind == "swapped":
        return [RelationPart("swapped", (one, other))]
    if kind == "next to":
        return [RelationPart("next to", (one,), (other,))]
    x, y = str(rng.choice(X_POSITIONS)), str(rng.choice(Y_POSITIONS))
    if kind == "at corner":
        x, y = str(rng.choice(("left", "right"))), str(rng.choice(("top", "bottom")))
        return [RelationPart("at", (one,), x_position=x, y_position=y)]
    return [
        RelationPart("at", (one,), x_position=x) if rng.random() < 0.5 else RelationPart("at", (one,), y_position=y)
    ]


def _small(model: ObjectModel) -> bool:
    return model.radius < 0.07


def color_of(model: ObjectModel) -> str:
    """Return the colour's name of a toy block; "" for other objects, whose colours are not one."""
    return model.name.rsplit("_", 1)[-1] if model.source == "blocks" else ""


# How a family is drawn, and its kinds, which take turns.
Family: TypeAlias = tuple[Callable[[Cast, str, Rng], list[Part]], tuple[str, ...]]
FAMILIES: Mapping[str, Family] = {
    "two-structures": (_two_structures, _COMPOSED),
    "structure-and-relation": (_structure_and_relation, (*DIRECTIONAL, "next to")),
    "relations": (_relations, ("2 relations", "3 relations", "4 relations")),
    "metric": (_metric, ("gap", "radius circle", "length", "distance", "moved", "radius arc", "distance next to")),
    "order": (
        _order,
        ("line by height", "line by width", "line by volume", "line by listed", "tower by listed", "arc by height"),
    ),
    "new-shapes": (_new_shapes, NEW_SHAPES),
    "edges-and-groups": (
        _edges_and_groups,
        ("along near", "group kind", "along far", "around circle", "along left", "group colour", "along right"),
    ),
    "single-objects": (_single_objects, ("at corner", "on", "swapped", "in", "at side", "next to")),
}
# Kinds that need objects that some libraries do not have.
_NEEDS: Mapping[str, Callable[[ObjectModel], bool]] = {
    "in": lambda model: model.category in _HOLLOW,
    "group colour": lambda model: bool(color_of(model)),
}

"""Relate a goal of several parts to a table: the objects to move, their order, and their initial poses."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.arm.placement_rules import ObstacleKey, PlacementRules
from agent.errors import NotBuildable
from agent.scenes.limits import MOST_OBJECTS
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Part, PartReference, RelationPart, StructurePart
from grounding.spec import FIRST_SHAPES, StructureSpec
from grounding.structure_words import words_of
from structdiffusion.data.scene_sampling import SceneError

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from structdiffusion.observation import Scene


@dataclass(frozen=True)
class TableGoal:
    """A goal over the objects of one table.

    Attributes:
        goal: the parts; every object is an index into `names`, and every structure lists its objects.
        names: of the N objects that were seen.
        world_from_initial: (N, 4, 4) their poses before anything was moved.
        colors: the name of each object's colour, empty if unknown.
        unseen: name -> world_from_initial (4, 4) of what else stands on the table.
    """

    goal: Goal
    names: tuple[str, ...]
    world_from_initial: np.ndarray
    colors: tuple[str, ...] = ()
    unseen: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def movable(self) -> tuple[int, ...]:
        """Return the objects that the parts place, ascending; reference objects move only to make room."""
        return tuple(sorted({index for part in self.goal.parts for index in _listed(part.objects)}))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return one line for each part: "line of mug, mug 2, left"."""
        return described_parts(self.goal, self.names)

    @property
    def all_names(self) -> tuple[str, ...]:
        """Return the names of all objects on the table, observed ones first."""
        return (*self.names, *self.unseen)

    @property
    def all_initial(self) -> np.ndarray:
        """Return the poses (M, 4, 4) of `all_names` before anything was moved."""
        return np.array([*self.world_from_initial, *self.unseen.values()])

    def set_aside(self, moved: Collection[str]) -> tuple[int, ...]:
        """Return the objects that are moved only to make room, which no part names."""
        named = self.goal.named_objects()
        return tuple(i for i, name in enumerate(self.names) if name in moved and i not in named)

    def parts_of(self, name: str) -> tuple[int, ...]:
        """Return the numbers of the parts that name an object, as one that they place or by which they place others."""
        index = self.names.index(name)
        return tuple(number for number, part in enumerate(self.goal.parts) if index in self._named_by(part))

    def without(self, gone: Collection[str], fulfilled: Collection[int] = ()) -> TableGoal | None:
        """Return the goal for what is left, or `None` if a part cannot hold without what is gone, or none is left.

        Args:
            gone: the names of the objects that are not on the table any more.
            fulfilled: the numbers of parts that are left out, because they hold already.
        """
        lost = {index for index, name in enumerate(self.names) if name in gone}
        parts, number = list[Part](), dict[int, int]()
        for old, part in enumerate(self.goal.parts):
            left = tuple(index for index in _listed(part.objects) if index not in lost)
            short = len(left) < len(_listed(part.objects))
            second = part.around if isinstance(part, StructurePart) else part.reference
            if lost.intersection(_listed(second)) or (short and not _may_be_short(part, len(left))):
                return None
            if old in fulfilled or (short and not left):
                continue
            if any(isinstance(each, PartReference) and each.part not in number for each in (part.objects, second)):
                return None
            number[old] = len(parts)
            parts.append(_pointing(replace(part, objects=left) if left else part, number))
        kept = [index for index in range(len(self.names)) if index not in lost]
        if not parts:
            return None
        return replace(
            self,
            goal=renumbered(Goal(tuple(parts)), {index: place for place, index in enumerate(kept)}),
            names=tuple(self.names[index] for index in kept),
            world_from_initial=self.world_from_initial[kept],
            colors=tuple(self.colors[index] for index in kept) if self.colors else (),
            unseen={name: pose for name, pose in self.unseen.items() if name not in gone},
        )

    def placement_rules(self, scene: Scene) -> PlacementRules:
        """Return the rules for the order and the collisions of placements that follow from the relations "on" and "in".

        Args:
            scene: with the objects that are moved, and the others as distractors.
        """
        moved = {cloud.name: index for index, cloud in enumerate(scene.objects)}
        stays = {cloud.name: index for index, cloud in enumerate(scene.distractors)}
        after: dict[int, set[int]] = {}
        into: dict[int, set[ObstacleKey]] = {}
        for part in self.goal.relations:
            if part.relation not in ("on", "in"):
                continue
            references = [self.names[index] for index in self._members(part.reference)]
            for name in (self.names[index] for index in self._members(part.objects)):
                if name not in moved:
                    continue
                after.setdefault(moved[name], set()).update(moved[each] for each in references if each in moved)
                if part.relation == "in":
                    into.setdefault(moved[name], set()).update(
                        moved[each] if each in moved else ("distractor", stays[each]) for each in references
                    )
        return PlacementRules(
            {index: frozenset(those) for index, those in after.items()},
            {index: frozenset(those) for index, those in into.items()},
        )

    def _named_by(self, part: Part) -> set[int]:
        second = part.around if isinstance(part, StructurePart) else part.reference
        return {*self._members(part.objects), *self._members(second)}

    def _members(self, objects: Objects | None) -> tuple[int, ...]:
        """Return the objects of a relation; for a structure, all of its objects."""
        return _listed(self.goal.parts[objects.part].objects if isinstance(objects, PartReference) else objects)


def planned_as_structure(spec: StructureSpec | None) -> bool:
    """Return whether a planner of single structures can plan this: the shapes that every network knows, or an open
    shape.

    Args:
        spec: the slots of a goal that is one structure without further keys; `None` for any other goal.
    """
    return spec is not None and (spec.shape is None or spec.shape in FIRST_SHAPES)


def structure_of(table: TableScene, spec: StructureSpec) -> Goal:
    """Return the goal of one structure of a table's participants, as indices into its `original_names`."""
    taking = set(table.names[: table.count])
    return Goal((StructurePart.of(spec, [i for i, name in enumerate(table.original_names) if name in taking]),))


def put_on_table(table: TableScene, goal: Goal) -> tuple[TableGoal, Scene]:
    """Observe a table and convert a goal, whose indices are those of `table.original_names`.

    What no part names takes no part in the goal where the camera does not see it. The objects that the parts place take
    part on the table from now on.

    Returns:
        The goal over the observed objects, and the observation with these objects in the same order, in which those
        are fixed that the arm cannot take: they are not set aside either.

    Raises:
        NotBuildable: if a part places an object that the arm cannot take, or names one that is no longer on the table.
        SceneError: if there are more objects than planners take.
        ObservationError: if the camera does not see an object that a part names.
    """
    everything, poses = table.original_names, table.poses()
    goal, missing = with_what_is_there(table, goal)
    if missing:
        table.missing = missing
    named = [everything[index] for index in goal.named_objects() if isinstance(index, int)]
    for name in named:
        if name in table.fallen:
            raise NotBuildable(f"the goal names {name}, which is no longer on the table")
    table.involve(named)
    scene = table.look()
    clouds = {cloud.name: cloud for cloud in (*scene.objects, *scene.distractors)}
    seen = [name for name in everything if name in clouds]
    if len(seen) > MOST_OBJECTS:
        raise SceneError(
            f"there are {len(seen)} objects on the table, and a goal of several parts takes {MOST_OBJECTS} at most"
        )
    place = {everything.index(name): number for number, name in enumerate(seen)}
    color_of = dict(zip(table.names, table.color_names, strict=True))
    wanted = TableGoal(
        renumbered(goal, place),
        tuple(seen),
        np.array([poses[name] for name in seen]),
        tuple(color_of[name] for name in seen),
        {name: poses[name] for name in everything if name not in clouds and name not in table.fallen},
    )
    troubles = table.out_of_reach.items()
    if refused := [f"{name}, {why}" for name, why in troubles if name in seen and seen.index(name) in wanted.movable]:
        raise NotBuildable(f"the instruction places objects that the arm cannot take: {'; '.join(refused)}")
    table.involve([seen[index] for index in wanted.movable])
    fixed = tuple(number for number, name in enumerate(seen) if name in table.out_of_reach)
    return wanted, replace(scene, objects=tuple(clouds[name] for name in seen), distractors=(), fixed=fixed)


def with_what_is_there(table: TableScene, goal: Goal) -> tuple[Goal, dict[str, str]]:
    """Write out "everything else", and leave what the arm cannot take out of structures.

    Args:
        table: the table.
        goal: with indices into the table's `original_names`.

    Returns:
        The goal, in which every structure lists its objects, and name -> why an object takes no part.

    Raises:
        NotBuildable: if nothing is left for a structure.
    """
    names, named = table.original_names, set(goal.named_objects())
    gone = {**table.out_of_reach, **dict.fromkeys(table.fallen, "it has fallen off the table")}
    missing = dict[str, str]()
    parts = list[Part]()
    for part in goal.parts:
        if isinstance(part, StructurePart):
            own = part.objects if part.objects is not None else [i for i in range(len(names)) if i not in named]
            left = tuple(i for i in own if names[i] not in gone)  # type: ignore[index]
            missing |= {names[i]: gone[names[i]] for i in own if names[i] in gone}  # type: ignore[index]
            if len(left) < _least(part) and len(left) < len(own):
                raise NotBuildable("; ".join(f"{name} cannot take part: {why}" for name, why in missing.items()))
            if not left:
                raise NotBuildable(f"there is nothing left on the table for: {describe_part(part, names)}")
            part = replace(part, objects=left)
        parts.append(part)
    return Goal(tuple(parts)), missing


def _least(part: StructurePart) -> int:
    return words_of(part.shape).least if part.shape is not None else 1


def _may_be_short(part: Part, count: int) -> bool:
    """Return whether a part makes sense with `count` objects, fewer than were asked for."""
    return count >= _least(part) if isinstance(part, StructurePart) else part.relation != "swapped"


def _pointing(part: Part, number: Mapping[int, int]) -> Part:
    """Return a part whose references to other parts have the new numbers of these."""

    def mapped(objects: Any) -> Any:
        return PartReference(number[objects.part]) if isinstance(objects, PartReference) else objects

    if isinstance(part, RelationPart):
        return replace(part, objects=mapped(part.objects), reference=mapped(part.reference))
    return replace(part, around=mapped(part.around))


def renumbered(goal: Goal, place: Mapping[int, int]) -> Goal:
    """Return the goal with other indices; `place` maps each of its indices to the new one."""

    def mapped(objects: Any) -> Any:
        return tuple(place[index] for index in objects) if isinstance(objects, tuple) else objects

    return Goal(tuple(
        replace(part, objects=mapped(part.objects), reference=mapped(part.reference))
        if isinstance(part, RelationPart)
        else replace(part, objects=mapped(part.objects), around=mapped(part.around))
        for part in goal.parts
    ))  # fmt: skip


def described_parts(goal: Goal, names: Sequence[str] | None) -> tuple[str, ...]:
    """Describe each part of a goal in a line."""
    return tuple(describe_part(part, names) for part in goal.parts)


def _listed(objects: Objects | None) -> tuple[int, ...]:
    return objects if isinstance(objects, tuple) else ()  # type: ignore[return-value]

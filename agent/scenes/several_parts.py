"""Draw tables for goals of several parts: all that the parts name is there, a few other objects,
and room for the goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent.arm.arm_model import ArmModel
from agent.scenes.limits import MOST_OBJECTS as MOST_PLANNED
from agent.scenes.object_attributes import attributes_at, attributes_of
from agent.scenes.table_scene import TableScene, drawing_and_noise
from agent.scenes.workcell import Workcell
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, RelationPart, StructurePart
from grounding.resolve.attributes import SceneObject
from grounding.structure_words import words_of
from structdiffusion.benchmark.goal_references import NoReferenceError, ReferenceSearch
from structdiffusion.data.scene_sampling import SceneError, eligible
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel, unique_names
from structdiffusion.observation import Table
from structdiffusion.structures import structure_named

if TYPE_CHECKING:
    from grounding.interpretation import Interpretation

MOST_OBJECTS = 10  # on a drawn table, unless more are needed
_DRAWS = 60
_OF_A_STRUCTURE = (3, 4)  # objects where the words give no number
_OF_A_STACK = (2, 3)  # a higher one has to share its time and its room with the other parts
_OF_A_RELATION = (1, 2)
_IN_A_GROUP = (2, 3)  # objects of one colour, or of one kind, that are sorted
_DISTRACTORS = 2  # at most
_GAP, _EDGE = 0.03, 0.015  # m between first places: room for a finger; from the table's edge
_PLACES_TRIED = 300
_REACH = 0.72  # m from the arm's base: farther off few grasps are left
_WIDEST_DISTRACTOR = 0.08  # m: its radius


def several_parts_scene(
    library: Sequence[ObjectModel], goal: Interpretation, seed: int, arm: ArmModel | None = None
) -> TableScene:
    """Draw a table for a goal of several parts, on which everything takes part.

    Args:
        library: the objects to draw from.
        goal: the goal; its indices are those of the library.
        seed: everything about the scene follows from it.
        arm: another arm than the Jaco.

    Raises:
        SceneError: if no draw has the objects that the instruction names, or the table has no room for them.
    """
    rng, noise = drawing_and_noise(seed)
    models, poses = draw_several_parts(library, goal, rng)
    return TableScene(models, poses, len(models), noise, Workcell(model=arm))


def draw_several_parts(
    library: Sequence[ObjectModel], goal: Interpretation, rng: np.random.Generator
) -> tuple[list[ObjectModel], np.ndarray]:
    """Draw the objects of the instruction, some distractors, and the poses of all.

    A model appears several times if a structure needs more objects than the library has of a noun.

    Returns:
        The models, and their poses (M, 4, 4).

    Raises: the errors of `several_parts_scene`.
    """
    reason = "nothing was tried"
    for attempt in range(_DRAWS):
        named = _draw_named(library, goal.goal, rng)
        if len(named) > MOST_PLANNED:
            reason = f"they would be {len(named)} objects, and {MOST_PLANNED} are the most on a drawn table"
            continue
        demanding = attempt < _DRAWS // 2  # at first
        others = _draw_distractors(library, named, goal.goal, rng) if demanding else []
        models = [*named, *others]
        poses = scatter(models, rng)
        if poses is None:
            reason = "there is no room for them on the table"
            continue
        there = goal.among(standing(models, poses))
        if there.status != "ok":
            reason = there.message
            continue
        if not _means_just(there.goal, len(named)):
            reason = "the words mean others of the objects too"
            continue
        try:
            motions = ReferenceSearch(models, poses, _with_shapes(there.goal), Table(), rng).motions()
        except NoReferenceError as error:
            reason = f"what is asked for cannot be laid out: {error}"
            continue
        if demanding and np.linalg.norm((motions @ poses)[:, :2, 3], axis=1).max() > _REACH:
            reason = "it would be far from the arm"
            continue
        return models, poses
    raise SceneError(f"no scene in {_DRAWS} draws has the objects that the instruction means: {reason}")


def standing(models: Sequence[ObjectModel], world_from_objects: np.ndarray) -> list[SceneObject]:
    """Return the referents of objects at poses (M, 4, 4)."""
    referents = zip(unique_names(models), models, world_from_objects, strict=True)
    return [SceneObject(name, attributes_at(attributes_of(model), pose)) for name, model, pose in referents]


def _means_just(goal: Goal, count: int) -> bool:
    """Return whether the parts name the first `count` objects of a scene, and no others."""
    if any(part.objects is None for part in goal.structures):
        return True
    return set(goal.named_objects()) == set(range(count))


def _with_shapes(goal: Goal) -> Goal:
    """Return the goal with a shape for every structure; an open shape is replaced by one that fits."""

    def with_shape(part: StructurePart) -> StructurePart:
        return replace(part, shape="cluster" if part.rotation is None else "line") if part.shape is None else part

    return Goal(tuple(with_shape(part) if isinstance(part, StructurePart) else part for part in goal.parts))


def _draw_named(library: Sequence[ObjectModel], goal: Goal, rng: np.random.Generator) -> list[ObjectModel]:
    """Draw the objects that the parts name, part by part."""
    chosen: dict[int, list[ObjectModel]] = {}  # index in the library -> the objects that stand for it
    rest: list[ObjectModel] = []
    for part in goal.parts:
        if isinstance(part, RelationPart):
            for objects in (part.objects, part.reference):
                _choose(chosen, _listed(objects), library, _of_relation(part, _listed(objects), rng), rng)
            continue
        _choose(chosen, _listed(part.around), library, 1, rng)
        least, wanted = _numbers(part, rng)
        if part.group_by is not None:
            rest += _draw_groups(_pool(library, part, _listed(part.objects)), part.group_by, rng)
        elif part.objects is None:
            pool = _pool(library, part, range(len(library)))
            rest += [pool[i] for i in rng.permutation(len(pool))[:wanted]]
        else:
            suited = [i for i in _listed(part.objects) if _suits(library[i], part)] or list(_listed(part.objects))
            _choose(chosen, suited, library, wanted, rng, least)
    return [*(model for models in chosen.values() for model in models), *rest]


def _choose(
    chosen: dict[int, list[ObjectModel]],
    indices: Sequence[int],
    library: Sequence[ObjectModel],
    wanted: int,
    rng: np.random.Generator,
    least: int = 0,
) -> None:
    """Choose some of these library objects, with repetitions if there are fewer than `least`."""
    some = list(indices) if len(indices) <= wanted else [indices[i] for i in rng.permutation(len(indices))[:wanted]]
    for index in some:
        chosen.setdefault(index, [library[index]])
    for number in range(max(0, least - len(some)) if some else 0):
        index = some[number % len(some)]
        chosen[index].append(library[index])


def _of_relation(part: RelationPart, indices: Sequence[int], rng: np.random.Generator) -> int:
    """Return how many of these objects take part in a relation: two if the relation needs two."""
    if part.relation == "swapped" or (part.relation == "between" and indices == part.reference):
        return 2
    return int(rng.integers(_OF_A_RELATION[0], _OF_A_RELATION[1] + 1))


def _numbers(part: StructurePart, rng: np.random.Generator) -> tuple[int, int]:
    """Return the least number of objects of a structure, and the number to draw if the instruction gives none."""
    least = 2 if part.shape is None else structure_named(part.shape).least
    if part.rows is not None or part.columns is not None:
        rows, columns = part.rows or 2, part.columns or 2
        least = max(least, rows * columns)
    if part.order is not None and part.order.by == "listed":
        return least, len(part.objects or ())
    low, high = _OF_A_STACK if part.shape is not None and structure_named(part.shape).stacks else _OF_A_STRUCTURE
    wanted = max(least, int(rng.integers(low, high + 1)))
    figure = words_of(part.shape).figure if part.shape is not None else None
    return least, wanted if figure is None else max(number for number in figure.legal if number <= wanted)


def _draw_groups(pool: Sequence[ObjectModel], group_by: str, rng: np.random.Generator) -> list[ObjectModel]:
    """Draw two groups of objects of one colour each, or of one kind each."""
    groups: dict[str, list[ObjectModel]] = {}
    for model in pool:
        colors = attributes_of(model).colors
        value = model.category if group_by == "kind" else colors[0] if colors else ""
        groups.setdefault(value, []).append(model)
    large = [group for value, group in sorted(groups.items()) if value and len(group) >= _IN_A_GROUP[0]]
    if len(large) < 2:
        raise SceneError(f"these objects cannot be sorted by {group_by}: fewer than two groups of two are there")
    drawn = []
    for k in rng.permutation(len(large))[:2]:
        group = large[k]
        number = int(rng.integers(_IN_A_GROUP[0], _IN_A_GROUP[1] + 1))
        drawn += [group[i] for i in rng.permutation(len(group))[:number]]
    return drawn


def _draw_distractors(
    library: Sequence[ObjectModel], named: Sequence[ObjectModel], goal: Goal, rng: np.random.Generator
) -> list[ObjectModel]:
    """Draw up to two objects of other nouns; none if the goal includes all objects."""
    if any(part.objects is None for part in goal.structures):
        return []
    nouns = {model.category for model in named}
    pool = [m for m in eligible(library, None) if m.category not in nouns and m.radius < _WIDEST_DISTRACTOR]
    number = min(int(rng.integers(0, _DISTRACTORS + 1)), max(0, MOST_OBJECTS - len(named)))
    return [pool[i] for i in rng.permutation(len(pool))[:number]]


def _pool(library: Sequence[ObjectModel], part: StructurePart, indices: Sequence[int]) -> list[ObjectModel]:
    return [library[i] for i in indices or range(len(library)) if _suits(library[i], part)]


def _suits(model: ObjectModel, part: StructurePart) -> bool:
    return bool(eligible([model], part.shape))


def _listed(objects: Objects | None) -> tuple[int, ...]:
    return objects if isinstance(objects, tuple) else ()  # type: ignore[return-value]


def scatter(models: Sequence[ObjectModel], rng: np.random.Generator, table: Table = Table()) -> np.ndarray | None:
    """Draw poses (M, 4, 4) on a table, clear of each other; `None` if there is no room."""
    taken: list[np.ndarray] = []
    poses: list[np.ndarray] = [np.eye(4)] * len(models)
    for index in sorted(range(len(models)), key=lambda i: -models[i].radius):  # the widest first, while there is room
        yaw = rng.uniform(-np.pi, np.pi)
        outline = turned(models[index].footprint, yaw)
        low = np.array([table.x_min, table.y_min]) - outline.min(axis=0) + _EDGE
        high = np.array([table.x_max, table.y_max]) - outline.max(axis=0) - _EDGE
        if (low >= high).any():
            return None
        places = rng.uniform(low, high, (_PLACES_TRIED, 2))
        free = next((at for at in places if all(clear_gap(outline + at, other) > _GAP for other in taken)), None)
        if free is None:
            return None
        taken.append(outline + free)
        poses[index] = pose_from_xyz_yaw(free[0], free[1], 0.0, yaw)
    return np.array(poses)

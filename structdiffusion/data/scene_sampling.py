"""Draw scenes: the objects, their initial poses, and the spec.

Every scene has a valid arrangement: the geometric planner found one with the true models, and the distractors do not
block it. One generator is the only source of randomness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grounding.spec import LEGAL_VALUES, StructureSpec
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.layouts import Layout, lay_out
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.structure import STANDING, TALLEST, WIDEST, LayoutError, choose_first

_ANY_COUNTS = (3, 5)  # numbers of objects in a scene whose shape is open
_LEAST_OF_ANY = 2  # two objects can form a tower or a line
_INITIAL_GAP = 0.02  # m, between initial footprints: room for a finger
_EDGE = 0.01  # m, from the table's edge to initial footprints


class SceneError(ValueError):
    """Raised if no scene can be drawn; the message says why."""


@dataclass(frozen=True)
class DrawnScene:
    """A table with objects, and a spec that they can satisfy.

    Attributes:
        models: M objects: the `count` that take part first, then the distractors.
        world_from_initial: (M, 4, 4) their initial poses.
        count: the number of objects that take part.
        spec: the requested structure.
        reference: a layout of the true models that satisfies the spec.
        table: the table.
    """

    models: tuple[ObjectModel, ...]
    world_from_initial: np.ndarray
    count: int
    spec: StructureSpec
    reference: Layout
    table: Table

    def reference_goal_from_initial(self) -> np.ndarray:
        """Return the rigid motions (count, 4, 4) of the reference layout, world frame."""
        motions = []
        for i in range(self.count):
            x, y, z = self.reference.positions[i]
            initial = self.world_from_initial[i]
            goal = pose_from_xyz_yaw(x, y, z, self.reference.turns[i])
            goal[:3, :3] = goal[:3, :3] @ initial[:3, :3]
            motions.append(goal @ np.linalg.inv(initial))
        return np.array(motions)


def layout_item(model: ObjectModel, yaw: float) -> LayoutItem:
    """Return the layout item of a true model that stands with its front toward `yaw`."""
    return LayoutItem(
        model.category, turned(model.footprint, yaw), model.height, yaw, model.stackable, model.flat_bottom
    )


def full_spec(shape: str, rng: np.random.Generator) -> StructureSpec:
    """Draw a spec of this shape that specifies every slot it can carry, of the sizes that are usual, as in the paper's
    test sentences.
    """
    structure = structure_named(shape)
    values = {**LEGAL_VALUES, "size": structure.sizes}
    return StructureSpec(shape, **{slot: str(rng.choice(values[slot])) for slot in structure.slots})


def eligible(models: Sequence[ObjectModel], shape: str | None) -> list[ObjectModel]:
    """Return the objects of a library that suit a structure of this shape; `None` requires only that they stand."""
    if shape is not None:
        return [model for model in models if structure_named(shape).suits(model)]
    return [model for model in models if model.flat_bottom and model.radius < WIDEST / 2]


def draw_scene(
    models: Sequence[ObjectModel],
    spec: StructureSpec,
    rng: np.random.Generator,
    *,
    categories: Sequence[str] = (),
    members: Sequence[ObjectModel] | None = None,
    count: int | None = None,
    distractors: int | None = None,
    table: Table = Table(),
    attempts: int = 60,
) -> DrawnScene:
    """Draw a scene for a spec from a library.

    Args:
        models: the library.
        spec: the requested structure; open slots stay open.
        rng: the only source of randomness.
        categories: nouns that must all take part, and no others; () allows any.
        members: the objects that take part, if already decided: all others of `models` become distractors.
        count: the number of objects that take part; `None` draws a number that suits the shape. A tower takes fewer if
            it would become too high for the arm, and a table setting at most two of a kind.
        distractors: the number of distractors; `None` draws 0 to 2.
        table: the table.
        attempts: the number of object sets to try.

    Raises:
        SceneError: if no set of these objects can form the structure on this table.
    """
    pool = eligible(models, spec.shape)
    if categories:
        pool = [model for model in pool if model.category in categories]
    reason = f"{len(pool)} of {len(models)} objects suit a {spec.shape or 'structure'}"
    who = structure_named(spec.shape).requirement if spec.shape else STANDING
    if members is not None:
        named = {model.name for model in members}
        pool = [model for model in pool if model.name in named]
        reason = f"{len(pool)} of the {len(members)} objects meant suit a {spec.shape or 'structure'}"
    if len(pool) < (2 if members is None else max(2, len(members))):
        raise SceneError(f"cannot make a {spec.shape or 'structure'}: only {reason} ({who}); 2 or more are needed")
    for _ in range(attempts):
        try:
            chosen = list(members) if members else _choose(pool, spec.shape, rng, count, bool(categories))
            yaws = rng.uniform(-np.pi, np.pi, len(chosen))
            items = [layout_item(model, yaw) for model, yaw in zip(chosen, yaws)]
            layout = lay_out(items, spec, table, rng)
            if layout.positions[:, 2].max() > TALLEST:
                raise LayoutError(f"the {layout.spec.shape} would be higher than the arm can build")
            if members is None:
                extra = _bystanders(models, chosen, rng, distractors, bool(categories))
            else:
                extra = [model for model in models if model.name not in named]
            poses = _scatter(chosen, yaws, layout, extra, table, rng)
        except LayoutError as error:
            reason = str(error)
            continue
        return DrawnScene((*chosen, *extra), poses, len(chosen), spec, layout, table)
    raise SceneError(f"no scene in {attempts} attempts for {spec} with these objects: {reason}")


def _bystanders(
    models: Sequence[ObjectModel],
    chosen: Sequence[ObjectModel],
    rng: np.random.Generator,
    number: int | None,
    named: bool,
) -> list[ObjectModel]:
    """Choose distractors, none with a requested noun; `None` draws 0 to 2 of them."""
    number = int(rng.integers(0, 3)) if number is None else number
    taken = {model.category for model in chosen} if named else set()
    names = {model.name for model in chosen}
    others = [
        model
        for model in eligible(models, None)
        if model.name not in names and model.category not in taken and model.radius < 0.08
    ]
    return [others[i] for i in rng.permutation(len(others))[:number]]


def _choose(
    pool: Sequence[ObjectModel],
    shape: str | None,
    rng: np.random.Generator,
    count: int | None,
    named: bool,
) -> list[ObjectModel]:
    """Choose the objects that take part."""
    low, high = structure_named(shape).usual_counts if shape else _ANY_COUNTS
    wanted = count if count is not None else int(rng.integers(low, high + 1))
    shuffled = [pool[i] for i in rng.permutation(len(pool))]
    if shape is None:
        return choose_first(shuffled, wanted, "structure", _LEAST_OF_ANY)
    return structure_named(shape).choose(shuffled, wanted, rng, named)


def _scatter(
    chosen: Sequence[ObjectModel],
    yaws: np.ndarray,
    layout: Layout,
    extra: Sequence[ObjectModel],
    table: Table,
    rng: np.random.Generator,
) -> np.ndarray:
    """Draw initial poses (M, 4, 4): distractors clear of the reference structure,
    and all objects clear of each other.
    """
    standing_at_goal = zip(chosen, yaws, layout.turns, layout.positions)
    goal = [turned(m.footprint, yaw + turn) + at[:2] for m, yaw, turn, at in standing_at_goal]
    standing: list[np.ndarray] = []

    def put(outline: np.ndarray, avoid: Sequence[np.ndarray]) -> np.ndarray:
        low = np.array([table.x_min, table.y_min]) - outline.min(axis=0) + _EDGE
        high = np.array([table.x_max, table.y_max]) - outline.max(axis=0) - _EDGE
        for _ in range(200):
            at = rng.uniform(low, high)
            if all(clear_gap(outline + at, other) > _INITIAL_GAP for other in avoid):
                standing.append(outline + at)
                return at
        raise LayoutError("there is no free place left on the table for the objects at first")

    extra_poses = []
    for model in extra:
        yaw = rng.uniform(-np.pi, np.pi)
        at = put(turned(model.footprint, yaw), standing + goal)
        extra_poses.append(pose_from_xyz_yaw(at[0], at[1], 0.0, yaw))
    poses = []
    for model, yaw in zip(chosen, yaws):
        at = put(turned(model.footprint, yaw), standing)
        poses.append(pose_from_xyz_yaw(at[0], at[1], 0.0, yaw))
    return np.array(poses + extra_poses)

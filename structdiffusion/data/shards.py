"""Draw the scenes of a shard, and verify in physics those that geometry does not guarantee.

Exact circles, lines and table settings stand by construction: everything is on the table, and no outlines overlap.
Some of every shard are built in PyBullet as well, to measure this. Whether a tower stands depends on contacts, so each
is built, released piece by piece, and kept only if it stands; its settled heights are the goals.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import DrawnScene, SceneError, draw_scene, full_spec
from structdiffusion.geometry import yaw_of
from structdiffusion.objects.model import ObjectModel
from structdiffusion.protocol.physical_stability import place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.structure import Structure
from structdiffusion.word_tokens import word_ids

PLACES, EXTRAS = 7, 2  # largest numbers of objects that take part, and of distractors
# More objects take part in a crowded scene. Its wider rows are stored separately, so that most batches stay small.
CROWDED_PLACES, _CROWD = 10, (8, 10)
# Share of structures that a rotation alters for which it is omitted; otherwise no closed ring would ever be drawn.
_ROTATION_LEFT_OUT = 0.4
# m, rad: a stack stands if no object moves or tilts by more than this while it is built and left to settle.
_STACK_SHIFT, _STACK_TILT = 0.015, np.radians(4.0)


@dataclass(frozen=True)
class Shard:
    """Drawn scenes, and the outcomes of all attempts to draw them.

    Attributes:
        number: of the shard.
        crowded: whether its scenes are crowded; such shards are numbered separately.
        columns: the arrays of a `DemonstrationSet`.
        facts: JSON-ready: the seconds that it took; per shape, "tries" and their outcomes: "accepted", "no scene" (no
            layout, or no room for it) or "fell"; and, for shapes that geometry guarantees, how many were built in
            physics as well ("proven") and how many of these "stood".
    """

    number: int
    crowded: bool
    columns: dict[str, np.ndarray]
    facts: dict[str, Any]


def draw_shard(
    models: Sequence[ObjectModel], seed: int, number: int, scenes: int, proven: int = 0, crowded: bool = False
) -> Shard:
    """Draw one shard; the same (seed, number, crowded), library and size give the same scenes.

    Args:
        models: the library.
        seed: the base seed of the data.
        number: the number of the shard.
        scenes: the number of scenes.
        proven: the number of scenes of each exact shape to build in physics as well; half a second each.
        crowded: let 8 to 10 objects take part; in towers, as many of them as can stand.
    """
    started = time.perf_counter()
    rng = np.random.default_rng((seed, number, 1) if crowded else (seed, number))
    rows: list[dict[str, np.ndarray]] = []
    tries = {shape: Counter[str]() for shape, structure in STRUCTURES.items() if structure.demonstration_share}
    while len(rows) < scenes:
        shape, row, scene = _try(models, rng, crowded)
        tries[shape]["tries"] += 1
        tries[shape]["accepted" if row is not None else "no scene" if scene is None else "fell"] += 1
        if row is None or scene is None:
            continue
        rows.append(row)
        if not STRUCTURES[shape].stacks and tries[shape]["proven"] < proven:
            tries[shape]["proven"] += 1
            tries[shape]["stood"] += _stands(scene)
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    facts = {"scenes": scenes, "seconds": round(time.perf_counter() - started, 2), "shapes": tries}
    return Shard(number, crowded, columns, facts)


def _try(
    models: Sequence[ObjectModel], rng: np.random.Generator, crowded: bool
) -> tuple[str, dict[str, np.ndarray] | None, DrawnScene | None]:
    """Try to draw one scene; return its shape, its row (`None` if rejected),
    and the scene (`None` if none was drawn).
    """
    shares = np.array([one.crowded_share if crowded else one.demonstration_share for one in STRUCTURES.values()])
    shape = str(rng.choice(list(STRUCTURES), p=shares / shares.sum()))
    spec = full_spec(shape, rng)
    if STRUCTURES[shape].rotation_alters_layout and rng.random() < _ROTATION_LEFT_OUT:
        spec = StructureSpec.from_dict({**spec.to_dict(), "rotation": None})
    try:
        scene = draw_scene(models, spec, rng, count=_count(STRUCTURES[shape], rng, crowded), attempts=20)
    except SceneError:
        return shape, None, None
    motions = scene.reference_goal_from_initial()
    world_from_goal = motions @ scene.world_from_initial[: scene.count]
    if STRUCTURES[shape].stacks:
        world_from_goal = settled_stack(scene, world_from_goal)
        if world_from_goal is None:
            return shape, None, scene
    return shape, _row(models, scene, world_from_goal, CROWDED_PLACES if crowded else PLACES), scene


def _count(structure: Structure, rng: np.random.Generator, crowded: bool) -> int | None:
    """Return the number of objects that take part; `None` leaves it to the structure."""
    if crowded:
        return int(rng.integers(_CROWD[0], _CROWD[1] + 1))
    low, high = structure.usual_counts
    return int(rng.integers(low, PLACES + 1)) if high > PLACES else None


def _stands(scene: DrawnScene) -> bool:
    """Return whether the reference arrangement of a scene passes the evaluation protocol."""
    n, poses = scene.count, scene.world_from_initial
    others = list(zip(scene.models[n:], poses[n:]))
    motions = scene.reference_goal_from_initial()
    bodies = TabletopBodies(scene.models[:n], poses[:n], scene.table, others)
    return place_and_check(bodies, motions, scene.spec).success


def settled_stack(scene: DrawnScene, world_from_goal: np.ndarray) -> np.ndarray | None:
    """Build a stack, such as a tower, from the bottom up; return where its objects come to rest, or `None` if it falls.

    Args:
        scene: the scene; only the objects that take part are used.
        world_from_goal: (N, 4, 4) planned poses; each object is set down 3 mm above what carries it.
    """
    order = scene.reference.order
    settled = np.array(world_from_goal)
    with TabletopWorld(table=scene.table) as world:
        top = 0.0
        for place, item in enumerate(order):
            pose = np.array(world_from_goal[item])
            pose[2, 3] = top + 0.003
            world.add(scene.models[item], pose)
            world.settle(1.0)
            poses = np.array(world.poses())
            planned = world_from_goal[list(order[: place + 1])]
            shift = np.linalg.norm(poses[:, :2, 3] - planned[:, :2, 3], axis=1)
            tilt = np.arccos(np.clip(poses[:, 2, 2], -1, 1))
            if shift.max() > _STACK_SHIFT or tilt.max() > _STACK_TILT:
                return None
            # The top is that of the highest placed object: a cup inside a bowl may be lower than the bowl's rim.
            top = max(p[2, 3] + scene.models[i].height for p, i in zip(poses, order))
    settled[list(order)] = poses
    return settled


def _row(
    models: Sequence[ObjectModel], scene: DrawnScene, world_from_goal: np.ndarray, places: int
) -> dict[str, np.ndarray]:
    index = {model.name: number for number, model in enumerate(models)}
    objects = np.full(places + EXTRAS, -1, dtype=np.int16)
    initial = np.zeros((places + EXTRAS, 3), dtype=np.float32)
    goal = np.zeros((places, 4), dtype=np.float32)
    members = list(scene.reference.order) + list(range(scene.count, len(scene.models)))
    slots = list(range(scene.count)) + [places + i for i in range(len(scene.models) - scene.count)]
    for slot, member in zip(slots, members):
        pose = scene.world_from_initial[member]
        objects[slot] = index[scene.models[member].name]
        initial[slot] = pose[0, 3], pose[1, 3], yaw_of(pose)
        if slot < places:
            goal[slot] = *world_from_goal[member][:3, 3], scene.reference.turns[member]
    frame = scene.reference.world_from_structure
    return {
        "objects": objects,
        "initial": initial,
        "goal": goal,
        "frame": np.array([frame[0, 3], frame[1, 3], yaw_of(frame)], dtype=np.float32),
        "words": np.array(word_ids(scene.spec), dtype=np.int8),
    }

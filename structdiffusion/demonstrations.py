"""Training scenes, as object ids and poses: drawn, verified where geometry is no guarantee, stored in shards.

Exact circles, lines and table settings stand by construction. A tower stands or falls by contact, so
each is built in PyBullet, released piece by piece, and kept only if it stands; its settled heights
are the goals. Every shard follows from (seed, shard number) alone, is written at once, and is not
written again: a run that was stopped goes on where it stopped.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from grounding.spec import SHAPES, SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.geometry import yaw_of
from structdiffusion.models.encoders import word_ids
from structdiffusion.objects.model import ObjectModel
from structdiffusion.scenes import DrawnScene, SceneError, draw_scene, full_spec
from structdiffusion.tabletop import TabletopWorld

PLACES, EXTRAS = 7, 2  # objects that take part, and distractors, at most
SHARD_SCENES = 500
# Of the tries at a demonstration. Towers are drawn more often, since some of them fall and are dropped.
_SHAPE_WEIGHTS = {"circle": 0.25, "line": 0.22, "tower": 0.28, "table setting": 0.25}
# A tower stands if nothing moved or tilted by more than this when it was built and left alone.
_TOWER_SHIFT, _TOWER_TILT = 0.015, np.radians(4.0)


@dataclass(frozen=True)
class DemonstrationSet:
    """D training scenes over M objects. Absent entries are -1 in `objects` and 0 elsewhere.

    Attributes:
        objects: (D, 9) int16 ids of the objects that take part, place by place, then of the distractors.
        initial: (D, 9, 3) float32 world x, y (m) and yaw (rad) before anything moves.
        goal: (D, 7, 4) float32 world x, y, z (m) of the object frame and its turn from the initial yaw (rad).
        frame: (D, 3) float32 world x, y (m) and heading (rad) of the structure frame.
        words: (D, 5) int8 word-token ids (`models.encoders.word_ids`) of the full spec.
    """

    objects: np.ndarray
    initial: np.ndarray
    goal: np.ndarray
    frame: np.ndarray
    words: np.ndarray

    def __len__(self) -> int:
        return len(self.objects)

    @classmethod
    def load(cls, folder: str | Path) -> DemonstrationSet:
        """All finished shards of a folder.

        Raises:
            FileNotFoundError: when there is none.
        """
        shards = sorted(Path(folder).glob("shard_*.npz"))
        if not shards:
            raise FileNotFoundError(f"{folder} has no shard_*.npz; make them with `structagent generate --out {folder}`")
        loaded = [np.load(shard) for shard in shards]
        return cls(*(np.concatenate([shard[name] for shard in loaded]) for name in cls.__dataclass_fields__))


def save_library(models: Sequence[ObjectModel], folder: str | Path) -> None:
    """Write `library.npz`: surface points and normals (M, 1024, 3) float16, names and nouns (M,)."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        folder / "library.npz",
        points=np.stack([model.surface_points for model in models]).astype(np.float16),
        normals=np.stack([model.surface_normals for model in models]).astype(np.float16),
        names=np.array([model.name for model in models]),
        categories=np.array([model.category for model in models]),
    )


def generate(
    models: Sequence[ObjectModel], folder: str | Path, scenes: int, *, seed: int = 0, workers: int = 1
) -> Iterator[tuple[int, int]]:
    """Write demonstrations; yields (shards done, shards in all) as they are finished.

    Args:
        models: the training objects; written along as `library.npz`.
        folder: receives `library.npz`, `shard_*.npz` and `datasheet.json`.
        scenes: how many, rounded up to whole shards of 500.
        seed: of everything.
        workers: processes.
    """
    folder = Path(folder)
    save_library(models, folder)
    shards = -(-scenes // SHARD_SCENES)
    missing = [number for number in range(shards) if not _shard_path(folder, number).is_file()]
    done = shards - len(missing)
    yield done, shards
    task = partial(write_shard, models, folder, seed)
    if workers == 1:
        for number in missing:
            task(number)
            done += 1
            yield done, shards
    else:
        with ProcessPoolExecutor(workers) as pool:
            for _ in pool.map(task, missing):
                done += 1
                yield done, shards
    _write_datasheet(folder, models, seed)


def write_shard(models: Sequence[ObjectModel], folder: Path, seed: int, number: int) -> None:
    """Draw and write one shard; the same (seed, number) and library give the same file."""
    rng = np.random.default_rng((seed, number))
    rows = []
    while len(rows) < SHARD_SCENES:
        row = draw_demonstration(models, rng)
        if row is not None:
            rows.append(row)
    columns = {name: np.stack([row[name] for row in rows]) for name in DemonstrationSet.__dataclass_fields__}
    unfinished = _shard_path(folder, number).with_suffix(f".{os.getpid()}.tmp")
    with unfinished.open("wb") as file:
        np.savez_compressed(file, **columns)
    unfinished.replace(_shard_path(folder, number))  # a shard is there whole or not at all


def draw_demonstration(models: Sequence[ObjectModel], rng: np.random.Generator) -> dict[str, np.ndarray] | None:
    """One scene as arrays (see `DemonstrationSet`), or `None` for one that could not be made or fell."""
    shape = str(rng.choice(SHAPES, p=[_SHAPE_WEIGHTS[shape] for shape in SHAPES]))
    spec = full_spec(shape, rng)
    if shape == "circle" and rng.random() < 0.4:
        # A ring without an opening is what a circle means when no rotation was asked for.
        spec = StructureSpec.from_dict({**spec.to_dict(), "rotation": None})
    try:
        scene = draw_scene(models, spec, rng, attempts=20)
    except SceneError:
        return None
    motions = scene.reference_goal_from_initial()
    world_from_goal = motions @ scene.world_from_initial[: scene.count]
    if shape == "tower":
        world_from_goal = settled_tower(scene, world_from_goal)
        if world_from_goal is None:
            return None
    return _row(models, scene, world_from_goal)


def settled_tower(scene: DrawnScene, world_from_goal: np.ndarray) -> np.ndarray | None:
    """Where the objects of a tower come to rest when it is built from the bottom up, or `None` if it falls.

    Args:
        scene: its objects; only those that take part matter.
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
            if shift.max() > _TOWER_SHIFT or tilt.max() > _TOWER_TILT:
                return None
            # The top is where the highest of the placed objects ends: a cup inside a bowl may be lower than its rim.
            top = max(p[2, 3] + scene.models[i].height for p, i in zip(poses, order))
    settled[list(order)] = poses
    return settled


def _row(models: Sequence[ObjectModel], scene: DrawnScene, world_from_goal: np.ndarray) -> dict[str, np.ndarray]:
    index = {model.name: number for number, model in enumerate(models)}
    objects = np.full(PLACES + EXTRAS, -1, dtype=np.int16)
    initial = np.zeros((PLACES + EXTRAS, 3), dtype=np.float32)
    goal = np.zeros((PLACES, 4), dtype=np.float32)
    members = list(scene.reference.order) + list(range(scene.count, len(scene.models)))
    slots = list(range(scene.count)) + [PLACES + i for i in range(len(scene.models) - scene.count)]
    for slot, member in zip(slots, members):
        pose = scene.world_from_initial[member]
        objects[slot] = index[scene.models[member].name]
        initial[slot] = pose[0, 3], pose[1, 3], yaw_of(pose)
        if slot < PLACES:
            goal[slot] = *world_from_goal[member][:3, 3], scene.reference.turns[member]
    frame = scene.reference.world_from_structure
    return {
        "objects": objects,
        "initial": initial,
        "goal": goal,
        "frame": np.array([frame[0, 3], frame[1, 3], yaw_of(frame)], dtype=np.float32),
        "words": np.array(word_ids(scene.spec), dtype=np.int8),
    }


def _shard_path(folder: Path, number: int) -> Path:
    return folder / f"shard_{number:05d}.npz"


def _write_datasheet(folder: Path, models: Sequence[ObjectModel], seed: int) -> None:
    data = DemonstrationSet.load(folder)
    counts = {shape: int((data.words[:, 0] == i + 1).sum()) for i, shape in enumerate(SHAPES)}
    sheet = {
        "scenes": len(data),
        "scenes_per_shape": counts,
        "objects": len(models),
        "objects_per_category": {c: sum(m.category == c for m in models) for c in sorted({m.category for m in models})},
        "seed": seed,
        "slots": {shape or "any": list(slots) for shape, slots in SLOTS_OF_SHAPE.items()},
    }
    (folder / "datasheet.json").write_text(json.dumps(sheet, indent=2) + "\n")

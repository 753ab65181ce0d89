"""Draw what the outcome discriminator learns from: samples of the diffusion model, each judged as the evaluation does.

Of each scene there are the model's own samples, and the same disturbed a little: spread out or drawn together, shifted,
or some objects moved by millimetres, so that right and wrong lie close together. Nothing is let go: an arrangement is
right if nothing intersects, and, where it stands on the table, all checks of its structure hold. Of 2,500 samples of
towers in which nothing intersects, 93 % stood when they were let go.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import torch

from grounding.spec import FIRST_SHAPES, StructureSpec
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.data.npz_files import save_arrays
from structdiffusion.evaluation_protocol import MAX_PENETRATION
from structdiffusion.geometry import yaw_of
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import StructureGoal
from structdiffusion.parallel import in_parallel, kept_pieces
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.factory import load_planner
from structdiffusion.planners.samples import encode_scene
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.protocol.world_checks import placed_body
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.word_tokens import word_ids

PROPOSER = "diffusion-tokens-paper-unranked"
SAMPLES, DISTURBED = 20, 60  # of a scene: the model's own, and disturbed ones
SHARD_SCENES = 40
_PLACES = 12  # of objects in a row of arrays
_REACH = 0.02  # m: gaps beyond are not computed
_GROWN, _SHIFTED, _MOVED = 0.13, 0.03, 0.006  # spread of the factor, and m: of a structure, and of its objects
_RAISED, _ASIDE = 0.004, 0.004  # m: of the objects of a tower, in height and sideways
_SOME = 0.4  # share of the disturbed that are shifted, or have objects moved
_UNDER = 0.012  # m: what is that close under something may carry it


def generate_judged(
    models: Sequence[ObjectModel], folder: Path, scenes: int, *, seed: int = 0, workers: int = 0, ray: bool = False
) -> Iterator[tuple[int, int]]:
    """Write `judged_*.npz` into a folder of training data; yield (shards done, shards in all).

    Each has D scenes of up to 12 objects (absent ones are -1 in `objects`), with K samples each: `objects` (D, 12)
    int16 ids in the library; `initial` (D, 12, 4) float32 x, y, z (m) and yaw (rad); `count` (D,) int8 of those
    that take part; `motions` (D, K, 12, 4) float32 x, y, z and yaw of goal_from_initial; `orders` (D, K, 12)
    int8 the object of each place; `words` (D, 5) int8; `right` (D, K) bool.

    Args:
        models: the objects of the folder's library.
        folder: with `library.npz`.
        scenes: their number, rounded up to whole shards of 40.
        seed: the base seed.
        workers: the number of worker processes; 0 to use this process alone.
        ray: run the workers on the Ray cluster that this process is connected to.

    Raises:
        WorkerError: at the end, if workers died and their shards are missing.
    """
    shards = -(-scenes // SHARD_SCENES)
    paths = [folder / f"judged_{number:05d}.npz" for number in range(shards)]
    missing = [number for number, path in enumerate(paths) if not path.is_file()]
    worked = in_parallel(
        partial(_shard, seed), _loaded, (tuple(models),), missing, workers, ray=ray, ordered=False
    )  # fmt: skip
    yield from kept_pieces(
        worked, lambda shard: save_arrays(paths[shard[0]], shard[1]), shards - len(missing), shards,
        "shards of judged proposals",
    )  # fmt: skip


def _loaded(models: tuple[ObjectModel, ...]) -> tuple[tuple[ObjectModel, ...], DiffusionPlanner]:
    planner = load_planner(PROPOSER)
    assert isinstance(planner, DiffusionPlanner)
    return models, planner


def _shard(
    seed: int, loaded: tuple[tuple[ObjectModel, ...], DiffusionPlanner], number: int
) -> tuple[int, dict[str, np.ndarray]]:
    models, planner = loaded
    index = {model.name: place for place, model in enumerate(models)}
    rows = []
    for place in range(number * SHARD_SCENES, (number + 1) * SHARD_SCENES):
        shape, count = FIRST_SHAPES[place % len(FIRST_SHAPES)], place // len(FIRST_SHAPES)
        rows.append(judged(draw_evaluation_scene(models, shape, count, seed=seed), planner, index))
    return number, {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def judged(scene: EvaluationScene, planner: DiffusionPlanner, index: dict[str, int]) -> dict[str, np.ndarray]:
    """Sample arrangements for a scene and judge them; the columns of one scene (see `generate_judged`)."""
    drawn, goal = scene.drawn, StructureGoal(scene.spec)
    generator = torch.Generator().manual_seed(scene.planning_seed)
    with torch.no_grad():
        seen = encode_scene(scene.observed(), goal, planner.model, False, generator)
        sampled = planner.sample(seen, goal, SAMPLES, generator)
    initial = np.array(drawn.world_from_initial)
    rng = np.random.default_rng(scene.planning_seed)
    origin = rng.integers(0, SAMPLES, DISTURBED)
    own = sampled.motions @ initial[: drawn.count]
    goals = np.concatenate((own, _disturbed(own[origin], scene.structure == "tower", rng)))
    orders = np.concatenate((sampled.orders, sampled.orders[origin]))
    with TabletopWorld(drawn.models, list(initial), drawn.table) as world:
        right = [_stands(world, row, drawn.count, scene) for row in goals]
    motions = goals @ np.linalg.inv(initial[: drawn.count])
    poses = np.concatenate((motions[..., :3, 3], _yaws(motions)[..., None]), axis=-1)
    before = np.concatenate((initial[:, :3, 3], _yaws(initial)[:, None]), axis=-1)
    return {
        "objects": _padded(np.array([index[model.name] for model in drawn.models]), 0, -1).astype(np.int16),
        "initial": _padded(before, 0).astype(np.float32),
        "count": np.array(drawn.count, dtype=np.int8),
        "motions": _padded(poses, 1).astype(np.float32),
        "orders": _padded(orders, 1).astype(np.int8),
        "words": np.array(word_ids(scene.spec), dtype=np.int8),
        "right": np.array(right),
    }


def _disturbed(goals: np.ndarray, stacked: bool, rng: np.random.Generator) -> np.ndarray:
    """Disturb goal poses (K, N, 4, 4): structures in size and place, objects by millimetres."""
    goals, (count, things) = goals.copy(), goals.shape[:2]
    some = rng.random((2, count, 1, 1)) < _SOME
    if stacked:
        goals[:, :, 2, 3] += rng.normal(0.0, _RAISED, (count, things)) * ~some[0, :, 0]
        goals[:, :, :2, 3] += rng.normal(0.0, _ASIDE, (count, things, 2)) * some[1]
        return goals
    middle = goals[:, :, :2, 3].mean(axis=1, keepdims=True)
    grown = np.exp(rng.normal(0.0, _GROWN, (count, 1, 1)))
    goals[:, :, :2, 3] = middle + (goals[:, :, :2, 3] - middle) * grown
    goals[:, :, :2, 3] += rng.normal(0.0, _SHIFTED, (count, 1, 2)) * some[0]
    goals[:, :, :2, 3] += rng.normal(0.0, _MOVED, (count, things, 2)) * some[1]
    return goals


def _stands(world: TabletopWorld, goals: np.ndarray, count: int, scene: EvaluationScene) -> bool:
    """Return whether nothing intersects at goal poses (N, 4, 4), and, but for a tower, all checks hold."""
    for number, pose in enumerate(goals):
        world.set_pose(number, pose)
    gaps = [world.clearances(number, _REACH) for number in range(count)]
    if min((gap for each in gaps for gap in each.values()), default=1.0) < -MAX_PENETRATION:
        return False
    return scene.structure == "tower" or _checked(world, gaps, count, scene.spec)


def _checked(world: TabletopWorld, gaps: Sequence[dict[int, float]], count: int, spec: StructureSpec) -> bool:
    bodies = [placed_body(world, number, str(number), []) for number in range(count)]
    carried = [
        tuple(
            under for under in range(count)
            if gaps[body].get(under, 1.0) < _UNDER and bodies[body].z_bottom > bodies[under].z_bottom + 0.004
            and np.linalg.norm(bodies[body].centroid - bodies[under].centroid) < 0.05
        )
        for body in range(count)
    ]  # fmt: skip
    placed = [replace(body, rests_on=on) for body, on in zip(bodies, carried, strict=True)]
    return all(check.passed for check in check_structure(placed, spec, world.table))


def _yaws(poses: np.ndarray) -> np.ndarray:
    return np.vectorize(yaw_of, signature="(4,4)->()")(poses)


def _padded(array: np.ndarray, axis: int, value: float = 0.0) -> np.ndarray:
    width = [(0, 0)] * array.ndim
    width[axis] = (0, _PLACES - array.shape[axis])
    return np.pad(array, width, constant_values=value)

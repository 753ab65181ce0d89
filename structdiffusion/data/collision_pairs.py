"""Generate training pairs for the collision discriminator: two objects, near each other or one on the other.

The paper draws 100,000 pairwise configurations (section IV.E). Distances come from the same physics engine and convex
parts that judge arrangements later. Each group of objects is written when it is finished, so that an interrupted run
can be resumed; at the end all groups are merged into one file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from structdiffusion.data.npz_files import read_arrays, save_arrays
from structdiffusion.footprints import separation_along, turned
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import in_parallel, kept_pieces
from structdiffusion.simulation.world import TabletopWorld

_GROUP = 10  # objects that share a world and are paired with each other
_REACH = 0.03  # m: larger distances are recorded as this value


def generate_pairs(
    models: Sequence[ObjectModel],
    folder: str | Path,
    pairs: int,
    *,
    seed: int = 0,
    workers: int = 0,
    ray: bool = False,
) -> Iterator[tuple[int, int]]:
    """Write `pairs.npz` into a folder of demonstrations; yield (groups done, groups in all).

    Its arrays: `objects` (K, 2) ids in the library, `poses` (K, 2, 4) x, y, z (m) and yaw (rad), and `distance`
    (K,) in metres, negative if the two intersect. An existing file with as many pairs is kept.

    Args:
        models: the objects of the folder's library.
        folder: with `library.npz` (see `demonstrations.generate`).
        pairs: the number of pairs, rounded up so that each group of ten objects has as many.
        seed: the base seed.
        workers: the number of worker processes; 0 to use this process alone.
        ray: run the workers on the Ray cluster that this process is connected to.

    Raises:
        WorkerError: at the end, if workers died and their groups are missing.
    """
    path, groups = Path(folder) / "pairs.npz", -(-len(models) // _GROUP)
    count = -(-pairs // groups)
    if path.is_file() and len(read_arrays(path, "distance")["distance"]) == count * groups:
        yield groups, groups
        return
    parts = [path.with_name(f"pairs_{count}_{group:05d}.npz") for group in range(groups)]
    missing = [group for group, part in enumerate(parts) if not part.is_file()]
    worked = in_parallel(
        partial(_drawn, count, seed), tuple, (tuple(models),), missing, workers, ray=ray, ordered=False
    )  # fmt: skip
    yield from kept_pieces(
        worked, lambda drawn: save_arrays(parts[drawn[0]], drawn[1]), groups - len(missing), groups, "groups of pairs"
    )
    loaded = [read_arrays(part) for part in parts]
    save_arrays(path, {name: np.concatenate([part[name] for part in loaded]) for name in loaded[0]})
    for part in parts:
        part.unlink()


def _drawn(count: int, seed: int, models: Sequence[ObjectModel], group: int) -> tuple[int, dict[str, np.ndarray]]:
    return group, _group_pairs(models, count, seed, group)


def _group_pairs(models: Sequence[ObjectModel], count: int, seed: int, group: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng((seed, group))
    ids = rng.choice(len(models), size=min(_GROUP, len(models)), replace=False)
    members = [models[i] for i in ids]
    parked = [pose_from_xyz_yaw(5.0 + 2.0 * i, 5.0, 0.0, 0.0) for i in range(len(members))]
    objects, poses, distances = [], [], []
    with TabletopWorld(members, parked) as world:
        for _ in range(count):
            a, b = rng.choice(len(members), size=2, replace=False)
            pose_a, pose_b = _relative_poses(members[a], members[b], rng)
            world.set_pose(a, pose_from_xyz_yaw(*pose_a))
            world.set_pose(b, pose_from_xyz_yaw(*pose_b))
            objects.append((ids[a], ids[b]))
            poses.append((pose_a, pose_b))
            distances.append(world.clearances(a, _REACH, among=[b]).get(int(b), _REACH))
            world.set_pose(a, parked[a])
            world.set_pose(b, parked[b])
    return {
        "objects": np.array(objects, dtype=np.int16),
        "poses": np.array(poses, dtype=np.float32),
        "distance": np.array(distances, dtype=np.float32),
    }


def _relative_poses(
    a: ObjectModel, b: ObjectModel, rng: np.random.Generator
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Draw poses (x, y, z, yaw) about the world's origin, close to contact: beside each other, or b above a."""
    yaw_a, yaw_b, direction = rng.uniform(-np.pi, np.pi, 3)
    along = np.array([np.cos(direction), np.sin(direction)])
    if rng.random() < 0.25:
        offset = 0.02 * abs(rng.standard_normal()) * along
        lift = a.height + 0.008 * rng.standard_normal()
    else:
        apart = separation_along(turned(a.footprint, yaw_a), turned(b.footprint, yaw_b), along, 0.0)
        offset = max(0.0, apart + 0.015 * rng.standard_normal()) * along
        lift = 0.0
    return (0.0, 0.0, 0.0, float(yaw_a)), (float(offset[0]), float(offset[1]), float(max(lift, 0.0)), float(yaw_b))

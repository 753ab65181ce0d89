"""Training scenes as object ids and poses, stored in shards (see `shards.py` for how they are drawn).

A shard depends on (seed, shard number) alone. It is written atomically and only once, so that an interrupted run can be
resumed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from grounding.atomic_files import opened, write_whole
from structdiffusion.data.batches import widened
from structdiffusion.data.npz_files import DataFolderError, read_arrays, save_arrays
from structdiffusion.data.shards import Shard, draw_shard
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import in_parallel, kept_pieces

SHARD_SCENES = 500
PROVEN = 1  # scenes of each exact shape in a shard that are also built in physics
SHARD_FACTS = "shards.jsonl"
_FACTS_FLAGS = os.O_RDWR | os.O_APPEND | os.O_CREAT


@dataclass(frozen=True)
class DemonstrationSet:
    """A set of D training scenes over M objects, with up to W = 7 that take part, or 10 if some scenes are crowded.

    Absent entries are -1 in `objects` and 0 elsewhere.

    Attributes:
        objects: (D, W + 2) int16 ids of the objects that take part, place by place, then of the distractors.
        initial: (D, W + 2, 3) float32 world x, y (m) and yaw (rad) before anything moves.
        goal: (D, W, 4) float32 world x, y, z (m) of the object frame and its turn from the initial yaw (rad).
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
        """Load all finished shards of a folder.

        Raises:
            FileNotFoundError: if there is none.
            DataFolderError: if one is truncated or damaged.
        """
        shards = sorted(Path(folder).glob("shard_*.npz"))
        if not shards:
            raise FileNotFoundError(f"{folder} has no shard_*.npz; `structagent generate --out {folder}` makes them")
        loaded = [read_arrays(shard, *cls.__dataclass_fields__) for shard in shards]
        places = max(shard["goal"].shape[1] for shard in loaded)
        loaded = [widened(shard, places) for shard in loaded]
        return cls(*(np.concatenate([shard[name] for shard in loaded]) for name in cls.__dataclass_fields__))


def save_library(models: Sequence[ObjectModel], folder: str | Path) -> None:
    """Write `library.npz`: surface points and normals (M, 1024, 3) float16, names and nouns (M,).

    Raises:
        DataFolderError: if the folder has a library of other objects.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "library.npz"
    library = {
        "points": np.stack([model.surface_points for model in models]).astype(np.float16),
        "normals": np.stack([model.surface_normals for model in models]).astype(np.float16),
        "names": np.array([model.name for model in models]),
        "categories": np.array([model.category for model in models]),
    }
    if not path.is_file():
        save_arrays(path, library)
        return
    there = read_arrays(path, *library)
    if any(not np.array_equal(there[name], array) for name, array in library.items()):
        raise DataFolderError(f"{path} has other objects than the {len(models)} given; choose another folder")


def generate(
    models: Sequence[ObjectModel],
    folder: str | Path,
    scenes: int,
    *,
    crowded: int = 0,
    seed: int = 0,
    workers: int = 0,
    ray: bool = False,
) -> Iterator[tuple[int, int]]:
    """Write demonstrations; yield (shards done, shards in all) as shards are finished.

    Args:
        models: the training objects; also written, as `library.npz`.
        folder: receives `library.npz`, `shard_*.npz` and `shards.jsonl`, the facts of each shard.
        scenes: the number of scenes, rounded up to whole shards of 500.
        crowded: the number of additional scenes with 8 to 10 objects in the structure, also rounded up.
        seed: the base seed.
        workers: the number of worker processes; 0 to use this process alone.
        ray: run the workers on the Ray cluster that this process is connected to.

    Raises:
        DataFolderError: if the folder has scenes of other objects or of another seed.
        WorkerError: at the end, if workers died and their shards are missing.
    """
    folder = Path(folder)
    save_library(models, folder)
    _remember_seed(folder, seed)
    wanted = [(number, False) for number in range(-(-scenes // SHARD_SCENES))]
    wanted += [(number, True) for number in range(-(-crowded // SHARD_SCENES))]
    missing = [job for job in wanted if not _shard_path(folder, *job).is_file()]
    shards = len(wanted)
    worked = in_parallel(
        partial(_drawn, seed, SHARD_SCENES, PROVEN), tuple, (tuple(models),), missing, workers, ray=ray, ordered=False
    )  # fmt: skip
    keep = partial(keep_shard, folder)
    yield from kept_pieces(worked, keep, shards - len(missing), shards, "shards of scenes")


def keep_shard(folder: Path, shard: Shard) -> None:
    """Write a shard. Its facts come first: if only they are written, the shard is drawn and recorded again."""
    path = _shard_path(folder, shard.number, shard.crowded)
    line = json.dumps({"shard": path.stem, **shard.facts}).encode() + b"\n"
    with opened(folder) as place, open(place.open(SHARD_FACTS, _FACTS_FLAGS), "ab+", buffering=0) as file:
        if size := file.seek(0, os.SEEK_END):
            file.seek(size - 1)
            line = line if file.read(1) == b"\n" else b"\n" + line  # a killed process left half a line
        file.write(line)
    save_arrays(path, shard.columns)


def _drawn(seed: int, scenes: int, proven: int, models: Sequence[ObjectModel], job: tuple[int, bool]) -> Shard:
    number, crowded = job
    return draw_shard(models, seed, number, scenes, proven, crowded)


def _shard_path(folder: Path, number: int, crowded: bool) -> Path:
    return folder / f"shard_{'crowded_' if crowded else ''}{number:05d}.npz"


def _remember_seed(folder: Path, seed: int) -> None:
    """Write the seed at the start, so that scenes of another seed cannot be mixed in later.

    Raises:
        DataFolderError: for a seed other than that of the scenes in the folder.
    """
    path = folder / "seed.json"
    # Data from before this file existed have the seed in their datasheet.
    known = next((file for file in (path, folder / "datasheet.json") if file.is_file()), None)
    if known is None:
        write_whole(path, json.dumps({"seed": seed}) + "\n")
        return
    try:
        there = json.loads(known.read_text())["seed"]
    except (ValueError, KeyError, TypeError) as error:
        raise DataFolderError(f"{known} does not state the seed of its scenes; choose another folder") from error
    if there != seed:
        raise DataFolderError(f"{folder} has scenes of seed {there}, and not of seed {seed}; choose another folder")

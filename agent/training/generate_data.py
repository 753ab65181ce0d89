"""`structagent generate`: training data on the cores of this machine or of a Ray cluster, with a datasheet."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from agent import __version__
from agent.runtime.progress import progress
from structdiffusion.parallel import WorkerError


@dataclass(frozen=True)
class DataWish:
    """What is to be drawn.

    Attributes:
        out: the folder; what is finished there is kept.
        scenes: how many, rounded up to whole shards.
        crowded: how many more with 8 to 10 objects, rounded up likewise.
        pairs: of objects, for the collision discriminator.
        objects: as `load_objects` takes it.
        seed: of everything.
    """

    out: Path
    scenes: int
    crowded: int
    pairs: int
    objects: str
    seed: int

    @property
    def command(self) -> str:
        """The command line that draws it."""
        return (
            f"structagent generate --out {shlex.quote(str(self.out))} --scenes {self.scenes} "
            f"--crowded {self.crowded} --pairs {self.pairs} --objects {self.objects} --seed {self.seed}"
        )


def generate_data(wish: DataWish, workers: int | None, ray: str | None) -> None:
    """Writes demonstrations, the sentences that go with them, pairs of objects and a datasheet; says where they are.

    Args:
        wish: what is drawn.
        workers: processes; `None` for one per core, of this machine or the cluster.
        ray: the address of a Ray cluster that does it (see `agent.runtime.ray_cluster`), or `None` for this machine.

    Raises:
        UsageError: when the cluster cannot be had.
        DataFolderError: when the folder has other data.
        WorkerError: when workers died; everything that they were not at is written, and the same command goes on.
    """
    from agent.runtime.ray_cluster import ray_cluster
    from agent.training.sentence_embeddings import write_language
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from structdiffusion.data.collision_pairs import generate_pairs
    from structdiffusion.data.datasheet import SHEET_TEXT, write_datasheet
    from structdiffusion.data.demonstrations import generate
    from structdiffusion.objects.libraries import load_objects

    models = load_objects(wish.objects)
    with ExitStack() as stack:
        count = stack.enter_context(ray_cluster(ray, workers)) if ray else workers or os.cpu_count() or 1
        how = {"seed": wish.seed, "workers": count, "ray": ray is not None}
        steps = {
            "shards of scenes": generate(models, wish.out, wish.scenes, crowded=wish.crowded, **how),
            "groups of pairs": generate_pairs(models, wish.out, wish.pairs, **how),
        }
        lost = [error for what, step in steps.items() if (error := _follow(what, step)) is not None]
    if lost:  # the datasheet is about all of it
        raise WorkerError("; ".join(map(str, lost)))
    if not (wish.out / "language.npz").is_file():
        print("embedding sentences, which takes a minute or two", file=sys.stderr)
        write_language(wish.out, SentenceEncoder(), wish.seed)
    about = {"version": __version__, "command": wish.command, "library": wish.objects, "seed": wish.seed}
    sheet = write_datasheet(wish.out, models, about)
    counted = f"{sheet['scenes']} scenes, {sheet['pairs']['pairs']} pairs and {sheet['sentences']} sentences"
    print(f"{counted} in {wish.out}; see {wish.out / SHEET_TEXT}")


def _follow(what: str, steps: Iterator[tuple[int, int]]) -> WorkerError | None:
    """Goes through the steps of some work, which says before the first and after each how many of how many are done.

    Returns:
        What is missing where workers died; `None` where nothing is.
    """
    done, total = next(steps)
    with progress(what, total, done) as tell:
        try:
            for _ in steps:
                tell()
        except WorkerError as error:
            return error
    return None

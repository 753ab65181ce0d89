"""Generate training data with a datasheet, on this machine or a Ray cluster: `structagent generate`."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent import __version__
from agent.runtime.jsonl_journal import locked_folder
from agent.runtime.progress import progress
from structdiffusion.parallel import WorkerError


@dataclass(frozen=True)
class DatasetConfig:
    """What to generate.

    Attributes:
        out: folder; finished shards in it are kept.
        scenes: number of scenes, rounded up to whole shards.
        crowded: number of additional scenes with 8 to 10 objects, rounded up likewise.
        pairs: number of object pairs for the collision discriminator.
        proposals: number of scenes whose judged proposals the outcome discriminator learns from, rounded up likewise.
        objects: as for `load_objects`.
        seed: of everything.
    """

    out: Path
    scenes: int
    crowded: int
    pairs: int
    proposals: int
    objects: str
    seed: int

    @property
    def command(self) -> str:
        """Return the command that generates it."""
        return (
            f"structagent generate --out {shlex.quote(str(self.out))} --scenes {self.scenes} "
            f"--crowded {self.crowded} --pairs {self.pairs} --proposals {self.proposals} "
            f"--objects {self.objects} --seed {self.seed}"
        )


def generate_data(config: DatasetConfig, workers: int | None, ray: str | None) -> None:
    """Write demonstrations, the sentences that go with them, pairs of objects and a datasheet; print a summary.

    Args:
        config: what to generate.
        workers: processes; `None` for one per core, of this machine or the cluster.
        ray: address of a Ray cluster that does the work (see `agent.runtime.ray_cluster`); `None` for this machine.

    Raises:
        UsageError: if the cluster cannot be used, or another process writes into the folder.
        DataFolderError: if the folder holds other data.
        WorkerError: if workers died; all other pieces are written, and the same command resumes.
    """
    from agent.runtime.ray_cluster import ray_cluster
    from agent.training.judged_proposals import generate_judged
    from agent.training.sentence_embeddings import write_language
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from structdiffusion.data.collision_pairs import generate_pairs
    from structdiffusion.data.datasheet import SHEET_TEXT, write_datasheet
    from structdiffusion.data.demonstrations import generate
    from structdiffusion.objects.libraries import load_objects

    models = load_objects(config.objects)
    with ExitStack() as stack:
        stack.enter_context(locked_folder(config.out, "structagent generate"))
        count = stack.enter_context(ray_cluster(ray, workers)) if ray else workers or os.cpu_count() or 1
        how: dict[str, Any] = {"seed": config.seed, "workers": count, "ray": ray is not None}
        steps = {
            "shards of scenes": generate(models, config.out, config.scenes, crowded=config.crowded, **how),
            "groups of pairs": generate_pairs(models, config.out, config.pairs, **how),
            "shards of judged proposals": generate_judged(models, config.out, config.proposals, **how),
        }
        lost = [error for what, step in steps.items() if (error := _follow(what, step)) is not None]
        if lost:  # the datasheet is about all of it
            raise WorkerError("; ".join(map(str, lost)))
        if not (config.out / "language.npz").is_file():
            print("embedding sentences, which takes a minute or two", file=sys.stderr)
            write_language(config.out, SentenceEncoder(), config.seed)
        about = {"version": __version__, "command": config.command, "library": config.objects, "seed": config.seed}
        sheet = write_datasheet(config.out, models, about)
    counted = f"{sheet['scenes']} scenes, {sheet['pairs']['pairs']} pairs and {sheet['sentences']} sentences"
    print(f"{counted} in {config.out}; see {config.out / SHEET_TEXT}")


def _follow(what: str, steps: Iterator[tuple[int, int]]) -> WorkerError | None:
    """Run the steps of some work and show the progress.

    Args:
        what: the pieces of the work are called.
        steps: give, before the first piece and after each, how many of how many pieces are done.

    Returns:
        The error when workers died; `None` if nothing is missing.
    """
    done, total = next(steps)
    with progress(what, total, done) as advance:
        try:
            for _ in steps:
                advance()
        except WorkerError as error:
            return error
    return None

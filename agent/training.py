"""The verbs that make models: their progress in the terminal, around `structdiffusion`'s own loops."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


def progress_bar() -> Progress:
    """A bar on standard error; it draws nothing where that is no terminal."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=Console(file=sys.stderr),
        disable=not sys.stderr.isatty(),
    )


def generate_scenes(out: Path, scenes: int, objects: str, seed: int, workers: int) -> None:
    """Writes demonstrations into `out` and says where they are."""
    from structdiffusion.demonstrations import generate
    from structdiffusion.objects.library import load_objects

    with progress_bar() as progress:
        task = progress.add_task("shards", total=None)
        for done, shards in generate(load_objects(objects), out, scenes, seed=seed, workers=workers):
            progress.update(task, completed=done, total=shards)
    print(f"{done} shards of 500 scenes: {out}")

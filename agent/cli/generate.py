"""Generate training data: `structagent generate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import ObjectsOption, PoolOption, RayOption, SeedOption
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import import_pybullet_silently


def generate(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the data; finished shards in it are kept.")],
    scenes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of scenes, rounded up to whole shards of 500.")
    ] = 10_000,
    crowded: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="Number of additional scenes with 8 to 10 objects, rounded up likewise."),
    ] = 0,
    pairs: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of object pairs for the collision discriminator.")
    ] = 100_000,
    proposals: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, help="Number of scenes with judged proposals of the diffusion model, in shards of 40."
        ),
    ] = 0,
    objects: ObjectsOption = "training",
    seed: SeedOption = 0,
    workers: PoolOption = None,
    ray: RayOption = None,
) -> None:
    """Generate training data.

    Scenes are arranged by the geometric planner, and stacks are checked in physics. A datasheet describes the data. The
    same command resumes a run that was stopped; in a finished folder it only rewrites the datasheet.

    Example: structagent generate --out data/train --scenes 20000 --workers 8
    """
    check_folder(out)
    import_pybullet_silently()
    from agent.training.generate_data import DatasetConfig, generate_data

    generate_data(DatasetConfig(out, scenes, crowded, pairs, proposals, objects, seed), workers, ray)

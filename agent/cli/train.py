"""The verbs that make models: `structagent generate` and `structagent train`."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import ModelKind, ObjectsOption, PoolOption, RayOption, SeedOption
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import import_pybullet_silently


class Precision(str, Enum):
    """In which numbers a network computes while it is trained."""

    float32 = "float32"
    bfloat16 = "bfloat16"


def generate(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the scenes go; finished shards there are kept.")],
    scenes: Annotated[int, typer.Option(min=1, help="How many, rounded up to whole shards of 500.")] = 10_000,
    crowded: Annotated[
        int, typer.Option(min=0, help="How many more in which 8 to 10 objects take part, rounded up likewise.")
    ] = 0,
    pairs: Annotated[int, typer.Option(min=1, help="Pairs of objects for the collision discriminator.")] = 100_000,
    objects: ObjectsOption = "training",
    seed: SeedOption = 0,
    workers: PoolOption = None,
    ray: RayOption = None,
) -> None:
    """Draw training scenes with the geometric planner, towers proven in physics; write a datasheet beside them.

    Called again, it goes on where it was stopped; of a finished folder it writes the datasheet anew.

    Example: structagent generate --out data/train --scenes 20000 --workers 8
    """
    check_folder(out)
    import_pybullet_silently()
    from agent.training.generate_data import DataWish, generate_data

    generate_data(DataWish(out, scenes, crowded, pairs, objects, seed), workers, ray)


def train(
    kind: Annotated[ModelKind, typer.Argument(metavar="|".join(ModelKind), show_default=False)],
    data: Annotated[Path, typer.Option(metavar="DIR", help="Scenes that `structagent generate` made.")],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Checkpoint, training state, log.csv and training.json of this run.")
    ],
    steps: Annotated[
        int | None, typer.Option(min=1, help="In all, earlier runs included; by default what suits the model.")
    ] = None,
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda", help="Where to train.")] = "auto",
    devices: Annotated[
        int, typer.Option(min=1, help="How many GPUs, or processor cores, train together, each on batches of its own.")
    ] = 1,
    precision: Annotated[
        Precision, typer.Option(help="In which a generator's transformer computes; weights stay float32.")
    ] = Precision.float32,
    seed: SeedOption = 0,
    learning_rate: Annotated[float | None, typer.Option(min=0.0, help="Its peak; by default what suits.")] = None,
    batch: Annotated[int | None, typer.Option(min=3, help="Scenes, or pairs, per step and device; likewise.")] = None,
) -> None:
    """Train a generator of poses or a discriminator; a run that was stopped goes on where it stopped.

    Example: structagent train diffusion --data data/train --out runs/diffusion --steps 12000
    """
    check_folder(out)
    from dataclasses import replace

    from agent.training.train import RECIPES, TrainingRun, train_model

    given = {"steps": steps, "learning_rate": learning_rate, "batch": batch}
    recipe = replace(RECIPES[kind.value], **{name: value for name, value in given.items() if value is not None})
    train_model(TrainingRun(kind.value, data, out, recipe, device, devices, precision.value, seed))

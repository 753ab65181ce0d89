"""The verbs that make models: their progress in the terminal, around `structdiffusion`'s own loops."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from agent.errors import UsageError
from grounding.spec import SHAPES
from structdiffusion.models import structformer_name

if TYPE_CHECKING:
    import torch

    from structdiffusion.models.checkpoint import Checkpointed
    from structdiffusion.training import Loss


@dataclass(frozen=True)
class Recipe:
    """What suits a model: optimiser steps, peak learning rate, and scenes (or pairs) per step."""

    steps: int
    learning_rate: float
    batch: int


# A baseline's step costs what one of the diffusion model does, of which each encoded scene serves six passes.
RECIPES = {
    "diffusion": Recipe(16_000, 8e-4, 32),
    "cvae": Recipe(16_000, 8e-4, 48),
    **{structformer_name(shape): Recipe(8_000, 8e-4, 48) for shape in SHAPES},
    "structure": Recipe(4_000, 1e-3, 32),
    "collision": Recipe(5_000, 1e-3, 64),
}
DEVICES = ("auto", "cpu", "cuda")


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


def generate_scenes(out: Path, scenes: int, pairs: int, objects: str, seed: int, workers: int) -> None:
    """Writes demonstrations, the sentences that go with them and pairs of objects into `out`; says where they are."""
    from agent.language_data import write_language
    from grounding.encoder import SentenceEncoder
    from structdiffusion.collision_pairs import generate_pairs
    from structdiffusion.demonstrations import SHARD_SCENES, generate
    from structdiffusion.objects.libraries import load_objects

    models = load_objects(objects)
    with progress_bar() as progress:
        task = progress.add_task("shards of scenes", total=None)
        for done, shards in generate(models, out, scenes, seed=seed, workers=workers):
            progress.update(task, completed=done, total=shards)
        task = progress.add_task("groups of pairs", total=None)
        for groups_done, groups in generate_pairs(models, out, pairs, seed=seed, workers=workers):
            progress.update(task, completed=groups_done, total=groups)
    sentences = write_language(out, SentenceEncoder(), seed)
    print(f"{done * SHARD_SCENES} scenes, {pairs} pairs and {sentences} sentences in {out}")


def train_model(kind: str, data: Path, out: Path, recipe: Recipe, device_name: str, seed: int) -> None:
    """Trains a model, or goes on where `out` stopped; tells every row of the log.

    Args:
        kind: one of `RECIPES`.
        data: a folder that `generate_scenes` made.
        out: receives the checkpoint, the training state and `log.csv`.
        recipe: how long, how fast, and on how much at once; steps of earlier runs are included.
        device_name: one of `DEVICES`.
        seed: of initial weights, batches and noise.
    """
    import torch

    from structdiffusion.models.checkpoint import default_device
    from structdiffusion.training import TrainingOptions, train

    if device_name not in DEVICES:
        raise UsageError(f"--device cannot be {device_name!r}; legal values: {', '.join(DEVICES)}")
    if device_name == "cuda" and not torch.cuda.is_available():
        raise UsageError("--device cannot be 'cuda' here: PyTorch finds no CUDA device; legal values: auto, cpu")
    device = default_device() if device_name == "auto" else torch.device(device_name)
    with torch.random.fork_rng():  # torch draws initial weights from its global generator alone
        torch.manual_seed(seed)
        model, loss = _TASKS[kind](data, device, recipe.batch)
    options = TrainingOptions(steps=recipe.steps, learning_rate=recipe.learning_rate, seed=seed)
    console = Console(soft_wrap=True, highlight=False)
    with progress_bar() as progress:
        task = progress.add_task(kind, total=recipe.steps)
        for row in train(model, loss, out, options, device):
            progress.update(task, completed=row.step)
            losses = "  ".join(f"{name} {value:.4f}" for name, value in row.losses.items())
            console.print(f"step {row.step}/{row.steps}  {row.seconds:.0f} s  {losses}")
    console.print(f"trained for {recipe.steps} steps on {device}: {out}")


def _diffusion(data: Path, device: torch.device, batch: int) -> tuple[Checkpointed, Loss]:
    from structdiffusion.batches import DemonstrationBatches
    from structdiffusion.models.diffusion.loss import diffusion_loss
    from structdiffusion.models.diffusion.model import PoseDiffusion
    from structdiffusion.scheduler import NoiseScheduler

    batches, model = DemonstrationBatches(data, device), PoseDiffusion().to(device)
    scheduler = NoiseScheduler(model.config.steps, model.config.prediction_type)
    return model, partial(diffusion_loss, model, scheduler, batches, scenes=batch)


def _cvae(data: Path, device: torch.device, batch: int) -> tuple[Checkpointed, Loss]:
    from structdiffusion.batches import DemonstrationBatches
    from structdiffusion.models.cvae.loss import cvae_loss
    from structdiffusion.models.cvae.model import PoseCVAE

    batches, model = DemonstrationBatches(data, device), PoseCVAE().to(device)
    return model, partial(cvae_loss, model, batches, scenes=batch)


def _structformer(shape: str, data: Path, device: torch.device, batch: int) -> tuple[Checkpointed, Loss]:
    from structdiffusion.batches import DemonstrationBatches
    from structdiffusion.models.structformer.loss import structformer_loss
    from structdiffusion.models.structformer.model import StructFormer, StructFormerConfig

    batches = DemonstrationBatches(data, device, shape=shape)
    model = StructFormer(StructFormerConfig(shape=shape)).to(device)
    return model, partial(structformer_loss, model, batches, scenes=batch)


def _structure(data: Path, device: torch.device, batch: int) -> tuple[Checkpointed, Loss]:
    from structdiffusion.batches import DemonstrationBatches
    from structdiffusion.models.structure.loss import structure_loss
    from structdiffusion.models.structure.model import StructureDiscriminator

    batches, model = DemonstrationBatches(data, device), StructureDiscriminator().to(device)
    return model, partial(structure_loss, model, batches, scenes=batch)


def _collision(data: Path, device: torch.device, batch: int) -> tuple[Checkpointed, Loss]:
    from structdiffusion.models.collision.loss import PairBatches, collision_loss
    from structdiffusion.models.collision.model import CollisionDiscriminator

    pairs, model = PairBatches.load(data, device), CollisionDiscriminator().to(device)
    return model, partial(collision_loss, model, pairs, size=batch)


_TASKS: dict[str, Callable[[Path, torch.device, int], tuple[Checkpointed, Loss]]] = {
    "diffusion": _diffusion,
    "cvae": _cvae,
    **{structformer_name(shape): partial(_structformer, shape) for shape in SHAPES},
    "structure": _structure,
    "collision": _collision,
}

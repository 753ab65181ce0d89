"""Train the networks for `structagent train`: their losses and data, and the progress of the training loop."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agent import __version__
from agent.errors import UsageError
from agent.runtime.jsonl_journal import locked_folder
from agent.runtime.progress import progress_bar
from agent.runtime.terminal_text import console_on
from agent.training.recipes import Recipe
from grounding.spec import FIRST_SHAPES
from structdiffusion.models import structformer_name

if TYPE_CHECKING:
    import torch

    from structdiffusion.models.checkpoint import Checkpointed, Network
    from structdiffusion.training.distributed import DistributedContext
    from structdiffusion.training.loss import Loss


DEVICES = ("auto", "cpu", "cuda")
FLOAT32, BFLOAT16 = "float32", "bfloat16"
PRECISIONS = (FLOAT32, BFLOAT16)
_DISCRIMINATORS = ("structure", "collision", "outcome")


@dataclass(frozen=True)
class TrainingRun:
    """A training run.

    Attributes:
        kind: one of `RECIPES`, or "strokes".
        data: folder that `structagent generate` wrote; `None` for "strokes", whose examples are drawn while it trains.
        out: folder for the checkpoint, the training state, `log.csv` and `training.json`.
        recipe: steps (earlier runs included), learning rate and batch size.
        device: one of `DEVICES`.
        devices: how many train together, each on its own batches.
        precision: one of `PRECISIONS`.
        seed: of initial weights, batches and noise.
        start: folder of a checkpoint to start from; `None` for random weights. A run that is resumed goes on from its
            own.
    """

    kind: str
    data: Path | None
    out: Path
    recipe: Recipe
    device: str = "auto"
    devices: int = 1
    precision: str = FLOAT32
    seed: int = 0
    start: Path | None = None


def train_model(run: TrainingRun) -> None:
    """Train a network, or resume its training; print every row of the log.

    Raises:
        UsageError: for a device or a precision that is not available, or a folder that another process writes into.
        FileNotFoundError: if a file of the data is missing.
        DataFolderError: if a file of the data is torn.
        CheckpointError: if the earlier run in the folder cannot be resumed.
        FloatingPointError: if the loss is not finite.
    """
    device = _device(run)
    if run.precision != FLOAT32 and run.kind in _DISCRIMINATORS:
        raise UsageError(
            f"--precision cannot be {run.precision!r} for {run.kind!r}, which resolves millimetres; legal: {FLOAT32}"
        )
    with locked_folder(run.out, "structagent train"):
        if run.devices == 1:
            _train(run, device)
        else:
            from structdiffusion.training.distributed import in_processes

            in_processes(_train_together, run.devices, run, device.type)


def chosen_device(name: str) -> torch.device:
    """Return the device of one of `DEVICES`.

    Raises:
        UsageError: for another name, or CUDA where there is none.
    """
    import torch

    from structdiffusion.models.checkpoint import default_device

    if name not in DEVICES:
        raise UsageError(f"--device cannot be {name!r}; legal values: {', '.join(DEVICES)}")
    if name == "cuda" and not torch.cuda.is_available():
        raise UsageError("--device cannot be 'cuda' here: PyTorch finds no CUDA device; legal values: auto, cpu")
    return default_device() if name == "auto" else torch.device(name)


def _device(run: TrainingRun) -> torch.device:
    import torch

    device = chosen_device(run.device)
    most = torch.cuda.device_count() if device.type == "cuda" else os.cpu_count() or 1
    if run.devices > most:
        what = "CUDA devices" if device.type == "cuda" else "processor cores"
        raise UsageError(f"--devices cannot be {run.devices} here; legal: 1 to {most}, the number of {what}")
    return device


def _train_together(run: TrainingRun, device_type: str) -> None:
    """Train in one of several processes."""
    from structdiffusion.training.distributed import DistributedContext

    distributed = DistributedContext(cpu=device_type == "cpu")
    _train(run, distributed.device, distributed)
    distributed.end()


def _train(run: TrainingRun, device: torch.device, distributed: DistributedContext | None = None) -> None:
    import torch

    from structdiffusion.models.checkpoint import file_facts
    from structdiffusion.training.loop import TrainingOptions, train
    from structdiffusion.training.run_record import RunMetadata, about_data

    with torch.random.fork_rng():  # torch draws initial weights from its global generator alone
        torch.manual_seed(run.seed)
        model, loss = _task(run)(device, run.recipe.batch, run.start)
    if run.precision != FLOAT32:
        loss = partial(loss, autocast=True)  # type: ignore[call-arg]  # losses of networks with a precision take it
    options = TrainingOptions(steps=run.recipe.steps, learning_rate=run.recipe.learning_rate, seed=run.seed)
    examples = {"collision": "pairs", "strokes": "arrangements"}.get(run.kind, "scenes")
    data = {"name": "drawn while it trains"} if run.data is None else about_data(run.data)
    start = file_facts(run.start) if run.start is not None else None
    metadata = RunMetadata(__version__, data, run.recipe.batch, examples, run.precision, start)
    is_first = distributed is None or distributed.rank == 0
    console = console_on(sys.stdout, soft_wrap=True, highlight=False, quiet=not is_first)
    with progress_bar(quiet=not is_first) as progress:
        task = progress.add_task(run.kind, total=run.recipe.steps)
        for row in train(model, loss, run.out, options, device, metadata=metadata, distributed=distributed):
            progress.update(task, completed=row.step)
            losses = "  ".join(f"{name} {value:.4f}" for name, value in row.losses.items())
            console.print(f"step {row.step}/{row.steps}  {row.seconds:.0f} s  {losses}")
    where = str(device) if distributed is None else f"{distributed.count} devices ({device.type})"
    console.print(f"trained for {run.recipe.steps} steps on {where}: {run.out}")


def _task(run: TrainingRun) -> Callable[[torch.device, int, Path | None], tuple[Checkpointed, Loss]]:
    """Return what makes the network and its loss of a device, a batch size and a checkpoint to start from."""
    return _strokes if run.data is None else partial(_TASKS[run.kind], run.data)


def _network(kind: type[Network], config: Any, start: Path | None) -> Network:
    """Make the network to train: of a config, or that of a checkpoint, which has its own sizes.

    Raises:
        CheckpointError: for a checkpoint that cannot be read, or one of a StructFormer for another shape.
    """
    from structdiffusion.models.checkpoint import CheckpointError, grown

    if start is None:
        return kind(config)
    network = grown(kind, start, getattr(config, "vocabulary", 0))
    if getattr(network.config, "shape", None) != getattr(config, "shape", None):
        raise CheckpointError(f"{start} is the network for a {network.config.shape}; expected one for a {config.shape}")
    return network


def _diffusion(data: Path, device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.data.batches import DemonstrationBatches
    from structdiffusion.models.diffusion.loss import diffusion_loss
    from structdiffusion.models.diffusion.model import DiffusionConfig, PoseDiffusion
    from structdiffusion.models.diffusion.scheduler import NoiseScheduler

    batches = DemonstrationBatches(data, device)
    model = _network(PoseDiffusion, DiffusionConfig(vocabulary=batches.vocabulary), start).to(device)
    scheduler = NoiseScheduler(model.config.steps, model.config.prediction_type)
    return model, partial(diffusion_loss, model, scheduler, batches, scenes=batch)


def _cvae(data: Path, device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.data.batches import DemonstrationBatches
    from structdiffusion.models.cvae.loss import cvae_loss
    from structdiffusion.models.cvae.model import CVAEConfig, PoseCVAE

    batches = DemonstrationBatches(data, device)
    model = _network(PoseCVAE, CVAEConfig(vocabulary=batches.vocabulary), start).to(device)
    return model, partial(cvae_loss, model, batches, scenes=batch)


def _structformer(
    shape: str, data: Path, device: torch.device, batch: int, start: Path | None
) -> tuple[Checkpointed, Loss]:
    from structdiffusion.data.batches import DemonstrationBatches
    from structdiffusion.models.structformer.loss import structformer_loss
    from structdiffusion.models.structformer.model import StructFormer, StructFormerConfig

    batches = DemonstrationBatches(data, device, shape=shape)
    model = _network(StructFormer, StructFormerConfig(shape=shape), start).to(device)
    return model, partial(structformer_loss, model, batches, scenes=batch)


def _structure(data: Path, device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.data.batches import DemonstrationBatches
    from structdiffusion.models.structure.loss import structure_loss
    from structdiffusion.models.structure.model import StructureConfig, StructureDiscriminator

    batches = DemonstrationBatches(data, device)
    model = _network(StructureDiscriminator, StructureConfig(vocabulary=batches.vocabulary), start).to(device)
    return model, partial(structure_loss, model, batches, scenes=batch)


def _collision(data: Path, device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.models.collision.loss import PairBatches, collision_loss
    from structdiffusion.models.collision.model import CollisionConfig, CollisionDiscriminator

    pairs = PairBatches.load(data, device)
    model = _network(CollisionDiscriminator, CollisionConfig(), start).to(device)
    return model, partial(collision_loss, model, pairs, size=batch)


def _outcome(data: Path, device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.models.outcome.loss import judged_scenes, outcome_loss
    from structdiffusion.models.outcome.model import OutcomeConfig, OutcomeDiscriminator

    scenes = list(judged_scenes(data))
    model = _network(OutcomeDiscriminator, OutcomeConfig(), start).to(device)
    return model, partial(outcome_loss, model, scenes, size=batch)


def _strokes(device: torch.device, batch: int, start: Path | None) -> tuple[Checkpointed, Loss]:
    from structdiffusion.models.strokes.loss import stroke_loss
    from structdiffusion.models.strokes.model import StrokeConfig, StrokeNetwork

    model = _network(StrokeNetwork, StrokeConfig(), start).to(device)
    return model, partial(stroke_loss, model, size=batch)


_TASKS: dict[str, Callable[[Path, torch.device, int, Path | None], tuple[Checkpointed, Loss]]] = {
    "diffusion": _diffusion,
    "cvae": _cvae,
    **{structformer_name(shape): partial(_structformer, shape) for shape in FIRST_SHAPES},
    "structure": _structure,
    "collision": _collision,
    "outcome": _outcome,
}

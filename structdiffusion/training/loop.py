"""One training loop for all models: AdamW, warm-up and decay, averaged weights, a CSV log, checkpoints that resume.

Runs on CPU and CUDA alike, on several devices with `structdiffusion.training.distributed`. What differs between models is
their loss, a function of a generator.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from pickle import UnpicklingError
from typing import TYPE_CHECKING

import torch

from structdiffusion.models.checkpoint import Checkpointed, CheckpointError
from structdiffusion.training.loss import Loss
from structdiffusion.training.run_record import Surroundings, TrainingRecord

if TYPE_CHECKING:
    from structdiffusion.training.distributed import Together

_STATE_NAME = "training_state.pt"
_APART = 0x9E3779B1  # between the seeds of devices: in the lower 32 bits, which are all that a CPU's generator takes


@dataclass(frozen=True)
class TrainingOptions:
    """How long and how fast.

    Attributes:
        steps: optimiser steps in all; a resumed run may be given more.
        learning_rate: its peak.
        warmup: steps of linear warm-up.
        decay: the share of the steps, at the end, over which the rate falls to zero (linear).
        weight_decay: of AdamW.
        clip: largest gradient norm.
        average: decay of the moving average of the weights, which is what is saved.
        seed: of initial weights, batches and noise.
        log_every: steps between rows of the log.
        save_seconds: between checkpoints.
    """

    steps: int
    learning_rate: float = 6e-4
    warmup: int = 300
    decay: float = 0.3
    weight_decay: float = 0.01
    clip: float = 1.0
    average: float = 0.999
    seed: int = 0
    log_every: int = 50
    save_seconds: float = 120.0


@dataclass(frozen=True)
class Progress:
    """A row of the log: where the run is, and the mean of the losses since the last row."""

    step: int
    steps: int
    seconds: float
    learning_rate: float
    losses: dict[str, float]


def learning_rate(step: int, options: TrainingOptions) -> float:
    """Warm up, hold, then fall linearly: a held rate lets a run be prolonged without a restart."""
    falling = options.steps * options.decay
    return options.learning_rate * min(
        1.0, (step + 1) / options.warmup, max(0.0, (options.steps - step) / max(falling, 1.0))
    )


def train(
    model: Checkpointed,
    loss: Loss,
    folder: str | Path,
    options: TrainingOptions,
    device: torch.device,
    *,
    surroundings: Surroundings | None = None,
    together: Together | None = None,
) -> Iterator[Progress]:
    """Train, or go on where `folder` stopped; yields a `Progress` for every row of `folder`/log.csv.

    `folder` receives `config.json` and `model.safetensors` (averaged weights), the training state and the log.
    Several devices draw a batch each, from generators of their own, and step by the mean of their gradients.

    Args:
        model: on `device`.
        loss: draws a batch and returns named losses; "loss" is minimised.
        folder: of this run.
        options: see `TrainingOptions`.
        device: where model and batches live.
        surroundings: what is written into `folder`/training.json beside what the run knows; `None` writes none.
        together: this process among those that train the model; `None` for a single device.

    Raises:
        CheckpointError: when what is in the folder cannot be gone on with.
    """
    folder, rank = Path(folder), together.rank if together else 0
    folder.mkdir(parents=True, exist_ok=True)
    optimizer = torch.optim.AdamW(
        model.parameters(), lr=options.learning_rate, weight_decay=options.weight_decay, fused=True
    )
    average = {name: tensor.detach().clone() for name, tensor in model.state_dict().items()}
    step, spent = 0, 0.0
    state_path = folder / _STATE_NAME
    if state_path.is_file():
        try:
            state = torch.load(state_path, map_location=device, weights_only=True)
            model.load_state_dict(state["model"])
            optimizer.load_state_dict(state["optimizer"])
            average, step, spent = state["average"], state["step"], state["seconds"]
        except (RuntimeError, ValueError, KeyError, TypeError, EOFError, UnpicklingError) as error:
            why = f"it is torn, or not that of a {model.kind} network like this one"
            raise CheckpointError(f"{state_path} cannot be gone on with: {why}; choose another folder") from error
    # A resumed run draws other batches than those already seen, yet the same ones every time.
    seed = options.seed * 1_000_003 + step + rank * _APART
    generator = torch.Generator(device=device).manual_seed(seed % 2**64)
    losses_of = together.averaged(model, loss) if together else loss
    record = None
    if surroundings is not None and rank == 0:
        count = together.count if together else 1
        record = TrainingRecord(folder, model, asdict(options), surroundings, device, count, step, spent)

    def save() -> None:
        trained = {name: tensor.clone() for name, tensor in model.state_dict().items()}
        state = {"model": trained, "optimizer": optimizer.state_dict(), "average": average}
        state |= {"step": step, "seconds": spent}
        torch.save(state, state_path.with_suffix(".tmp"))
        state_path.with_suffix(".tmp").replace(state_path)
        model.load_state_dict(average)
        model.save_pretrained(folder)
        model.load_state_dict(trained)
        if record is not None:
            record.write(step, spent, means)

    model.train()
    started = last_saved = time.monotonic()
    sums: dict[str, float] = {}
    means: dict[str, float] = {}  # of the last row of the log
    rows = 0  # steps since the last row of the log
    while step < options.steps:
        rate = learning_rate(step, options)
        for group in optimizer.param_groups:
            group["lr"] = rate
        losses = losses_of(generator)
        optimizer.zero_grad(set_to_none=True)
        losses["loss"].backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), options.clip)
        optimizer.step()
        step += 1
        keep = min(options.average, (step + 1) / (step + 10))  # the first steps are forgotten fast
        with torch.no_grad():
            for name, tensor in model.state_dict().items():
                average[name].lerp_(tensor, 1 - keep) if tensor.is_floating_point() else average[name].copy_(tensor)
        for name, value in losses.items():
            sums[name] = sums.get(name, 0.0) + float(value.detach())
        rows += 1
        now = time.monotonic()
        if step % options.log_every == 0 or step == options.steps:
            means = {name: value / rows for name, value in sums.items()}
            means = together.mean(means) if together else means
            sums, rows = {}, 0
            progress = Progress(step, options.steps, spent + now - started, rate, means)
            if not all(math.isfinite(value) for value in means.values()):
                raise FloatingPointError(f"the loss is {means} at step {step}; lower the learning rate")
            if rank == 0:
                _log(folder / "log.csv", progress)
            # Only here, where the loss is known to be a number still.
            if rank == 0 and (now - last_saved > options.save_seconds or step == options.steps):
                spent, started, last_saved = spent + now - started, now, now
                save()
            yield progress
    model.load_state_dict(average)
    model.eval()


def _log(path: Path, progress: Progress) -> None:
    fresh = not path.is_file()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if fresh:
            writer.writerow(["step", "seconds", "learning_rate", *progress.losses])
        values = [f"{value:.6f}" for value in progress.losses.values()]
        writer.writerow([progress.step, f"{progress.seconds:.1f}", f"{progress.learning_rate:.2e}", *values])

"""One training loop for all models: AdamW, warm-up and decay, averaged weights, a CSV log, checkpoints that resume.

Runs on CPU and CUDA alike, on several devices with `structdiffusion.training.distributed`. What differs between models
is their loss, a function of a generator.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from grounding.atomic_files import write_whole
from structdiffusion.models.checkpoint import Checkpointed
from structdiffusion.training.loss import Loss
from structdiffusion.training.run_record import RunMetadata, TrainingRecord
from structdiffusion.training.state import TrainingState

if TYPE_CHECKING:
    from structdiffusion.training.distributed import DistributedContext

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
        average: decay of the moving average of the weights, which is saved.
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
    """A row of the log: the progress of the run, and the mean losses since the last row."""

    step: int
    steps: int
    seconds: float
    learning_rate: float
    losses: dict[str, float]


def learning_rate(step: int, options: TrainingOptions) -> float:
    """Return the rate of a step: warm up, hold, then fall linearly. A held rate lets a run be prolonged without a
    restart.
    """
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
    metadata: RunMetadata | None = None,
    distributed: DistributedContext | None = None,
) -> Iterator[Progress]:
    """Train, or continue where `folder` stopped; yields a `Progress` for every row of `folder`/log.csv.

    `folder` receives `config.json` and `model.safetensors` (averaged weights), the training state and the log.
    Several devices draw a batch each, from generators of their own, and step by the mean of their gradients.

    Args:
        model: on `device`.
        loss: draws a batch and returns named losses; "loss" is minimised.
        folder: of this run.
        options: see `TrainingOptions`.
        device: where model and batches live.
        metadata: further content of `folder`/training.json; `None` writes no file.
        distributed: this process among those that train the model; `None` for a single device.

    Raises:
        CheckpointError: if what is in the folder cannot be resumed.
        FloatingPointError: if the loss is no longer finite.
    """
    folder, rank = Path(folder), distributed.rank if distributed else 0
    folder.mkdir(parents=True, exist_ok=True)
    state = TrainingState.resumed(model, options.learning_rate, options.weight_decay, folder, device)
    generator = torch.Generator(device=device)
    if rank == 0:
        _shorten_log(folder / "log.csv", state.step)
    losses_of = distributed.averaged(model, loss) if distributed else loss
    record: TrainingRecord | None = None
    if metadata is not None and rank == 0:
        context = asdict(options), metadata, device, distributed.count if distributed else 1
        record = TrainingRecord(folder, model, *context, state.step, state.seconds)
    model.train()
    started = last_saved = time.monotonic()
    means = _RunningMeans()
    while state.step < options.steps:
        rate = learning_rate(state.step, options)
        losses = losses_of(generator.manual_seed(_batch_seed(options.seed, state.step, rank)))
        state.optimise(losses["loss"], rate, options.clip, options.average)
        means.add(losses)
        now, last = time.monotonic(), state.step == options.steps
        if state.step % options.log_every == 0 or last:
            row = _finite_means(means, distributed, state.step)
            progress = Progress(state.step, options.steps, state.seconds + now - started, rate, row)
            if rank == 0:
                _log(folder / "log.csv", progress)
            # Only here, where the loss is known to be a number still.
            if rank == 0 and (now - last_saved > options.save_seconds or last):
                state.seconds, started, last_saved = state.seconds + now - started, now, now
                state.save_weights(folder)
                if record is not None:
                    record.write(state.step, state.seconds, row)
                state.save(folder)
            yield progress
    model.load_state_dict(state.average)
    model.eval()


def _finite_means(means: _RunningMeans, distributed: DistributedContext | None, step: int) -> dict[str, float]:
    """Return the mean losses over all processes.

    Raises:
        FloatingPointError: if one is not finite.
    """
    row = means.take()
    row = distributed.mean(row) if distributed else row
    if not all(math.isfinite(value) for value in row.values()):
        raise FloatingPointError(f"the loss is {row} at step {step}; lower the learning rate")
    return row


def _batch_seed(seed: int, step: int, rank: int) -> int:
    """Return the seed of a step's batch and noise: a run that was stopped draws what it would have drawn."""
    return (seed * 1_000_003 + step + rank * _APART) % 2**64


class _RunningMeans:
    """The means of named losses since they were last taken."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}
        self._count = 0

    def add(self, losses: Mapping[str, Tensor]) -> None:
        """Count the losses of one step."""
        for name, value in losses.items():
            self._sums[name] = self._sums.get(name, 0.0) + float(value.detach())
        self._count += 1

    def take(self) -> dict[str, float]:
        """Return the means, and start anew."""
        means = {name: value / self._count for name, value in self._sums.items()}
        self._sums, self._count = {}, 0
        return means


def _shorten_log(path: Path, step: int) -> None:
    """Remove the rows behind a step from the log: of a run that was killed after it had last saved its state."""
    if not path.is_file():
        return
    head, *rows = path.read_text().splitlines(keepends=True) or [""]
    kept = [row for row in rows if row.endswith("\n") and int(row.partition(",")[0]) <= step]
    if kept != rows:
        write_whole(path, head + "".join(kept))


def _log(path: Path, progress: Progress) -> None:
    fresh = not path.is_file()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if fresh:
            writer.writerow(["step", "seconds", "learning_rate", *progress.losses])
        values = [f"{value:.6f}" for value in progress.losses.values()]
        writer.writerow([progress.step, f"{progress.seconds:.1f}", f"{progress.learning_rate:.2e}", *values])

"""One training loop for all models: AdamW, warm-up and decay, averaged weights, a CSV log, checkpoints that resume.

Runs on CPU and CUDA alike. What differs between models is their loss, a function of a generator.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from structdiffusion.models.checkpoint import Checkpointed

Loss = Callable[[torch.Generator], dict[str, Tensor]]
_STATE_NAME = "training_state.pt"


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
    model: Checkpointed, loss: Loss, folder: str | Path, options: TrainingOptions, device: torch.device
) -> Iterator[Progress]:
    """Train, or go on where `folder` stopped; yields a `Progress` for every row of `folder`/log.csv.

    `folder` receives `config.json` and `model.safetensors` (averaged weights), the training state and the log.

    Args:
        model: on `device`.
        loss: draws a batch and returns named losses; "loss" is minimised.
        folder: of this run.
        options: see `TrainingOptions`.
        device: where model and batches live.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    optimizer = torch.optim.AdamW(model.parameters(), lr=options.learning_rate, weight_decay=options.weight_decay, fused=True)
    average = {name: tensor.detach().clone() for name, tensor in model.state_dict().items()}
    step, spent = 0, 0.0
    state_path = folder / _STATE_NAME
    if state_path.is_file():
        state = torch.load(state_path, map_location=device, weights_only=True)
        model.load_state_dict(state["model"])
        optimizer.load_state_dict(state["optimizer"])
        average, step, spent = state["average"], state["step"], state["seconds"]
    # A resumed run draws other batches than those already seen, yet the same ones every time.
    generator = torch.Generator(device=device).manual_seed(options.seed * 1_000_003 + step)

    def save() -> None:
        trained = {name: tensor.clone() for name, tensor in model.state_dict().items()}
        state = {"model": trained, "optimizer": optimizer.state_dict(), "average": average, "step": step, "seconds": spent}
        torch.save(state, state_path.with_suffix(".tmp"))
        state_path.with_suffix(".tmp").replace(state_path)
        model.load_state_dict(average)
        model.save_pretrained(folder)
        model.load_state_dict(trained)

    model.train()
    started = last_saved = time.monotonic()
    sums: dict[str, float] = {}
    rows = 0  # steps since the last row of the log
    while step < options.steps:
        rate = learning_rate(step, options)
        for group in optimizer.param_groups:
            group["lr"] = rate
        losses = loss(generator)
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
            sums, rows = {}, 0
            progress = Progress(step, options.steps, spent + now - started, rate, means)
            if not all(math.isfinite(value) for value in means.values()):
                raise FloatingPointError(f"the loss is {means} at step {step}; lower the learning rate")
            _log(folder / "log.csv", progress)
            yield progress
        if now - last_saved > options.save_seconds or step == options.steps:
            spent, started, last_saved = spent + now - started, now, now
            save()
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

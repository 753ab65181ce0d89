"""Take the steps of a training, and draw the batches for them."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from torch import nn

Report = Callable[[str], None]
_Drawn = TypeVar("_Drawn")


@dataclass(frozen=True)
class Training:
    """How to train; each training has its own defaults.

    Attributes:
        out: file or folder for the weights.
        steps: of the optimiser, each on one batch.
        start: weights to train further; `None` begins as the training says.
        rate: peak learning rate, or a factor of it.
        seed: of what is drawn, the initial weights and dropout.
        threads: of torch; only one repeats exactly.

    Raises:
        ValueError: for no step, no thread, or a rate that is not positive.
    """

    out: Path
    steps: int = 1000
    start: Path | None = None
    rate: float = 1e-3
    seed: int = 0
    threads: int = 1

    def __post_init__(self) -> None:
        for name in ("steps", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if not self.rate > 0.0:
            raise ValueError(f"rate must be positive, not {self.rate}")


def silent(line: str) -> None:
    """Report nothing."""


def one_cycle(
    groups: Iterable[tuple[Iterable[nn.Parameter], float]], steps: int
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    """Return AdamW and a schedule of one cycle: up for a tenth of the steps, then down.

    Args:
        groups: weights, and their peak learning rate.
        steps: of the optimiser.
    """
    optimiser = torch.optim.AdamW(
        [{"params": list(weights), "lr": rate} for weights, rate in groups], weight_decay=0.01
    )
    rates = [group["lr"] for group in optimiser.param_groups]
    # A cycle of one step more, as its last step has no rate.
    return optimiser, torch.optim.lr_scheduler.OneCycleLR(optimiser, rates, total_steps=steps + 1, pct_start=0.1)


def split_weights(network: nn.Module, layers: str) -> tuple[list[nn.Parameter], list[nn.Parameter]]:
    """Return a network's weights whose names begin with `layers`, which know English already, and the others."""
    named = list(network.named_parameters())
    return [each for name, each in named if name.startswith(layers)], [
        each for name, each in named if not name.startswith(layers)
    ]


def take_steps(
    losses: Iterable[torch.Tensor],
    steps: int,
    optimiser: torch.optim.Optimizer,
    schedule: torch.optim.lr_scheduler.LRScheduler,
    report: Report,
    reported: int = 100,
    more: Callable[[], str] = lambda: "",
) -> Iterator[int]:
    """Take a step for each loss, and yield its number after it.

    Args:
        losses: scalars, each computed when its step is taken.
        steps: how many are taken.
        optimiser: of the weights, whose gradients are clipped to a norm of 1.
        schedule: of its learning rates.
        report: takes a line of progress.
        reported: steps between two lines.
        more: makes what a line has besides.
    """
    weights = [weight for group in optimiser.param_groups for weight in group["params"]]
    started, recent = time.perf_counter(), deque[float](maxlen=reported)
    for step, loss in enumerate(islice(losses, steps), start=1):
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(weights, 1.0)
        optimiser.step()
        schedule.step()
        recent.append(loss.item())
        if step % reported == 0 or step == steps:
            report(f"step {step} of {steps}, loss {np.mean(recent):.3f}{more()}, {time.perf_counter() - started:.0f} s")
        yield step


def by_length(
    drawn: Iterator[_Drawn], size: int, bucket: int, length: Callable[[_Drawn], int], rng: np.random.Generator
) -> Iterator[list[_Drawn]]:
    """Draw batches of like length, which need little padding, in random order.

    Args:
        drawn: what is drawn, with or without end.
        size: of a batch.
        bucket: among how many batches those of like length are chosen.
        length: of what is drawn.
        rng: draws the order.
    """
    while chunk := sorted(islice(drawn, size * bucket), key=length):
        for start in rng.permutation(range(0, len(chunk), size)):
            yield chunk[start : start + size]

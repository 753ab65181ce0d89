"""Train the segmentation network: views are drawn in other processes while it learns from those there are."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.util import get_temp_dir
from pathlib import Path
from typing import Any

import numpy as np
import torch

from agent import __version__
from agent.training.segmentation import pool
from agent.training.segmentation.batches import Example, draw_batch
from agent.training.segmentation.loss import segmentation_loss
from agent.training.segmentation.network import SegmentationConfig, SegmentationNetwork
from agent.training.segmentation.pool import Pool
from structdiffusion.training.loop import TrainingOptions, train
from structdiffusion.training.run_record import RunMetadata
from structdiffusion.worker_process import serve_parent, without_interruptions

VIEWS = "views"  # the folder of the pool, in that of the run
_FIRST = 2  # shards there are before the training begins
_CALIBRATED = 24  # views that show the statistics of the network to continue from
_LOOK_AGAIN = 50  # steps between looks for further shards


@dataclass(frozen=True)
class SegmentationTraining:
    """How to train the segmentation network.

    Attributes:
        out: folder for the network, the state of the training, its log and the views.
        steps: of the optimiser, earlier runs included.
        batch: views of each step.
        views: to draw; each is used several times, varied.
        learning_rate: its peak.
        seed: of views, batches and initial weights.
        device: of torch.
        workers: processes that draw views.
        start: folder of a network to continue from; `None` for random weights.
    """

    out: Path
    steps: int
    batch: int
    views: int
    learning_rate: float
    seed: int
    device: torch.device
    workers: int
    start: Path | None = None


def train_network(options: SegmentationTraining, report: Callable[[str], None]) -> None:
    """Train the network, or resume its training.

    Args:
        options: how, and where to write.
        report: takes a line of progress after every fifty steps.

    Raises:
        CheckpointError: if the earlier run in the folder cannot be resumed, or there is no network to start from.
        FloatingPointError: if the loss is not finite.
    """
    folder = options.out / VIEWS
    folder.mkdir(parents=True, exist_ok=True)
    with torch.random.fork_rng():
        torch.manual_seed(options.seed)  # torch draws initial weights from its global generator alone
        network = SegmentationNetwork(SegmentationConfig())
    layout: Any = {"memory_format": torch.channels_last}  # torch takes it, and its types do not
    network = network.to(options.device, **layout)
    schedule = TrainingOptions(steps=options.steps, learning_rate=options.learning_rate, seed=options.seed)
    about = {"name": "synthetic tables", "seed": options.seed, "views": options.views}
    metadata = RunMetadata(__version__, about, options.batch, "views")
    with _drawing(folder, options):
        views = _Views(folder)
        if options.start is not None:
            seen = views.drawn(_CALIBRATED, np.random.default_rng(options.seed))
            network.start_from(options.start, _inputs(seen, options.device))

        def loss(generator: torch.Generator) -> dict[str, torch.Tensor]:
            examples = views.batch(options.batch, generator)
            return segmentation_loss(network(_inputs(examples, options.device)), examples, generator)

        for row in train(network, loss, options.out, schedule, options.device, metadata=metadata):
            losses = "  ".join(f"{name} {value:.3f}" for name, value in row.losses.items())
            report(f"step {row.step}/{row.steps}  {row.seconds:.0f} s  {views.count} views  {losses}")


def _inputs(examples: Sequence[Example], device: torch.device) -> torch.Tensor:
    """Return the network's input (B, CHANNELS, H, W) of some examples."""
    maps = torch.from_numpy(np.stack([one.maps for one in examples]))
    return maps.to(device).contiguous(memory_format=torch.channels_last)


class _Views:
    """The views of a pool, which grows."""

    def __init__(self, folder: Path) -> None:
        self._pool, self._steps = Pool(folder), 0
        while self._pool.count < _FIRST * pool.PER_SHARD:
            time.sleep(1.0)
            self._pool.refresh()

    @property
    def count(self) -> int:
        """Return how many there are."""
        return self._pool.count

    def drawn(self, size: int, rng: np.random.Generator) -> list[Example]:
        """Draw some views, each varied."""
        return draw_batch(self._pool, size, rng)

    def batch(self, size: int, generator: torch.Generator) -> list[Example]:
        """Draw the views of a step."""
        self._steps += 1
        if self._steps % _LOOK_AGAIN == 0:
            self._pool.refresh()
        seed = int(torch.randint(2**62, (1,), generator=generator, device=generator.device))
        return self.drawn(size, np.random.default_rng(seed))


def _draw(temporary: str, *what: Any) -> None:
    serve_parent(temporary)
    pool.fill(*what)


@contextmanager
def _drawing(folder: Path, options: SegmentationTraining) -> Iterator[None]:
    """Let other processes draw views as long as the training lasts."""
    context = multiprocessing.get_context("spawn")
    shards = max(_FIRST, -(-options.views // pool.PER_SHARD))
    count = min(options.workers, len(pool.missing(folder, shards)))
    workers = [
        context.Process(target=_draw, args=(get_temp_dir(), folder, k, shards, count, options.seed), daemon=True)
        for k in range(count)
    ]
    with without_interruptions():
        for worker in workers:
            worker.start()
    try:
        yield
    finally:
        for worker in workers:
            worker.terminate()

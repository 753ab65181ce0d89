"""Run `structagent train segmentation`: choose the device, train, print the progress."""

from __future__ import annotations

from pathlib import Path

import torch

from agent.runtime.jsonl_journal import locked_folder
from agent.training.segmentation.training import SegmentationTraining, train_network
from agent.training.train import chosen_device


def train_segmentation_network(
    out: Path,
    steps: int,
    batch: int,
    views: int,
    workers: int,
    device: str,
    learning_rate: float,
    seed: int,
    threads: int,
    start: Path | None = None,
) -> None:
    """Train the segmentation network, or resume its training; print every row of the log.

    Args:
        out, steps, batch, views, learning_rate, seed, workers, start: as `SegmentationTraining` takes them.
        device: one of `agent.training.train.DEVICES`.
        threads: of torch.

    Raises:
        UsageError: for a device that is not available, or a folder that another process writes into.
        CheckpointError: if the earlier run in the folder cannot be resumed.
        FloatingPointError: if the loss is not finite.
    """
    where = chosen_device(device)
    torch.set_num_threads(threads)
    options = SegmentationTraining(out, steps, batch, views, learning_rate, seed, where, workers, start)
    with locked_folder(out, "structagent train"):
        train_network(options, lambda line: print(line, flush=True))
    print(f"trained for {steps} steps on {where}: {out}")

"""Training on several devices: a process for each, which average their gradients (by Hugging Face Accelerate).

Only for more than one device; one needs torch and numpy alone.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
from collections.abc import Callable, Mapping
from multiprocessing.util import get_temp_dir
from typing import TYPE_CHECKING, Any

import torch
from accelerate import Accelerator
from torch import Tensor, nn
from torch.multiprocessing import start_processes

from structdiffusion.data.npz_files import DataFolderError
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.worker_process import safe_path, serve_parent, without_interruptions, worker_context

if TYPE_CHECKING:
    from structdiffusion.training.loss import Loss


class DistributedContext:
    """One of the processes that train a model; all of them have to call every method.

    Args:
        cpu: use processor cores even if there are GPUs.

    Attributes:
        rank: index of the process from 0; the first process reports and saves.
        count: the number of processes.
        device: the device of this process.
    """

    def __init__(self, cpu: bool) -> None:
        self._accelerator = Accelerator(cpu=cpu)
        self.rank, self.count = self._accelerator.process_index, self._accelerator.num_processes
        # A numbered CPU, "cpu:0", is no place that a saved state can be loaded to.
        own = self._accelerator.device
        self.device = torch.device("cpu") if own.type == "cpu" else own

    def averaged(self, model: nn.Module, loss: Loss) -> Loss:
        """Wrap the loss so that gradients of `model` are averaged over all processes; weights start as the first's."""
        return self._accelerator.prepare(_LossOf(model, loss))

    def mean(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the mean of each value over all processes."""
        tensor = torch.tensor(list(values.values()), dtype=torch.float32, device=self.device)
        return dict(zip(values, self._accelerator.reduce(tensor, "mean").tolist(), strict=True))

    def end(self) -> None:
        """Wait for the other processes, and leave the group."""
        self._accelerator.wait_for_everyone()
        self._accelerator.end_training()


class _LossOf(nn.Module):
    """A loss as a module: gradients are averaged for what a module's forward computes, and a loss calls more of the
    network than its forward."""

    def __init__(self, model: nn.Module, loss: Loss) -> None:
        super().__init__()
        self.model = model
        self.loss = loss

    def forward(self, generator: torch.Generator) -> dict[str, Tensor]:
        return self.loss(generator)


def in_processes(work: Callable[..., None], count: int, *arguments: Any) -> None:
    """Run `work(*arguments)` in `count` new processes, each of which may make a `DistributedContext`.

    Raises:
        Exception: the exception that ended a process; the others are stopped.
        ProcessRaisedException: if that exception cannot be transferred; with its traceback.
    """
    # The caller reports the error that ended a process; that the others were stopped is not worth a message.
    logging.getLogger("torch.multiprocessing.spawn").setLevel(logging.ERROR)
    context = worker_context()
    failures = context.SimpleQueue()
    given = work, count, _free_port(), failures, get_temp_dir(), arguments
    try:
        with safe_path(), without_interruptions():
            processes = start_processes(_start, given, count, join=False, start_method=context.get_start_method())
        try:
            while not processes.join():
                pass
        finally:
            for process in processes.processes:  # they have nothing to save
                process.kill()
                process.join()
    except torch.multiprocessing.ProcessExitedException:
        if failures.empty():
            raise
        raise failures.get() from None


def _start(
    rank: int, work: Callable[..., None], count: int, port: int, failures: Any, folder: str, arguments: tuple
) -> None:
    serve_parent(folder)
    torch.set_num_threads(max(1, torch.get_num_threads() // count))
    loopback = "lo0" if sys.platform == "darwin" else "lo"  # a host name may lead to a network without a way back
    os.environ.setdefault("GLOO_SOCKET_IFNAME", loopback)
    os.environ.update(
        RANK=str(rank), LOCAL_RANK=str(rank), WORLD_SIZE=str(count), LOCAL_WORLD_SIZE=str(count),
        MASTER_ADDR="127.0.0.1", MASTER_PORT=str(port),
    )  # fmt: skip
    try:
        work(*arguments)
    except (OSError, FloatingPointError, CheckpointError, DataFolderError) as error:
        # Bad data, numbers or weights: no defect, and no traceback.
        failures.put(error)
        sys.exit(1)


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]

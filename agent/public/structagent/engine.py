"""Share models and libraries between all calls: they are loaded once, and one lock protects the computation."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import RLock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from agent.pipeline.resources import ResourceCache

# Tokenizers and physics are not made for several threads at once; callers on other threads wait for their turn.
_LOCK = RLock()
_WEB_VISUALIZER = "OPEN3D_DISABLE_WEB_VISUALIZER"


@lru_cache(maxsize=1)
def _resources() -> ResourceCache:
    from agent.pipeline.resources import ResourceCache

    return ResourceCache()


@contextmanager
def reading() -> Iterator[ResourceCache]:
    """Give the shared models to one thread at a time for what the embedding parser does: it needs no torch."""
    with _LOCK:
        yield _resources()


@contextmanager
def _without_web_visualizer() -> Iterator[None]:
    """Keep Open3D, where it is imported in a notebook, from starting a server and printing that it did."""
    before = os.environ.get(_WEB_VISUALIZER)
    os.environ[_WEB_VISUALIZER] = "true"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(_WEB_VISUALIZER, None)
        else:
            os.environ[_WEB_VISUALIZER] = before


@contextmanager
def computing() -> Iterator[ResourceCache]:
    """Give the shared models to one thread at a time, with one thread of torch; torch's own number is put back after.

    With one thread results are the same on every machine, and the tensors are too small to be shared anyway.
    """
    with _LOCK, _without_web_visualizer():
        from structdiffusion.simulation.pybullet_import import import_pybullet_silently

        import_pybullet_silently()
        import torch

        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            yield _resources()
        finally:
            torch.set_num_threads(threads)

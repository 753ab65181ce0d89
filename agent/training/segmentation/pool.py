"""Keep training views in a folder that other processes fill while a network is trained.

A view is used several times, each time with another crop, scale, reflection and noise: rendering is slower than
training.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from agent.training.segmentation.views import View, draw_views
from grounding.atomic_files import write_whole

PER_SHARD = 64  # views
_PER_SCENE = 3
_NAMES = ("depth", "truth", "color", "focal", "level_from_camera")


def fill(folder: Path, first: int, count: int, step: int, seed: int) -> None:
    """Draw the shards `first`, `first + step`, ... below `count` of a pool, as far as they are missing.

    Args:
        folder: of the pool; it exists.
        first, step: which shards this process draws.
        count: shards of the whole pool.
        seed: of the pool; shard k is the same for every number of processes.
    """
    lacking = set(missing(folder, count))
    for number in range(first, count, step):
        if number not in lacking:
            continue
        path = folder / f"{number:05d}.npz"
        rng = np.random.default_rng((seed, number))
        views: list[View] = []
        while len(views) < PER_SHARD:
            views += draw_views(rng, _PER_SCENE)
        arrays: dict[str, Any] = {
            name: np.stack([getattr(view, name) for view in views[:PER_SHARD]]) for name in _NAMES
        }
        content = io.BytesIO()
        np.savez(content, **arrays)
        write_whole(path, content.getvalue())


def missing(folder: Path, count: int) -> list[int]:
    """Return the numbers below `count` of the shards that a pool's folder lacks."""
    return [number for number in range(count) if not (folder / f"{number:05d}.npz").exists()]


class Pool:
    """The views that a folder holds so far.

    Args:
        folder: that `fill` writes to.

    Attributes:
        count: views.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._shards = folder, list[dict[str, np.ndarray]]()
        self._known = set[str]()
        self.count = 0
        self.refresh()

    def refresh(self) -> None:
        """Take the shards along that were written since."""
        for path in sorted(self._folder.glob("*.npz")):
            if path.name not in self._known:
                with np.load(path) as arrays:
                    self._shards.append({name: arrays[name] for name in _NAMES})
                self._known.add(path.name)
        self.count = PER_SHARD * len(self._shards)

    def __getitem__(self, index: int) -> View:
        shard = self._shards[index // PER_SHARD]
        one = {name: shard[name][index % PER_SHARD] for name in _NAMES}
        return View(one["depth"], one["truth"], one["color"], float(one["focal"]), one["level_from_camera"])

"""Film the arm at work: pictures from the robot's side, at equal intervals of the arm's own time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from agent.events import Filmed
from structdiffusion.simulation.world import TIME_STEP

INTERVAL = 1.5  # s of the arm's time: a picture takes some 45 ms, all of them a tenth of a run
MOST = 80


class Film:
    """Collects pictures while physics runs.

    When there are `most`, every second one is dropped, and from then on they are twice as far apart: however long the
    arm works, the film stays short.

    Args:
        camera: takes a picture (H, W, 3) uint8.
        interval: seconds of physics between two pictures, rounded to whole steps of 1/240 s; `None` for `INTERVAL`.
        most: how many pictures there may be.
    """

    def __init__(self, camera: Callable[[], np.ndarray], interval: float | None = None, most: int = MOST) -> None:
        self._camera, self._most = camera, most
        self._every = max(1, round((INTERVAL if interval is None else interval) / TIME_STEP))
        self._steps = 0
        self._frames: list[np.ndarray] = []

    def step(self) -> None:
        """Take a picture if one is due; to be called after every physics step."""
        if self._steps % self._every == 0:
            self._frames.append(self._camera())
            if len(self._frames) >= self._most:
                self._frames = self._frames[::2]
                self._every *= 2
        self._steps += 1

    def finish(self) -> Filmed | None:
        """Return the film, ending with a picture of the present state; `None` if nothing has moved."""
        if not self._frames:
            return None
        return Filmed(self._every * TIME_STEP, np.stack((*self._frames, self._camera())))

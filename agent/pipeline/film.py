"""Film the arm at work: where everything is at moments of the arm's own time, and pictures of some of them."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from agent.events import Filmed
from structdiffusion.simulation.world import TIME_STEP

if TYPE_CHECKING:
    from agent.scenes.film_camera import Moment

INTERVAL = 0.25  # s of the arm's time between two moments: the page moves everything smoothly from one to the next
PICTURED = 5  # of so many moments one is pictured: that takes some 70 ms of processor time beside the physics
MOST = 400


class Camera(Protocol):
    """What films, as `agent.scenes.film_camera.FilmCamera` does."""

    def moment(self) -> Moment:
        """Return where everything is now."""

    def picture(self, moment: Moment) -> np.ndarray:
        """Return a picture (H, W, 3) uint8 of a moment; called in another thread."""


class Film:
    """Collects moments while physics runs, and has their pictures drawn beside it.

    When there are `most` moments, every second one is dropped, and from then on they are twice as far apart: however
    long the arm works, the film stays short. Use it in a `with` block.

    Args:
        camera: what films.
        interval: seconds of physics between two moments, rounded to whole steps of 1/240 s; `None` for `INTERVAL`.
        most: how many moments there may be.

    Attributes:
        trouble: why no pictures can be drawn here; empty if they can.
    """

    def __init__(self, camera: Camera, interval: float | None = None, most: int = MOST) -> None:
        self._camera, self._most = camera, most
        self._every = max(1, round((INTERVAL if interval is None else interval) / TIME_STEP))
        self._steps = 0
        self._moments: list[Moment] = []
        self._pictures: list[Future[np.ndarray | None]] = []
        self._pool = ThreadPoolExecutor(1, "film")
        self.trouble = ""

    def step(self) -> None:
        """Record the present moment if one is due; to be called after every physics step."""
        if self._steps % self._every == 0:
            self._moments.append(self._camera.moment())
            if (len(self._moments) - 1) % PICTURED == 0:
                self._pictures.append(self._pool.submit(self.draw, self._moments[-1]))
            if len(self._moments) >= self._most:
                self._thin_out()
        self._steps += 1

    def _thin_out(self) -> None:
        for dropped in self._pictures[1::2]:
            dropped.cancel()
        self._moments, self._pictures = self._moments[::2], self._pictures[::2]
        self._every *= 2

    def draw(self, moment: Moment | None = None) -> np.ndarray | None:
        """Return a picture (H, W, 3) uint8 of a moment, by default of the present one;
        `None` where none can be drawn.
        """
        try:
            return self._camera.picture(self._camera.moment() if moment is None else moment)
        except (ImportError, OSError) as error:
            self.trouble = f"{type(error).__name__}: {error}"
            return None

    def finish(self) -> Filmed | None:
        """Return the film, ending with the present moment and its picture; `None` if nothing has moved."""
        if not self._moments:
            return None
        moments = [*self._moments, self._camera.moment()]
        last = self._pool.submit(self.draw, moments[-1])
        pictures = [taken for each in (*self._pictures, last) if (taken := each.result()) is not None]
        return Filmed(
            self._every * PICTURED * TIME_STEP,
            np.stack(pictures) if pictures else np.zeros((0, 0, 0, 3), dtype=np.uint8),
            self._every * TIME_STEP,
            _together([each.objects for each in moments]),
            _together([each.links for each in moments]),
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)  # what is not drawn yet is left out


def _together(moments: list[Mapping[Any, np.ndarray]]) -> dict[Any, np.ndarray]:
    """Return the poses (T, 4, 4) of everything from those (4, 4) at each moment."""
    return {key: np.stack([each[key] for each in moments]) for key in moments[0]}

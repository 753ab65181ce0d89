"""Compare what the camera sees with what should be, after each picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from agent.arm.eyes import Eyes, is_among
from structdiffusion.evaluation_protocol import MAX_DISPLACEMENT, MAX_TILT
from structdiffusion.geometry import tilt_between

BRUSHED = 0.03  # m that closing fingers move what they then do not hold
NOTICEABLE = 0.015  # m: half of what the smallest push moves something by, and more than the tracker errs by


@dataclass(frozen=True, eq=False)
class Change:
    """One thing that is otherwise than it should be.

    Attributes:
        index: of the object or, from the number of objects on, of the distractor; `None` for something unknown.
        name: its name.
        what: "moved", "gone", "appeared", "fallen" or "blocked".
        detail: in words that follow the name.
        cloud: (P, 3) what was seen of something unknown.
    """

    index: int | None
    name: str
    what: str
    detail: str
    cloud: np.ndarray | None = None


class Monitor:
    """A comparison of each picture with the one before and with what the arm has done since.

    Args:
        eyes: what is known of where everything is.
    """

    def __init__(self, eyes: Eyes) -> None:
        self._eyes = eyes
        self._remember()

    def _remember(self) -> None:
        eyes = self._eyes
        self._motions, self._gone, self._unknown = list(eyes.motions), eyes.gone, list(eyes.unknown)

    def expect(self, cloud: np.ndarray) -> None:
        """Take it that something unknown stands where this cloud (P, 3) is."""
        self._unknown.append(cloud)

    def changes(self, placed: Mapping[int, np.ndarray], touched: int | None = None) -> list[Change]:
        """Return what the last picture shows otherwise than it should be, and take it as known from now on.

        Args:
            placed: index -> now_from_initial (4, 4) where the arm has put an object since the picture before.
            touched: an object that the arm has tried to take: that it moved a little is no surprise.
        """
        found = [self._change(k, placed.get(k), k == touched) for k in range(len(self._motions))]
        appeared = [
            Change(None, "something", "appeared", _place_of(cloud), cloud)
            for cloud in self._eyes.unknown
            if not is_among(cloud, self._unknown)
        ]
        self._remember()
        return [change for change in found if change is not None] + appeared

    def _change(self, k: int, target: np.ndarray | None, touched: bool) -> Change | None:
        eyes, name = self._eyes, self._eyes.names[k]
        if (k in eyes.gone) != (k in self._gone):
            gone = k in eyes.gone
            return Change(k, name, *(("gone", "is gone") if gone else ("appeared", "is there again")))
        if k in eyes.gone:
            return None
        before, now = self._motions[k] if target is None else target, eyes.motions[k]
        tilt = tilt_between(before, now)
        if tilt > MAX_TILT:
            if tilt_between(now, np.eye(4)) < tilt:
                return Change(k, name, "moved", "stands upright again")
            unclear = ", and one end of it looks like the other" if k in eyes.unclear else ""
            return Change(k, name, "fallen", f"has tilted by {np.degrees(tilt):.0f} degrees{unclear}")
        apart = float(np.linalg.norm(eyes.middle(k, now) - eyes.middle(k, before)))
        if target is None and apart > (BRUSHED if touched else NOTICEABLE):
            return Change(k, name, "moved", f"was moved by {100 * apart:.1f} cm")
        if target is not None and apart > MAX_DISPLACEMENT:
            return Change(k, name, "moved", f"ended {100 * apart:.1f} cm from where it was put")
        return None


def _place_of(cloud: np.ndarray) -> str:
    x, y = cloud[:, :2].mean(axis=0)
    return f"stands at ({x:.2f}, {y:.2f})"

"""Describe the build of a run over time, for the page: where the objects and the links of the arm are at every moment.

| key | value |
|---|---|
| `every` | seconds of the arm's time between two moments |
| `motions` | for each object its motions since it was seen, or `null` if it stays |
| `links` | link of the arm -> its poses, world frame |
| `shapes` | the solids of the arm: `link`, `sides`, `round`, `position`, `quaternion`, `color` (RGB, 0 to 255) |
| `marks` | pairs of a moment and what was done by then |

Motions and poses are base64 of int16, seven for each moment: x, y, z in tenths of a millimetre, and a quaternion x, y,
z, w in parts of 32,767.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from agent import events
from agent.event_base import json_value

UNITS = 10_000  # of the numbers in a metre
_TURN = 32_767
_STILL = 5e-5  # entries of a motion that differ by less are those of no motion
_SAME = 1e-3  # entries of the motions of two moments that show the same


def describe_film(
    film: events.Filmed, names: Sequence[str], steps: Sequence[tuple[str, Mapping[str, np.ndarray]]]
) -> dict[str, Any] | None:
    """Return the film as JSON values; `None` if it has no moments.

    Args:
        film: the film.
        names: of the objects, in the order of the page.
        steps: what was done, in order, with the motions (4, 4) of the objects then.
    """
    if not film.links:
        return None
    return {
        "every": round(film.every, 6),
        "motions": [_track(film.motions.get(name), moves=True) for name in names],
        "links": {str(link): track for link, poses in film.links.items() if (track := _track(poses)) is not None},
        "shapes": [json_value(shape) for shape in film.shapes],
        "marks": _marks(film.motions, steps),
    }


def _track(motions: np.ndarray | None, moves: bool = False) -> str | None:
    """Return motions (T, 4, 4) as base64; `None` if there are none or, where something `moves`, if it stays."""
    if motions is None or not np.isfinite(motions).all() or (moves and np.abs(motions - np.eye(4)).max() < _STILL):
        return None
    limit = np.iinfo(np.int16).max
    places = np.clip(np.round(motions[:, :3, 3] * UNITS), -limit, limit)
    turns = np.round(Rotation.from_matrix(motions[:, :3, :3]).as_quat() * _TURN)
    return base64.b64encode(np.hstack((places, turns)).astype("<i2").tobytes()).decode("ascii")


def _marks(
    motions: Mapping[str, np.ndarray], steps: Sequence[tuple[str, Mapping[str, np.ndarray]]]
) -> list[tuple[int, str]]:
    """Return for each step the first moment, not before the step ahead of it, at which everything was as after it."""
    marks, at = [], 0
    for caption, after in steps:
        known = [name for name in after if name in motions]
        if not known:
            continue
        apart = np.max([np.abs(motions[name][at:] - after[name]).max(axis=(1, 2)) for name in known], axis=0)
        at += int(np.argmax(apart <= apart.min() + _SAME))
        marks.append((at, caption))
    return marks

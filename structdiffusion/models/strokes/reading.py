"""Read the strokes of an example by the stroke network, which is loaded at the first example."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from structdiffusion.figures.example import Example, Reading
from structdiffusion.footprints import clear_gap

if TYPE_CHECKING:
    from structdiffusion.models.strokes.model import StrokeNetwork

WEIGHTS = Path(__file__).parents[2] / "weights" / "strokes"


@cache
def _network() -> StrokeNetwork:
    from structdiffusion.models.strokes.model import StrokeNetwork

    return StrokeNetwork.from_pretrained(WEIGHTS)


def read_strokes(example: Example) -> Reading:
    """Return what the stroke network reads off the places and outlines of an example."""
    import torch

    from structdiffusion.models.strokes.model import pair_features

    count = len(example.middles)
    gaps = np.zeros((count, count))
    for i, j in combinations(range(count), 2):
        gaps[i, j] = gaps[j, i] = clear_gap(example.outlines[i], example.outlines[j])
    pairs = torch.from_numpy(pair_features(example.middles, gaps))[None]
    with torch.no_grad():
        logits, corners = _network()(pairs, torch.ones(1, count, dtype=torch.bool))
    joined = np.where(np.eye(count, dtype=bool), -np.inf, logits[0].numpy())
    # A drawing joins no three objects in a ring, unless there are no others: the least likely pair goes.
    for trio in combinations(range(count), 3) if count > 3 else ():
        i, j = min(combinations(trio, 2), key=lambda pair: joined[pair])
        if joined[i, j] > 0:
            joined[i, j] = joined[j, i] = -np.inf
    return Reading(joined > 0, corners[0].numpy() > 0)

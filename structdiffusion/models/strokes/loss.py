"""Training data and loss of the stroke network: arrangements that are drawn while it trains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from structdiffusion.models.strokes.drawings import draw_example
from structdiffusion.models.strokes.model import DISTANCE, FEATURES, NEAR, StrokeNetwork, pair_features

_CORNER_WEIGHT = 0.3


@dataclass(frozen=True)
class StrokeBatch:
    """Arrangements, padded to the largest.

    Attributes:
        pairs: (B, N, N, FEATURES) float32.
        there: (B, N) bool.
        joined: (B, N, N) float32, 1 where a stroke joins two.
        corners: (B, N) float32, 1 at ends, corners and junctions.
    """

    pairs: Tensor
    there: Tensor
    joined: Tensor
    corners: Tensor


def draw_batch(size: int, rng: np.random.Generator) -> StrokeBatch:
    """Draw a batch."""
    examples = [draw_example(rng) for _ in range(size)]
    most = max(len(one.points) for one in examples)
    pairs, joined = np.zeros((size, most, most, FEATURES), np.float32), np.zeros((size, most, most), np.float32)
    there, corners = np.zeros((size, most), bool), np.zeros((size, most), np.float32)
    for row, one in enumerate(examples):
        count = len(one.points)
        pairs[row, :count, :count] = pair_features(one.points, one.gaps)
        joined[row, :count, :count], corners[row, :count], there[row, :count] = one.joined, one.corners, True
    return StrokeBatch(*map(torch.from_numpy, (pairs, there, joined, corners)))


def stroke_loss(model: StrokeNetwork, generator: torch.Generator, size: int = 48) -> dict[str, Tensor]:
    """Return the binary cross-entropies of what is joined and of corners, and how many drawings are read rightly."""
    device = next(model.parameters()).device
    seed = int(torch.randint(2**62, (1,), generator=generator, device=generator.device))
    batch = draw_batch(size, np.random.default_rng(seed))
    pairs, there, wanted, corners = (
        each.to(device) for each in (batch.pairs, batch.there, batch.joined, batch.corners)
    )
    joined, corner = model(pairs, there)
    both = there[:, :, None] & there[:, None] & ~torch.eye(there.shape[1], dtype=torch.bool, device=device)
    near = both & (pairs[..., DISTANCE] < NEAR)
    loss = binary_cross_entropy_with_logits(joined[near], wanted[near])
    loss = loss + _CORNER_WEIGHT * binary_cross_entropy_with_logits(corner[there], corners[there])
    right = (((joined > 0) == (wanted > 0.5)) | ~both).flatten(1).all(dim=1)
    return {"loss": loss, "right": right.float().mean()}

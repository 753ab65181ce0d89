"""The stroke network: which objects of an arrangement follow one another along a stroke, and which are its corners.

Objects that show a drawing say nothing of the order in which it is drawn: the arms of a V are as near to each other at
its point as neighbours along them. A small graph network over all pairs of objects weighs them together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from structdiffusion.models.checkpoint import Checkpointed

FEATURES = 11  # of a pair: see `pair_features`
DISTANCE, NEIGHBOURS, TREE = 2, 7, 8  # places of some of them
_FARTHEST, _LAST_RANK = 6.0, 6.0  # in usual steps, and among the neighbours: beyond them pairs differ no more
_GAPS = (-1.0, 5.0)  # usual steps
_EVEN = (0.03, 0.1)  # usual steps, by which gaps differ that count as alike: along a stroke they are even
NEAR = 3.5  # usual steps: pairs that are farther apart are never joined


@dataclass(frozen=True)
class StrokeConfig:
    """Sizes of the network.

    Attributes:
        width: of what is known of an object.
        pair_width: of what is known of a pair.
        rounds: in which objects and pairs exchange what is known of them.
        heads: of attention.
    """

    width: int = 48
    pair_width: int = 32
    rounds: int = 4
    heads: int = 4


class StrokeNetwork(Checkpointed):
    """A network from the features of all pairs of objects to two kinds of logits: joined, and a corner."""

    kind = "strokes"
    Config = StrokeConfig

    def __init__(self, config: StrokeConfig = StrokeConfig()) -> None:
        super().__init__()
        self.config: StrokeConfig = config
        width, pair = config.width, config.pair_width
        self.first = nn.Parameter(torch.zeros(width))
        self.pairs = nn.Linear(FEATURES, pair)
        self.rounds = nn.ModuleList(_Round(width, pair, config.heads) for _ in range(config.rounds))
        self.joined = _head(pair)
        self.corner = _head(width)

    @classmethod
    def fake_input(cls, batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
        """Return random arrangements as `forward` takes them: `pairs` of points about a usual step apart, all there."""
        points = torch.randn(batch, objects, 2, generator=generator)
        found = [pair_features(each.numpy(), np.full((objects, objects), 0.1)) for each in points]
        return {"pairs": torch.from_numpy(np.stack(found)), "there": torch.ones(batch, objects, dtype=torch.bool)}

    def answer_shape(self, given: Mapping[str, Tensor]) -> tuple[int, ...]:
        """Return the shape of the result of `try_out` for a fake input: a logit for each pair, (B, N, N)."""
        return tuple(given["pairs"].shape[:3])

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Return the logits of the pairs of a fake input; nothing is drawn at random."""
        return self(**given)[0]

    def forward(self, pairs: Tensor, there: Tensor) -> tuple[Tensor, Tensor]:
        """Return the logits that pairs are joined, (B, N, N), and that objects are ends or corners, (B, N).

        Args:
            pairs: (B, N, N, FEATURES) float32.
            there: (B, N) bool, false on padding.
        """
        own = nn.functional.gelu(self.pairs(pairs))  # (B, N, N, P)
        objects = self.first.expand(*there.shape, -1)  # (B, N, W)
        for each in self.rounds:
            objects, own = each(objects, own, there)
        joined = self.joined(own)[..., 0]
        return (joined + joined.transpose(1, 2)) / 2, self.corner(objects)[..., 0]


class _Round(nn.Module):
    """One exchange: objects attend to all others through their pairs, then pairs see both of their objects."""

    def __init__(self, width: int, pair: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.asked = nn.Linear(width, 2 * width)
        self.bias = nn.Linear(pair, heads)
        self.value = nn.Linear(width + pair, width)
        self.object = _block(2 * width, 2 * width, width)
        self.pair = _block(pair + 2 * width, 2 * pair, pair)

    def forward(self, objects: Tensor, pairs: Tensor, there: Tensor) -> tuple[Tensor, Tensor]:
        count = objects.shape[1]
        query, key = self.asked(objects).unflatten(-1, (2, self.heads, -1)).unbind(2)  # (B, N, H, W / H)
        weight = torch.einsum("bihd,bjhd->bijh", query, key) / query.shape[-1] ** 0.5 + self.bias(pairs)
        weight = weight.masked_fill(~there[:, None, :, None], -1e9).softmax(2)
        others = objects[:, None].expand(-1, count, -1, -1)  # (B, N, N, W): of the second of a pair
        value = self.value(torch.cat((others, pairs), dim=-1)).unflatten(-1, (self.heads, -1))
        heard = torch.einsum("bijh,bijhd->bihd", weight, value).flatten(2)
        objects = objects + self.object(torch.cat((objects, heard), dim=-1))
        one, other = objects[:, :, None], objects[:, None]
        return objects, pairs + self.pair(torch.cat((pairs, one + other, one * other), dim=-1))


def pair_features(points: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Return what the network sees of the pairs of an arrangement, (N, N, FEATURES) float32, in usual steps.

    Way to the other (x, y), distance, its decay, clear gap, rank among the neighbours of each, whether the pair belongs
    to the relative neighbourhood graph and to the shortest tree, and how many other pairs, for each object, have about
    the same gap. A usual step is the median distance to the nearest object.

    Args:
        points: (N, 2) middles of two objects or more, metres.
        gaps: (N, N) clear gaps between their outlines, metres.
    """
    from scipy.sparse.csgraph import minimum_spanning_tree

    ways = points[None] - points[:, None]
    distances = np.linalg.norm(ways, axis=-1)
    others = distances + np.diag(np.full(len(points), np.inf))
    usual = max(float(np.median(others.min(axis=1))), 1e-6)
    rank = np.minimum(others.argsort(axis=1).argsort(axis=1), _LAST_RANK) / 3
    # Relative neighbours: no third is nearer to both than they are to each other.
    third = np.maximum(others[:, None], others[None]).min(axis=-1)
    neighbours = (third >= distances - 1e-9) & ~np.eye(len(points), dtype=bool)
    tree = minimum_spanning_tree(distances + 1e-9).toarray() > 0
    steps = distances / usual
    features = (
        *(ways / usual).transpose(2, 0, 1), np.minimum(steps, _FARTHEST), np.exp(-steps), np.clip(gaps / usual, *_GAPS),
        rank, rank.T, neighbours, tree | tree.T, *_alike(gaps / usual, steps < NEAR),
    )  # fmt: skip
    return np.stack(features, axis=-1).astype(np.float32)


def _alike(gaps: np.ndarray, near: np.ndarray) -> list[np.ndarray]:
    """Return how many near pairs, for each object, have about the gap of a pair: (N, N) for each of `_EVEN`."""
    count = len(gaps)
    values = gaps[near & np.triu(np.ones((count, count), bool), 1)]
    off = np.abs(gaps[..., None] - values)
    return [np.maximum((off < tolerance).sum(axis=-1) - 1, 0) / count for tolerance in _EVEN]


def _block(inner: int, middle: int, outer: int) -> nn.Sequential:
    return nn.Sequential(nn.LayerNorm(inner), nn.Linear(inner, middle), nn.GELU(), nn.Linear(middle, outer))


def _head(width: int) -> nn.Sequential:
    return _block(width, width, 1)

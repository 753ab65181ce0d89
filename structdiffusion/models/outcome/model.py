"""The outcome discriminator: scores whether what a model proposes will stand as asked.

The paper trains its discriminators on demonstrations that are disturbed at random. What a planner has to choose from
are its own samples, which are wrong in other ways: a little too wide, a little too close. This network learns from such
samples, each checked as the evaluation does. It sees the outlines of the clouds at their goals, and how close two come.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from structdiffusion.models.encoders import outline_features
from structdiffusion.models.scene_discriminator import SceneConfig, SceneDiscriminator

DIRECTIONS = 16  # of an outline (`encoders.outline_features`)
_MIDDLE, _HALF = (0.45, 0.0), (0.15, 0.25)  # m: where on the table most structures stand
_OBJECT, _STRUCTURE = 0.05, 0.1  # m: half sizes, by which lengths are divided
_TOUCH, _NEAR = 0.004, 0.02  # m: gaps that decide about a collision, and that are tight
_PAIR, _WHOLE = 9, DIRECTIONS + 10  # features of a pair, and of the structure as a whole
_SLOTS = 5


@dataclass(frozen=True)
class OutcomeConfig(SceneConfig):
    """Sizes of the network.

    Attributes:
        width: of an object's features; a multiple of `heads`.
        layers: number of attention layers.
        heads: of the attention.
    """

    width: int = 96
    layers: int = 3
    heads: int = 4


class _Layer(nn.Module):
    """Attention among the objects and the words, which knows how close two objects come."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.attention_norm, self.norm = nn.LayerNorm(width), nn.LayerNorm(width)
        self.qkv, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.bias = nn.Sequential(nn.Linear(_PAIR, 32), nn.GELU(), nn.Linear(32, heads))
        self.message = nn.Sequential(nn.Linear(_PAIR + width, width), nn.GELU(), nn.Linear(width, width))
        self.mlp = nn.Sequential(nn.Linear(width, 2 * width), nn.GELU(), nn.Dropout(0.05), nn.Linear(2 * width, width))

    def forward(self, x: Tensor, pairs: Tensor, known: Tensor) -> Tensor:
        """Pass on states (B, 1 + N, W), with pairs (B, N, N, 9); known: (B, 1 + N) bool."""
        batch, count, width = x.shape
        parts = self.qkv(self.attention_norm(x)).view(batch, count, 3, self.heads, width // self.heads)
        query, key, value = parts.permute(2, 0, 3, 1, 4)  # (B, heads, 1 + N, W / heads)
        bias = nn.functional.pad(self.bias(pairs).permute(0, 3, 1, 2), (1, 0, 1, 0))
        weight = (query @ key.transpose(-1, -2)) / math.sqrt(width // self.heads) + bias
        weight = weight.masked_fill(~known[:, None, None], -1e9).softmax(dim=-1)
        x = x + self.out((weight @ value).transpose(1, 2).reshape(batch, count, width))
        # What touches speaks, however many others there are.
        told = self.message(torch.cat((pairs, x[:, None, 1:].expand(-1, count - 1, -1, -1)), dim=-1))
        x = x + nn.functional.pad((told * pairs[..., 2:3]).sum(dim=2), (0, 0, 1, 0))
        return x + self.mlp(self.norm(x))


class OutcomeDiscriminator(SceneDiscriminator):
    """A network from a proposed scene and words to one logit, whose sigmoid is the chance that it stands as asked."""

    kind = "outcome"
    Config = OutcomeConfig

    def __init__(self, config: OutcomeConfig = OutcomeConfig()) -> None:
        super().__init__()
        self.config: OutcomeConfig = config
        width = config.width
        self.noun, self.word = nn.Embedding(1 + config.nouns, 16), nn.Embedding(config.vocabulary, 24)
        self.place = nn.Embedding(config.max_objects, width)
        self.embed = nn.Sequential(nn.Linear(3 + DIRECTIONS + 2 + 3 + 16, width), nn.GELU(), nn.Linear(width, width))
        self.whole = nn.Sequential(nn.Linear(24 * _SLOTS + 3 + _WHOLE, width), nn.GELU(), nn.Linear(width, width))
        self.layers = nn.ModuleList(_Layer(width, config.heads) for _ in range(config.layers))
        self.head = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 1))

    def forward(self, clouds: Tensor, present: Tensor, nouns: Tensor, words: Tensor) -> Tensor:
        """Return logits (B,) of the scenes; see `SceneDiscriminator.forward`."""
        return self.judged(outline_features(clouds), gaps(clouds), present, nouns, words)

    def judged(self, outlines: Tensor, near: Tensor, present: Tensor, nouns: Tensor, words: Tensor) -> Tensor:
        """Return logits (B,) of outlines (B, N, 21) and gaps (B, N, N, 2), which are all that is seen of clouds."""
        middle, half = outlines.new_tensor(_MIDDLE), outlines.new_tensor(_HALF)
        mean, below, above = outlines[..., :3], outlines[..., -2], outlines[..., -1]
        total = present.sum(dim=1, keepdim=True)
        centre = (mean[..., :2] * present[..., None]).sum(dim=1) / total  # (B, 2)
        position = torch.cat(
            (
                (mean[..., :2] - centre[:, None]) / _STRUCTURE, mean[..., 2:] / _STRUCTURE, outlines[..., 3:] / _OBJECT,
                (mean[..., :2] - middle) / half, ((mean[..., 2] - below) / _OBJECT)[..., None],
            ),
            dim=-1,
        )  # fmt: skip
        objects = self.embed(torch.cat((position, self.noun(nouns)), dim=-1)) + self.place.weight[: mean.shape[1]]
        about = torch.cat((self.word(words).flatten(1), (centre - middle) / half, total / 6.0), dim=-1)
        shape = _whole(outlines, near, present, centre, (middle, half))
        pairs = _pairs(mean, below, above, near) * (present[:, :, None] & present[:, None])[..., None]
        state = torch.cat((self.whole(torch.cat((about, shape), dim=-1))[:, None], objects), dim=1)
        known = torch.cat((torch.ones_like(present[:, :1]), present), dim=1)
        for layer in self.layers:
            state = layer(state, pairs, known)
        return self.head(state[:, 0]).squeeze(-1).float()


def gaps(clouds: Tensor) -> Tensor:
    """Return how close the points of each two of N clouds come, in space and seen from above: (B, N, N, 2), metres."""
    count = clouds.shape[1]
    found = clouds.new_full((len(clouds), count, count, 2), 1.0)
    for i in range(count):
        for j in range(i):
            for k, axes in enumerate((3, 2)):
                nearest = torch.cdist(clouds[:, i, :: 1 + k, :axes], clouds[:, j, :: 1 + k, :axes]).amin(dim=(1, 2))
                found[:, i, j, k] = found[:, j, i, k] = nearest
    return found


def _pairs(mean: Tensor, below: Tensor, above: Tensor, near: Tensor) -> Tensor:
    """Return the features (B, N, N, 9) of pairs: gaps, how near these are to touching, what is over what, how far."""
    over = (((mean[..., 2] - below)[:, :, None] - (mean[..., 2] + above)[:, None]) / 0.01).clamp(-3, 3)
    apart = ((mean[:, :, None, :2] - mean[:, None, :, :2]).norm(dim=-1) / _OBJECT).clamp(max=5)
    levels = torch.stack((over, over.transpose(1, 2), apart), dim=-1)
    return torch.cat((near / _OBJECT, torch.exp(-near / _TOUCH), torch.exp(-near / _NEAR), levels), dim=-1)


def _whole(outlines: Tensor, near: Tensor, present: Tensor, centre: Tensor, place: tuple[Tensor, Tensor]) -> Tensor:
    """Return the features (B, 26) of a structure: its outline about its centre, how wide it is for its objects, its
    gaps, and where the middle of its box is."""
    mean, reach, count = outlines[..., :3], outlines[..., 3:-2], present.sum(dim=1)
    angles = torch.arange(DIRECTIONS, device=outlines.device) * (2 * math.pi / DIRECTIONS)
    directions = torch.stack((angles.cos(), angles.sin()))  # (2, 16)
    outline = (mean[..., :2] - centre[:, None]) @ directions + reach
    outline = outline.masked_fill(~present[..., None], -9.0).amax(dim=1)  # (B, 16)
    across = outline[:, : DIRECTIONS // 2] + outline[:, DIRECTIONS // 2 :]
    widths = (2 * reach.mean(dim=-1) * present).sum(dim=1)
    spread = ((mean[..., :2] - centre[:, None]).norm(dim=-1) * present).sum(dim=1) / count
    alone = ~(present[:, :, None] & present[:, None]) | torch.eye(
        present.shape[1], dtype=torch.bool, device=near.device
    )
    nearest = near[..., 1].masked_fill(alone, 9.0).amin(dim=-1)  # (B, N)
    least, most = nearest.masked_fill(~present, 9.0).amin(dim=1), nearest.masked_fill(~present, -1.0).amax(dim=1)
    sizes = (
        across.amax(dim=1) / widths, across.amin(dim=1) / widths, 3 * outline.amax(dim=1) / widths, 5 * spread / widths,
        least / 0.03, most / 0.05, (nearest * present).sum(dim=1) / count / 0.05, widths / 0.3,
    )  # fmt: skip
    quarter = DIRECTIONS // 4
    box = torch.stack((outline[:, 0] - outline[:, 2 * quarter], outline[:, quarter] - outline[:, 3 * quarter]), dim=-1)
    where = (centre + box / 2 - place[0]) / place[1]
    return torch.cat((outline / _STRUCTURE, torch.stack(sizes, dim=-1).clamp(-5, 5), where), dim=-1)

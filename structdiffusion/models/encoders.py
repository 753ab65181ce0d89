"""Encoders shared by the networks: point clouds, language, time."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from structdiffusion.word_tokens import WORD_TOKENS

SENTENCE_WIDTH = 384  # all-MiniLM-L6-v2
_DIRECTIONS = 16  # directions of the outline's support function
OUTLINE_FEATURES = 3 + _DIRECTIONS + 2


def fake_scenes(batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
    """Return random scenes of the right shapes and ranges, for tests, benchmarks and the check of a checkpoint.

    In all scenes but the first, the last object is absent. The keys:

    | key | type and shape | what |
    |---|---|---|
    | clouds | float32 (B, N, 256, 3) | points, world frame, metres; 5 cm about (0.45, 0, 0.05), the table's middle |
    | present | bool (B, N) | which objects are present; absent ones come last |
    | nouns | int64 (B, N) | noun ids from 0, "unknown"; here all unknown |
    | words | int64 (B, 5) | a word id per slot, 0 where unspecified; here 0 to 3 |
    """
    present = torch.ones(batch, objects, dtype=torch.bool)
    present[1:, -1] = False
    return {
        "clouds": 0.05 * torch.randn(batch, objects, 256, 3, generator=generator) + torch.tensor((0.45, 0.0, 0.05)),
        "present": present,
        "nouns": torch.zeros(batch, objects, dtype=torch.long),
        "words": torch.randint(0, 4, (batch, WORD_TOKENS), generator=generator),
    }


def outline_features(points: Tensor) -> Tensor:
    """Return the position and extent of a cloud: (..., 21) from points (..., P, 3), metres.

    The features are the mean (3), and the extent from the mean in 16 horizontal directions, downward and upward. The
    paper encodes the mean position separately from the centred cloud (section IV.A). The extent is our addition: it
    gives the footprint, on which spacing depends, directly rather than through the point encoder.
    """
    mean = points.mean(dim=-2)
    centred = points - mean[..., None, :]
    angles = torch.arange(_DIRECTIONS, device=points.device) * (2 * math.pi / _DIRECTIONS)
    directions = torch.stack((angles.cos(), angles.sin()))  # (2, 16)
    reach = (centred[..., :2] @ directions).amax(dim=-2)
    below, above = -centred[..., 2].amin(dim=-1), centred[..., 2].amax(dim=-1)
    return torch.cat((mean, reach, below[..., None], above[..., None]), dim=-1)


class OffsetAttention(nn.Module):
    """The offset attention of Point Cloud Transformer (Guo et al. 2021):
    passes on the difference that attention makes.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.query_key = nn.Linear(width, width // 4, bias=False)  # shared, as in PCT
        self.value = nn.Linear(width, width)
        self.transform = nn.Sequential(nn.Linear(width, width), nn.LayerNorm(width), nn.GELU())

    def forward(self, x: Tensor) -> Tensor:
        key = self.query_key(x)  # (B, P, W/4)
        attended = nn.functional.scaled_dot_product_attention(key, key, self.value(x))
        return x + self.transform(x - attended)


class PointEncoder(nn.Module):
    """A small Point Cloud Transformer from points (B, P, C) to one vector (B, out)."""

    def __init__(self, channels: int, width: int, out: int, layers: int = 2) -> None:
        super().__init__()
        self.embed = nn.Sequential(nn.Linear(channels, width), nn.GELU(), nn.Linear(width, width), nn.LayerNorm(width))
        self.attention = nn.ModuleList(OffsetAttention(width) for _ in range(layers))
        self.merge = nn.Sequential(nn.Linear(width * layers, out), nn.LayerNorm(out), nn.GELU())
        self.out = nn.Linear(2 * out, out)

    def forward(self, points: Tensor) -> Tensor:
        x, levels = self.embed(points), []
        for layer in self.attention:
            x = layer(x)
            levels.append(x)
        merged = self.merge(torch.cat(levels, dim=-1))  # (B, P, out)
        return self.out(torch.cat((merged.amax(dim=1), merged.mean(dim=1)), dim=-1))


class TimeEmbedding(nn.Module):
    """The paper's h_time: sinusoids of the diffusion step, then an MLP; (B,) to (B, out)."""

    def __init__(self, out: int, width: int = 64) -> None:
        super().__init__()
        steps = torch.arange(width // 2, device="cpu")  # on the meta device, arithmetic imports torch's compiler
        frequencies = torch.exp(-math.log(1000.0) * steps / (width // 2 - 1))
        self.frequencies: Tensor
        self.register_buffer("frequencies", frequencies, persistent=False)
        self.mlp = nn.Sequential(nn.Linear(width, width), nn.GELU(), nn.Linear(width, out))

    def forward(self, timesteps: Tensor) -> Tensor:
        phase = timesteps[:, None].float() * self.frequencies
        return self.mlp(torch.cat((phase.sin(), phase.cos()), dim=-1))

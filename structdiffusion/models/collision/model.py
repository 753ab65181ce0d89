"""The collision discriminator: predicts whether two partly seen objects intersect (paper section IV.C)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from structdiffusion.models.checkpoint import Checkpointed
from structdiffusion.models.encoders import PointEncoder, outline_features


@dataclass(frozen=True)
class CollisionConfig:
    """Sizes of the network.

    Attributes:
        width: width of a point's features.
        layers: number of attention layers.
        points: number of points of each of the two clouds.
    """

    width: int = 48
    layers: int = 2
    points: int = 64


class CollisionDiscriminator(Checkpointed):
    """A network from two clouds to the logit of their intersection; symmetric by averaging both orders."""

    kind = "collision"
    Config = CollisionConfig

    def __init__(self, config: CollisionConfig = CollisionConfig()) -> None:
        super().__init__()
        self.config: CollisionConfig = config
        self.encoder = PointEncoder(3 + 2, config.width, 2 * config.width, config.layers)
        self.head = nn.Sequential(nn.Linear(2 * config.width + 42, 256), nn.GELU(), nn.Linear(256, 1))

    @classmethod
    def fake_input(cls, batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
        """Return random pairs as `forward` takes them; `objects` has no effect.

        `first` and `second` are float32 (B, 256, 3): points, world frame, metres, about 3 cm around the table's
        middle and 5 cm to its left.
        """
        middle = torch.tensor((0.45, 0.0, 0.05))
        first, second = 0.03 * torch.randn(2, batch, 256, 3, generator=generator) + middle
        return {"first": first, "second": second + torch.tensor((0.0, 0.05, 0.0))}

    def answer_shape(self, given: Mapping[str, Tensor]) -> tuple[int, ...]:
        """Return the shape of the result of `try_out` for a fake input: a logit for each pair, (B,)."""
        return (len(given["first"]),)

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Return the logits of a fake input; nothing is drawn at random."""
        return self(**given)

    def forward(self, first: Tensor, second: Tensor) -> Tensor:
        """Return logits (B,) for clouds (B, P, 3) each, world frame, metres, P >= `config.points`."""
        return 0.5 * (self._one_way(first, second) + self._one_way(second, first))

    def _one_way(self, first: Tensor, second: Tensor) -> Tensor:
        middle = 0.5 * (first.mean(dim=1, keepdim=True) + second.mean(dim=1, keepdim=True))
        a, b = (first - middle) / 0.07, (second - middle) / 0.07  # 7 cm: typical distance of two neighbours
        outlines = torch.cat((outline_features(a), outline_features(b)), dim=-1)  # (B, 42)
        flags = torch.eye(2, device=a.device)
        points = torch.cat(
            [
                torch.cat((cloud[:, : self.config.points], flag.expand(len(cloud), self.config.points, 2)), dim=-1)
                for cloud, flag in ((a, flags[0]), (b, flags[1]))
            ],
            dim=1,
        )  # (B, 2P, 5)
        return self.head(torch.cat((self.encoder(points), outlines), dim=-1)).squeeze(-1).float()

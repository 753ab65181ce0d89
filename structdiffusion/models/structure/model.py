"""The structure discriminator: scores whether a proposed scene matches the words (paper section IV.C).

Its input is points, not object latents: the clouds moved to their goals, each point with the one-hot number of its
object. The scene is centred, and the words that place it on the table are omitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from structdiffusion.models.encoders import PointEncoder
from structdiffusion.models.scene_discriminator import SceneConfig, SceneDiscriminator

LOCAL_SLOTS = (0, 1, 4)  # shape, size, rotation: slots that do not depend on the structure's position


@dataclass(frozen=True)
class StructureConfig(SceneConfig):
    """Sizes of the network.

    Attributes:
        width: width of a point's features.
        layers: number of attention layers.
        points: number of points of a whole scene, divided evenly among its objects.
    """

    width: int = 48
    layers: int = 2
    points: int = 168


class StructureDiscriminator(SceneDiscriminator):
    """A network from a proposed scene and words to one logit, whose sigmoid is the score."""

    kind = "structure"
    Config = StructureConfig

    def __init__(self, config: StructureConfig = StructureConfig()) -> None:
        super().__init__()
        self.config: StructureConfig = config
        self.noun = nn.Embedding(1 + config.nouns, 8)
        self.encoder = PointEncoder(3 + config.max_objects + 8, config.width, 2 * config.width, config.layers)
        self.word = nn.Embedding(config.vocabulary, 32)
        self.head = nn.Sequential(
            nn.Linear(2 * config.width + 32 * len(LOCAL_SLOTS), 256),
            nn.GELU(),
            nn.Linear(256, 128),
            nn.GELU(),
            nn.Linear(128, 1),
        )

    def forward(self, clouds: Tensor, present: Tensor, nouns: Tensor, words: Tensor) -> Tensor:
        """Return logits (B,) of the scenes; see `SceneDiscriminator.forward`."""
        batch, count, points, _ = clouds.shape
        total = present.sum(dim=1, keepdim=True)  # (B, 1)
        number = torch.arange(self.config.points, device=clouds.device)
        owner = number % total  # (B, P'): the present objects take turns
        place = (number // total) % points
        rows = torch.arange(batch, device=clouds.device)[:, None]
        scene = clouds[rows, owner, place]  # (B, P', 3)
        mean = (clouds.mean(dim=2) * present[..., None]).sum(dim=1) / total  # (B, 3)
        level = torch.cat((mean[:, :2], torch.zeros_like(mean[:, :1])), dim=-1)  # z stays the height above the table
        scaled = (scene - level[:, None]) / 0.15  # a structure's half size
        identity = nn.functional.one_hot(owner, self.config.max_objects).to(scaled.dtype)
        noun = self.noun(nouns)[rows, owner]
        code = self.encoder(torch.cat((scaled, identity, noun), dim=-1))
        local = self.word(words[:, list(LOCAL_SLOTS)]).flatten(1)
        return self.head(torch.cat((code, local), dim=-1)).squeeze(-1).float()

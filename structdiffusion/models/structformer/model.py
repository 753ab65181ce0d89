"""A transformer that predicts one pose after another, after StructFormer (paper section V.A; Liu et al., ICRA 2022).

The structure's frame comes first, then the objects place by place; each pose is conditioned on the scene, the language
and the earlier poses. There is one network for each shape, as in the paper.

The original regresses each pose, and its samples differ by dropout alone: the paper attributes its similar samples, and
many of its failures, to that (section V.C). Here each pose has a mixture of Gaussians (Bishop 1994). If a goal leaves
the heading of a ring open, the mean of all headings is not a valid heading, and a baseline that has to predict it would
show little. The rest follows the original.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from grounding.spec import SHAPES
from structdiffusion.models.backbone import (
    OBJECT_WIDTH,
    POSE,
    WORD_TOKENS,
    BackboneConfig,
    Condition,
    PoseBackbone,
    encoder_stack,
    readout,
)

# The standard deviation to which training poses are considered known, in units of the state: 0.1 is 7 to 10 mm. Without
# it, the density of constant pose numbers would grow without bound, at the cost of the others. Samples exclude it.
_RESOLUTION = 0.1

# Share of a Gaussian's spread that samples keep. On validation scenes (seed 21, n = 100), the first sample stood in 45,
# 50 and 49 % at 1, 0.5 and 0; one of five samples stood in 65, 68 and 63 %.
_SPREAD_KEPT = 0.5


@dataclass(frozen=True)
class StructFormerConfig(BackboneConfig):
    """Sizes of the backbone, and settings of the pose distribution.

    Attributes:
        shape: the structure that the network generates.
        mixture: number of Gaussians per pose.

    Raises:
        ValueError: for an unknown shape.
    """

    shape: str = "circle"
    mixture: int = 16

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise ValueError(f"shape cannot be {self.shape!r}; legal values: {', '.join(SHAPES)}")


class StructFormer(PoseBackbone):
    """An autoregressive network over poses. A pose's token encodes its object, and the previous object and pose."""

    kind = "structformer"
    Config = StructFormerConfig

    def __init__(self, config: StructFormerConfig = StructFormerConfig()) -> None:
        super().__init__(config, object_extra=OBJECT_WIDTH)
        self.start = nn.Parameter(nn.init.normal_(torch.empty(OBJECT_WIDTH), std=0.02))
        self.transformer = encoder_stack(config)
        self.head = readout(config, config.mixture * (1 + 2 * POSE))

    def forward(self, state: Tensor, condition: Condition) -> MixtureSameFamily:
        """Return the distribution of every pose (B, 1 + N) of 9 numbers, given those before it.

        Args:
            state: (B, 1 + N, 9); row i does not influence the distributions of rows 0 to i.
            condition: the scenes.
        """
        batch, count = condition.present.shape
        objects = self.objects(condition)
        # An absent object does not influence the next one.
        has_previous = torch.cat((torch.ones_like(condition.present[:, :1]), condition.present), dim=1)[:, :-1, None]
        before = torch.cat((torch.zeros_like(state[:, :1]), state[:, :-1] * has_previous), dim=1)
        object_before = torch.cat((self.start.expand(batch, 1, -1), objects[:, :-1] * has_previous), dim=1)
        scene = torch.cat((self.language_tokens(condition), self.object_tokens(condition)), dim=1)
        tokens = torch.cat((scene, self.object_tokens(condition, before, object_before)), dim=1)
        there = torch.cat((condition.there, condition.there[:, WORD_TOKENS:]), dim=1)
        encoded = self.transformer(tokens, mask=self._unseen(count, tokens.device), src_key_padding_mask=~there)
        numbers = self.head(encoded[:, scene.shape[1] :]).float()
        logits, means, spreads = numbers.split([self.config.mixture * k for k in (1, POSE, POSE)], dim=-1)
        means, spreads = (part.unflatten(-1, (self.config.mixture, POSE)) for part in (means, spreads))
        deviations = (_RESOLUTION**2 + nn.functional.softplus(spreads).square()).sqrt()
        poses = Independent(Normal(means, deviations, validate_args=False), 1, validate_args=False)
        return MixtureSameFamily(Categorical(logits=logits, validate_args=False), poses, validate_args=False)

    @torch.no_grad()
    def sample(self, condition: Condition, generator: torch.Generator) -> Tensor:
        """Sample a state (B, 1 + N, 9) for each scene.

        Args:
            condition: the scenes.
            generator: the only source of randomness.
        """
        batch, count = condition.present.shape
        device = condition.present.device
        state = torch.zeros(batch, 1 + count, POSE, device=device)
        rows = torch.arange(batch, device=device)
        for i in range(1 + count):
            poses = self(state, condition)
            drawn = torch.multinomial(poses.mixture_distribution.probs[:, i], 1, generator=generator)[:, 0]
            gaussian = poses.component_distribution.base_dist
            spread = (gaussian.scale[rows, i, drawn].square() - _RESOLUTION**2).clamp(min=0.0).sqrt()
            noise = torch.randn(batch, POSE, generator=generator, device=device)
            state[:, i] = gaussian.loc[rows, i, drawn] + _SPREAD_KEPT * spread * noise
        return state

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Sample each of the scenes of a fake input."""
        return self.sample(self.condition(**given), generator)

    @staticmethod
    def _unseen(count: int, device: torch.device) -> Tensor:
        """Return which token (column) each token (row) must not attend to: poses see the scene and earlier poses."""
        scene, poses = WORD_TOKENS + 1 + count, 1 + count
        unseen = torch.zeros(scene + poses, scene + poses, dtype=torch.bool, device=device)
        unseen[:scene, scene:] = True
        unseen[scene:, scene:] = torch.ones(poses, poses, dtype=torch.bool, device=device).triu(1)
        return unseen

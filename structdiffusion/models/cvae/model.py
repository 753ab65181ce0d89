"""The conditional variational autoencoder on the backbone of the diffusion model (paper section V.A, "CVAE").

It has three transformers (Sohn et al. 2015): a recognition network sees the goal poses and returns the posterior of the
latent, a prior network does not see them, and a generator maps a latent to all poses in a single pass. A generator that
predicts one pose after another could ignore the latent, as the paper notes; here the latent alone decides what the goal
leaves open.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.distributions import Normal

from structdiffusion.models.backbone import (
    POSE,
    WORD_TOKENS,
    BackboneConfig,
    Condition,
    PoseBackbone,
    encoder_stack,
    readout,
)

# range of the latent's log deviation: beyond it, the divergence would overflow early in training
_LOG_DEVIATION = (-5.0, 2.0)


@dataclass(frozen=True)
class CVAEConfig(BackboneConfig):
    """Sizes of the backbone (`layers` are those of the generator) and of the latent.

    Attributes:
        latent: size of the latent.
        latent_layers: number of layers of the recognition network and of the prior network.
    """

    latent: int = 32
    latent_layers: int = 2


class PoseCVAE(PoseBackbone):
    """The CVAE over arrangements. The generator's tokens take the latent where the diffusion model's take the time."""

    kind = "cvae"
    Config = CVAEConfig

    def __init__(self, config: CVAEConfig = CVAEConfig()) -> None:
        super().__init__(config, language_extra=config.latent, object_extra=config.latent)
        self.recognition = encoder_stack(config, config.latent_layers)
        self.recognition_head = readout(config, 2 * config.latent)
        self.expectation = encoder_stack(config, config.latent_layers)
        self.expectation_head = readout(config, 2 * config.latent)
        self.transformer = encoder_stack(config)
        self.head = readout(config, POSE)

    def forward(self, latent: Tensor, condition: Condition) -> Tensor:
        """Decode a latent (B, Z) to a state (B, 1 + N, 9)."""
        latent = latent[:, None]
        tokens = (self.language_tokens(condition, latent), self.object_tokens(condition, extra=latent))
        encoded = self.transformer(torch.cat(tokens, dim=1), src_key_padding_mask=~condition.there)
        return self.head(encoded[:, WORD_TOKENS:]).float()

    def posterior(self, state: Tensor, condition: Condition) -> Normal:
        """Return the distribution of the latent (B, Z) given a state (B, 1 + N, 9)."""
        return self._latent(self.recognition, self.recognition_head, state, condition)

    def prior(self, condition: Condition) -> Normal:
        """Return the distribution of the latent (B, Z) before any pose is known."""
        return self._latent(self.expectation, self.expectation_head, None, condition)

    def sample(self, condition: Condition, generator: torch.Generator) -> Tensor:
        """Sample a state (B, 1 + N, 9) for each scene, from a latent that is drawn from the prior.

        Args:
            condition: the scenes.
            generator: the only source of randomness.
        """
        prior = self.prior(condition)
        noise = torch.randn(prior.mean.shape, generator=generator, device=prior.mean.device)
        return self(prior.mean + prior.stddev * noise, condition)

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Sample the scenes of a fake input, then encode and decode the samples, so that all three networks run."""
        condition = self.condition(**given)
        return self(self.posterior(self.sample(condition, generator), condition).mean, condition)

    def _latent(self, transformer: nn.Module, head: nn.Module, state: Tensor | None, condition: Condition) -> Normal:
        tokens = torch.cat((self.language_tokens(condition), self.object_tokens(condition, state)), dim=1)
        encoded = transformer(tokens, src_key_padding_mask=~condition.there)
        mean, log_deviation = head(encoded[:, WORD_TOKENS]).float().chunk(2, dim=-1)  # of the structure frame's token
        return Normal(mean, log_deviation.clamp(*_LOG_DEVIATION).exp())

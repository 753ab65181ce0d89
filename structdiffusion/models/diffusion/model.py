"""The denoiser: a transformer over language, structure-frame and object tokens (paper section IV.B)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from structdiffusion.models.backbone import (
    POSE,
    WORD_TOKENS,
    BackboneConfig,
    Condition,
    PoseBackbone,
    encoder_stack,
    readout,
)
from structdiffusion.models.diffusion.scheduler import NoiseScheduler
from structdiffusion.models.encoders import TimeEmbedding

_TIME_WIDTH = 32


@dataclass(frozen=True)
class DiffusionConfig(BackboneConfig):
    """Sizes of the backbone, and settings of the diffusion.

    Attributes:
        steps: T of the noise schedule.
        prediction_type: what the network predicts (see `NoiseScheduler`).

    Raises:
        ValueError: for numbers or a type that `NoiseScheduler` refuses.
    """

    steps: int = 200
    prediction_type: str = "v"

    def __post_init__(self) -> None:
        NoiseScheduler(self.steps, prediction_type=self.prediction_type)


class PoseDiffusion(PoseBackbone):
    """A network that predicts the noise (or velocity) of a noisy arrangement, for both kinds of language."""

    kind = "diffusion"
    Config = DiffusionConfig

    def __init__(self, config: DiffusionConfig = DiffusionConfig()) -> None:
        super().__init__(config, language_extra=_TIME_WIDTH, object_extra=_TIME_WIDTH)
        self.time = TimeEmbedding(_TIME_WIDTH)
        self.transformer = encoder_stack(config)
        self.head = readout(config, POSE)

    def forward(self, state: Tensor, timesteps: Tensor, condition: Condition) -> Tensor:
        """Predict noise or velocity (B, 1 + N, 9) for a noisy state (B, 1 + N, 9) at steps (B,)."""
        time = self.time(timesteps)[:, None, :]  # (B, 1, W_t)
        tokens = torch.cat((self.language_tokens(condition, time), self.object_tokens(condition, state, time)), dim=1)
        encoded = self.transformer(tokens, src_key_padding_mask=~condition.there)
        return self.head(encoded[:, WORD_TOKENS:]).float()

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Return the prediction for noise at random steps, in the scenes of a fake input."""
        state = torch.randn(self.answer_shape(given), generator=generator)
        timesteps = torch.randint(self.config.steps, (len(state),), generator=generator)
        return self(state, timesteps, self.condition(**given))

"""The noise schedule and the samplers, independent of any network (paper section III.A; Ho et al. 2020).

The paper's Algorithm 1 is misprinted; this is the standard DDPM posterior. The network may predict
the noise ("epsilon", as in the paper) or the velocity ("v", Salimans and Ho 2022), which is as easy
at high noise as at low noise and therefore better suited to few steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

PREDICTION_TYPES = ("epsilon", "v")
SAMPLERS = ("ddpm", "ddim")


@dataclass(frozen=True)
class Step:
    """One reverse step: the next, less noisy sample, and the clean sample predicted on the way (for previews)."""

    prev_sample: Tensor
    pred_original_sample: Tensor


class NoiseScheduler:
    """A noise schedule with linear betas over `steps` diffusion steps.

    Args:
        steps: T, 200 in the paper's release.
        prediction_type: what the network predicts, one of `PREDICTION_TYPES`.
        beta_start: beta of the first step.
        beta_end: beta of the last. The defaults are Ho et al.'s range for 1000 steps, scaled to 200, so
            that the signal is gone at the end.

    Raises:
        ValueError: for an unknown prediction type.
    """

    def __init__(
        self, steps: int = 200, prediction_type: str = "v", beta_start: float = 0.0005, beta_end: float = 0.1
    ) -> None:
        if prediction_type not in PREDICTION_TYPES:
            raise ValueError(
                f"prediction_type cannot be {prediction_type!r}; legal values: {', '.join(PREDICTION_TYPES)}"
            )
        self.steps = steps
        self.prediction_type = prediction_type
        betas = torch.linspace(beta_start, beta_end, steps, dtype=torch.float64)
        self.alphas_cumprod = torch.cumprod(1 - betas, dim=0).float()  # (T,)
        self.timesteps = torch.arange(steps - 1, -1, -1)
        self.sampler = "ddpm"

    def set_timesteps(self, count: int, sampler: str = "ddim") -> None:
        """Choose `count` of the T steps for sampling, noisiest first, and the sampler.

        Raises:
            ValueError: if count is not in 1..T, or the sampler is unknown.
        """
        if not 1 <= count <= self.steps:
            raise ValueError(f"the number of sampling steps cannot be {count}; legal values: 1 to {self.steps}")
        if sampler not in SAMPLERS:
            raise ValueError(f"sampler cannot be {sampler!r}; legal values: {', '.join(SAMPLERS)}")
        self.timesteps = torch.linspace(self.steps - 1, 0, count).round().long()
        self.sampler = sampler

    def add_noise(self, clean: Tensor, noise: Tensor, timesteps: Tensor) -> Tensor:
        """Draw from q(x_t | x_0): `clean` and `noise` (B, ...), `timesteps` (B,)."""
        signal, sigma = self._scales(timesteps, clean)
        return signal * clean + sigma * noise

    def target(self, clean: Tensor, noise: Tensor, timesteps: Tensor) -> Tensor:
        """Return what the network should predict, of the shape of `clean`."""
        if self.prediction_type == "epsilon":
            return noise
        signal, sigma = self._scales(timesteps, clean)
        return signal * noise - sigma * clean

    def predict_original_sample(self, prediction: Tensor, timestep: Tensor, sample: Tensor) -> Tensor:
        """Return x_0 as the network's prediction implies it; shapes (B, ...), `timestep` (B,)."""
        signal, sigma = self._scales(timestep, sample)
        if self.prediction_type == "epsilon":
            return (sample - sigma * prediction) / signal
        return signal * sample - sigma * prediction

    def prediction_of(self, clean: Tensor, timestep: Tensor, sample: Tensor) -> Tensor:
        """Return the prediction that implies this x_0: the inverse of `predict_original_sample`."""
        signal, sigma = self._scales(timestep, sample)
        return self.target(clean, (sample - signal * clean) / sigma, timestep)

    def noise_level(self, timestep: Tensor) -> float:
        """Return sqrt(1 - abar_t): the deviation of the noise at a step."""
        return float((1 - self.alphas_cumprod[timestep]).sqrt())

    def step(self, prediction: Tensor, index: int, sample: Tensor, generator: torch.Generator | None = None) -> Step:
        """Step from the sample at `timesteps[index]` to the one at `timesteps[index + 1]`; past the last, to x_0.

        Args:
            prediction: the network's output (B, ...).
            index: into `timesteps`.
            sample: (B, ...).
            generator: the source of the DDPM's noise; DDIM needs none.
        """
        now = self.timesteps[index].expand(sample.shape[0])
        clean = self.predict_original_sample(prediction, now, sample)
        if index + 1 == len(self.timesteps):
            return Step(clean, clean)
        signal, sigma = self._scales(now, sample)
        signal_next, sigma_next = self._scales(self.timesteps[index + 1].expand(sample.shape[0]), sample)
        noise = (sample - signal * clean) / sigma
        if self.sampler == "ddim":
            return Step(signal_next * clean + sigma_next * noise, clean)
        # The DDPM posterior between the two kept steps: alpha is the product of the alphas between them.
        alpha = (signal / signal_next) ** 2
        variance = (1 - alpha) * sigma_next**2 / sigma**2
        mean = (sample - (1 - alpha) / sigma * noise) / alpha.sqrt()
        fresh = torch.randn(sample.shape, generator=generator, device=sample.device, dtype=sample.dtype)
        return Step(mean + variance.sqrt() * fresh, clean)

    def _scales(self, timesteps: Tensor, like: Tensor) -> tuple[Tensor, Tensor]:
        """Return sqrt(abar_t) and sqrt(1 - abar_t), shaped to broadcast over `like`."""
        cumulative = self.alphas_cumprod.to(like.device)[timesteps.to(like.device)]
        cumulative = cumulative.view(-1, *[1] * (like.dim() - 1)).to(like.dtype)
        return cumulative.sqrt(), (1 - cumulative).sqrt()

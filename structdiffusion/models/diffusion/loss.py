"""The denoising loss (paper section III.A) on batches of demonstrations."""

from __future__ import annotations

import torch
from torch import Tensor

from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.diffusion.model import PoseDiffusion
from structdiffusion.models.diffusion.scheduler import NoiseScheduler


def diffusion_loss(
    model: PoseDiffusion,
    scheduler: NoiseScheduler,
    data: DemonstrationBatches,
    generator: torch.Generator,
    scenes: int = 48,
    noises: int = 6,
    autocast: bool = False,
) -> dict[str, Tensor]:
    """Return the mean squared error of the prediction over `scenes` scenes at `noises` diffusion steps each.

    Encoding a scene costs more than a denoising pass, so several passes share one encoding. With `autocast` the
    transformer computes in bfloat16; geometry never does, because its third digit is a millimetre.
    """
    batch = data.draw(scenes, generator)
    clean = model.encode_state(batch.world_from_structure, batch.position, batch.turn)
    nouns = data.noun_ids(batch.object_ids, model.config.nouns, generator)
    condition = model.condition(batch.clouds, batch.present, nouns, words=batch.words, sentence=batch.sentence)
    condition = condition.repeat(noises)
    clean = clean.repeat_interleave(noises, dim=0)
    device = clean.device
    # Stratified diffusion steps: each scene gets low and high noise alike.
    uniform = torch.rand(scenes, noises, generator=generator, device=device)
    share = (torch.arange(noises, device=device) + uniform) / noises
    timesteps = (share.flatten() * scheduler.steps).long().clamp(max=scheduler.steps - 1)
    noise = torch.randn(clean.shape, generator=generator, device=device)
    noisy = scheduler.add_noise(clean, noise, timesteps)
    with torch.autocast(device.type, dtype=torch.bfloat16, enabled=autocast):
        prediction = model(noisy, timesteps, condition)
    error = (prediction - scheduler.target(clean, noise, timesteps)) ** 2
    there = torch.cat((torch.ones_like(condition.present[:, :1]), condition.present), dim=1)[..., None]  # (B, 1+N, 1)
    position = (error[..., :3] * there).sum() / (3 * there.sum())
    rotation = (error[..., 3:] * there).sum() / (6 * there.sum())
    # Positions determine the geometry and have the larger weight; two of the six rotation numbers are constant.
    return {"loss": position + 0.5 * rotation, "position": position, "rotation": rotation}

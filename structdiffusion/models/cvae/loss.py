"""The evidence lower bound of the CVAE on batches of demonstrations."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.distributions import kl_divergence

from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.cvae.model import PoseCVAE

# The standard deviation of the poses about the generator's output, in units of the state: 0.1 is 7 to 10 mm. It sets
# the precision to which the latent has to encode poses, and so the weight of the divergence: with a smaller one the
# latent would carry what the generator should infer from the clouds, and samples from the prior would lack it.
DEVIATION = 0.1
# Rotations have half the weight of positions, as in the diffusion model's loss.
ROTATION_WEIGHT = 0.5


def cvae_loss(
    model: PoseCVAE,
    data: DemonstrationBatches,
    generator: torch.Generator,
    scenes: int = 48,
    autocast: bool = False,
) -> dict[str, Tensor]:
    """Return the negative evidence lower bound, scaled so that the squared position error has weight 1.

    With poses Gaussian about the generator's output, the bound is |error|^2 / (2 s^2) + KL, summed over a scene; in
    units of the mean squared error of the T tokens' 3 numbers, KL has the weight 2 s^2 / 3 T. The weight is constant:
    annealing would prevent the posterior from collapsing to the prior before the latent is used, but a generator that
    predicts all poses at once needs the latent anyway. With `autocast` the transformers compute in bfloat16, as in the
    diffusion model's loss.
    """
    batch = data.draw(scenes, generator)
    state = model.encode_state(batch.world_from_structure, batch.position, batch.turn)
    nouns = data.noun_ids(batch.object_ids, model.config.nouns, generator)
    condition = model.condition(batch.clouds, batch.present, nouns, words=batch.words, sentence=batch.sentence)
    with torch.autocast(state.device.type, dtype=torch.bfloat16, enabled=autocast):
        posterior = model.posterior(state, condition)
        noise = torch.randn(posterior.mean.shape, generator=generator, device=state.device)
        generated = model(posterior.mean + posterior.stddev * noise, condition)
        prior = model.prior(condition)
    error = (generated - state) ** 2
    there = torch.cat((torch.ones_like(condition.present[:, :1]), condition.present), dim=1)[..., None]  # (B, 1+N, 1)
    tokens = there.sum()
    position = (error[..., :3] * there).sum() / (3 * tokens)
    rotation = (error[..., 3:] * there).sum() / (6 * tokens)
    divergence = kl_divergence(posterior, prior).sum(dim=-1)  # (B,) nats
    weight = 2 * DEVIATION**2 / 3
    loss = position + ROTATION_WEIGHT * rotation + weight * divergence.sum() / tokens
    return {"loss": loss, "position": position, "rotation": rotation, "divergence": divergence.mean()}

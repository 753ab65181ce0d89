"""A task for the training loop that is small enough for a test."""

import torch

from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig


def toy():
    """A small network and a task with an exact answer: are two clouds near each other?"""
    torch.manual_seed(0)
    model = CollisionDiscriminator(CollisionConfig(width=8, layers=1, points=8))

    def loss(generator):
        clouds = torch.randn(2, 16, 8, 3, generator=generator) * 0.03
        near = torch.rand(16, generator=generator) < 0.5
        clouds[1] += torch.where(near, 0.0, 0.15)[:, None, None]
        logits = model(clouds[0], clouds[1])
        return {"loss": torch.nn.functional.binary_cross_entropy_with_logits(logits, near.float())}

    return model, loss

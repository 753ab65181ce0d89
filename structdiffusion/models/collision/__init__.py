"""The pairwise collision discriminator."""

from structdiffusion.models.collision.model import CollisionDiscriminator

__all__ = ["CollisionDiscriminator"]

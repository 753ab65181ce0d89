"""The outcome discriminator."""

from structdiffusion.models.outcome.model import OutcomeDiscriminator

__all__ = ["OutcomeDiscriminator"]

"""The conditional variational autoencoder over poses: a baseline of the paper."""

from structdiffusion.models.cvae.model import PoseCVAE

__all__ = ["PoseCVAE"]

"""The conditional pose diffusion transformer."""

from structdiffusion.models.diffusion.model import PoseDiffusion

__all__ = ["PoseDiffusion"]

"""The autoregressive transformer over poses: a baseline of the paper."""

from structdiffusion.models.structformer.model import StructFormer

__all__ = ["StructFormer"]

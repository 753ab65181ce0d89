"""The structure discriminator."""

from structdiffusion.models.structure.model import StructureDiscriminator

__all__ = ["StructureDiscriminator"]

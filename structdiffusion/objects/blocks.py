"""Generate toy blocks: cubes, bricks, slabs and cylinders of several sizes, each in six colours.

They are the objects of instructions that sort by colour or height, and of structures that need equal objects. No model
was trained on them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.solids import assemble, box, frustum

# Name -> RGB in [0, 1], as the simulated camera's colours are named again.
BLOCK_COLORS: Mapping[str, tuple[float, float, float]] = {
    "red": (0.80, 0.12, 0.12),
    "orange": (0.95, 0.50, 0.10),
    "yellow": (0.93, 0.83, 0.15),
    "green": (0.15, 0.60, 0.22),
    "blue": (0.13, 0.30, 0.78),
    "purple": (0.50, 0.20, 0.62),
}
# Noun and convex part of each form; the arm's gripper closes on all of them.
_FORMS: Mapping[str, tuple[str, np.ndarray]] = {
    "cube_35": ("block", box(0.035, 0.035, 0.0, 0.035)),
    "cube_50": ("block", box(0.050, 0.050, 0.0, 0.050)),
    "cube_65": ("block", box(0.065, 0.065, 0.0, 0.065)),
    "slab": ("block", box(0.070, 0.050, 0.0, 0.025)),
    "brick": ("block", box(0.080, 0.040, 0.0, 0.040)),
    "post": ("block", box(0.045, 0.045, 0.0, 0.090)),
    "disc": ("cylinder", frustum(0.030, 0.030, 0.0, 0.030)),
    "drum": ("cylinder", frustum(0.026, 0.026, 0.0, 0.050)),
    "column": ("cylinder", frustum(0.024, 0.024, 0.0, 0.075)),
    "pillar": ("cylinder", frustum(0.028, 0.028, 0.0, 0.105)),
}
_DENSITY, _FRICTION = 650.0, 0.6  # kg/m3 of beech, and of wood on wood


def block_objects() -> list[ObjectModel]:
    """Return every form in every colour, such as "cube_50_red"."""
    return [
        _block(f"{form}_{color}", noun, part, rgb)
        for form, (noun, part) in _FORMS.items()
        for color, rgb in BLOCK_COLORS.items()
    ]


def _block(name: str, noun: str, part: np.ndarray, rgb: tuple[float, float, float]) -> ObjectModel:
    return assemble(
        name,
        noun,
        [part],
        density=_DENSITY,
        friction=_FRICTION,
        color=rgb,
        source="blocks",
        rng=np.random.default_rng(0),
    )

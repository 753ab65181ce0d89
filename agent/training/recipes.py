"""List the networks that `structagent train` trains, and the settings for each, without importing any network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from grounding.spec import FIRST_SHAPES
from structdiffusion.models import structformer_name


@dataclass(frozen=True)
class Recipe:
    """How a network is trained.

    Attributes:
        steps: optimiser steps, earlier runs included.
        learning_rate: the peak of its schedule.
        batch: scenes per step and device; pairs of objects for the collision discriminator, arrangements for the stroke
            network, views for segmentation.
    """

    steps: int
    learning_rate: float
    batch: int


# A baseline's step costs what one of the diffusion model does, of which each encoded scene serves six passes. The four
# StructFormers together take as many as the CVAE.
RECIPES: Mapping[str, Recipe] = {
    "diffusion": Recipe(16_000, 8e-4, 32),
    "cvae": Recipe(12_000, 8e-4, 48),
    **{structformer_name(shape): Recipe(3_000, 8e-4, 48) for shape in FIRST_SHAPES},
    "structure": Recipe(4_000, 1e-3, 32),
    "collision": Recipe(5_000, 1e-3, 64),
    "outcome": Recipe(5_000, 1.5e-3, 32),
}
STROKES = Recipe(3_000, 3e-3, 32)  # steps of arrangements, which are drawn while it trains
SEGMENTATION = Recipe(3_500, 1.5e-3, 8)  # steps of views of synthetic tables, which are drawn while it trains
SEGMENTATION_VIEWS = 20_000
# As objects of the sentence "Train ...".
TITLES: Mapping[str, str] = {
    "diffusion": "the pose diffusion model",
    "cvae": "the CVAE baseline",
    **{structformer_name(shape): f"StructFormer for {shape}s (baseline)" for shape in FIRST_SHAPES},
    "structure": "the structure discriminator",
    "collision": "the collision discriminator",
    "outcome": "the outcome discriminator",
}

"""The planners by the names that people give them. Imports no network: names are asked for where nothing is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class PlannerParts:
    """What a planner is made of.

    Attributes:
        network: "diffusion", "cvae", "structformer" (one network a shape) or "geometric" (none).
        sentence: whether the network is told the sentence's embedding rather than word tokens.
        ranked: whether discriminators and checks rank what it proposes.
        cem: whether the cross-entropy method improves samples by the structure discriminator's score.
        guidance: weight of the structure discriminator's gradient in the denoising.
    """

    network: str
    sentence: bool = False
    ranked: bool = True
    cem: bool = False
    guidance: float = 0.0


# The paper's methods and ablations. Only the diffusion model's weights come along (see `sampling.load_planner`).
PLANNERS: Mapping[str, PlannerParts] = {
    "diffusion": PlannerParts("diffusion", sentence=True),
    "diffusion-tokens": PlannerParts("diffusion"),
    "geometric": PlannerParts("geometric"),
    "diffusion-unranked": PlannerParts("diffusion", sentence=True, ranked=False),
    "diffusion-tokens-unranked": PlannerParts("diffusion", ranked=False),
    "diffusion-tokens+guidance1": PlannerParts("diffusion", guidance=1.0),
    "diffusion-tokens+guidance2": PlannerParts("diffusion", guidance=2.0),
    "diffusion-tokens+guidance4": PlannerParts("diffusion", guidance=4.0),
    "diffusion-tokens+guidance8": PlannerParts("diffusion", guidance=8.0),
    "cvae": PlannerParts("cvae"),
    "cvae-unranked": PlannerParts("cvae", ranked=False),
    "cvae+cem": PlannerParts("cvae", cem=True),
    "cvae+cem-unranked": PlannerParts("cvae", cem=True, ranked=False),
    "structformer": PlannerParts("structformer"),
    "structformer-unranked": PlannerParts("structformer", ranked=False),
    "structformer+cem": PlannerParts("structformer", cem=True),
    "structformer+cem-unranked": PlannerParts("structformer", cem=True, ranked=False),
}

"""The planners by name. The module imports no network, because names are needed where nothing is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from grounding.spec import FIRST_SHAPES
from structdiffusion.models import structformer_name


@dataclass(frozen=True)
class PlannerParts:
    """The parts of a planner. Each switch below `cem` disables one part that goes beyond the paper.

    Attributes:
        network: "diffusion", "cvae", "structformer" (one network a shape) or "geometric" (none).
        sentence: whether the network takes the sentence's embedding rather than word tokens.
        ranked: whether discriminators and checks rank the proposals.
        guidance: weight of the structure discriminator's gradient in the denoising.
        cem: whether the cross-entropy method improves samples by the structure discriminator's score.
        placed: whether objects are set down, and structures moved into the requested thirds, by the observed outlines.
        refined: whether structures that miss a check by little are corrected, and objects moved apart.
        discriminators: whether the trained discriminators count in the rank.
        outcome: whether the outcome discriminator takes the place of the structure discriminator.
        mean_collision: rank by the mean over pairs of the chance of no collision, as in the paper, not the product.
        bounds: whether hanging over the table's edge counts in the rank.
        checks: whether the checks on estimated outlines count in the rank.
        rollouts: how many of the best are tried in physics rollouts.
        sampler: "ddim", or "ddpm" as in the paper.
        steps: of denoising.
        candidates: a fixed number of proposals that overrides the requested number; `None` uses the requested number.
    """

    network: str
    sentence: bool = False
    ranked: bool = True
    guidance: float = 0.0
    cem: bool = False
    placed: bool = True
    refined: bool = True
    discriminators: bool = True
    outcome: bool = False
    mean_collision: bool = False
    bounds: bool = True
    checks: bool = True
    rollouts: int = 0
    sampler: str = "ddim"
    steps: int = 10
    candidates: int | None = None


# Physics rollouts try the best-ranked until enough of them stand; this limit is rarely reached.
_TRIED = 40
_FULL = PlannerParts("diffusion", rollouts=_TRIED)
# What ranking and geometry mend does not show in raw samples: these take the steps with which they were measured.
_RAW_STEPS = 25
_UNRANKED = replace(_FULL, ranked=False, rollouts=0, steps=_RAW_STEPS)
_AS_IN_THE_PAPER: dict[str, Any] = {
    "placed": False, "refined": False, "mean_collision": True, "bounds": False, "checks": False, "rollouts": 0,
}  # fmt: skip
_PAPER = replace(_FULL, **_AS_IN_THE_PAPER, steps=_RAW_STEPS)


def _with_variants(name: str, parts: PlannerParts) -> dict[str, PlannerParts]:
    """Return the variants of a baseline: with all parts like the diffusion model, unranked, and without geometry."""
    paper = replace(parts, **_AS_IN_THE_PAPER)
    return {
        name: parts,
        f"{name}-unranked": replace(parts, ranked=False, rollouts=0),
        f"{name}-paper": paper,
        f"{name}-paper-unranked": replace(paper, ranked=False),
    }


# The paper's methods, and ablations of what goes beyond it.
PLANNERS: Mapping[str, PlannerParts] = {
    "diffusion": replace(_FULL, sentence=True),
    "diffusion-tokens": _FULL,
    "geometric": PlannerParts("geometric"),
    "geometric+rollout": PlannerParts("geometric", rollouts=_TRIED),
    "diffusion-unranked": replace(_UNRANKED, sentence=True),
    "diffusion-tokens-unranked": _UNRANKED,
    # As in the paper: no geometry, the two discriminators' rank alone, or none.
    "diffusion-paper": replace(_PAPER, sentence=True),
    "diffusion-paper-unranked": replace(_PAPER, sentence=True, ranked=False),
    "diffusion-tokens-paper": _PAPER,
    "diffusion-tokens-paper-unranked": replace(_PAPER, ranked=False),
    # Learned alone as well, but ranked by the outcome discriminator.
    "diffusion-learned": replace(_PAPER, sentence=True, outcome=True, mean_collision=False),
    "diffusion-tokens-learned": replace(_PAPER, outcome=True, mean_collision=False),
    **{f"diffusion-tokens+guidance{weight:g}": replace(_UNRANKED, guidance=weight) for weight in (1.0, 2.0, 4.0, 8.0)},
    **_with_variants("cvae", replace(_FULL, network="cvae")),
    **_with_variants("cvae+cem", replace(_FULL, network="cvae", cem=True)),
    **_with_variants("structformer", replace(_FULL, network="structformer")),
    **_with_variants("structformer+cem", replace(_FULL, network="structformer", cem=True)),
    # One part left out, or another number of steps or candidates.
    "diffusion-tokens-no-placement": replace(_FULL, placed=False, refined=False),
    "diffusion-tokens-no-refinement": replace(_FULL, refined=False),
    "diffusion-tokens-no-rollout": replace(_FULL, rollouts=0),
    "diffusion-tokens-no-discriminators": replace(_FULL, discriminators=False),
    "diffusion-tokens-mean-collision": replace(_FULL, mean_collision=True),
    "diffusion-tokens-no-bounds": replace(_FULL, bounds=False),
    "diffusion-tokens-no-checks": replace(_FULL, checks=False),
    "diffusion-tokens-steps5": replace(_FULL, steps=5),
    "diffusion-tokens-steps25": replace(_FULL, steps=25),
    "diffusion-tokens-ddpm200": replace(_FULL, sampler="ddpm", steps=200),
    "diffusion-tokens-best4": replace(_FULL, candidates=4),
    "diffusion-tokens-best16": replace(_FULL, candidates=16),
    "diffusion-tokens-best256": replace(_FULL, candidates=256),
}


# Those that people build with; the others are the paper's baselines and ablations, which tables are made of.
USUAL = ("diffusion", "diffusion-tokens", "geometric", "geometric+rollout")
# The names in messages: all of them would fill half a page.
LEGAL_NAMES = f"{', '.join(USUAL)}, and the baselines and ablations (see `structagent models list`)"


def legal_instead_of(name: str) -> str:
    """Return the part of a message that names the legal planners: similar names, or else the usual ones."""
    near = get_close_matches(name.lower(), PLANNERS, n=3)
    if not near:
        return f"legal values: {LEGAL_NAMES}"
    return f"did you mean {' or '.join(map(repr, near))}? See `structagent models list`"


def networks_of(planner: str) -> list[str]:
    """Return the names of the networks that a planner (one of `PLANNERS`) needs: generators, then discriminators."""
    parts = PLANNERS[planner]
    proposing = [] if parts.network == "geometric" else [parts.network]
    if parts.network == "structformer":
        proposing = [structformer_name(shape) for shape in FIRST_SHAPES]
    judged = bool(proposing) and parts.ranked
    if judged and parts.outcome:
        return [*proposing, "outcome", "collision"]
    structure = ["structure"] if judged or parts.cem or parts.guidance else []
    return proposing + structure + (["collision"] if judged else [])

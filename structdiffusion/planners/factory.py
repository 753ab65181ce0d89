"""Load planners by name."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import torch

from grounding.spec import SHAPES
from structdiffusion.models import structformer_name
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.outcome import OutcomeDiscriminator
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.baselines import CVAEPlanner, StructFormerPlanner
from structdiffusion.planners.cem import PoseSearch
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.post_processor import PostProcessor
from structdiffusion.planners.registry import LEGAL_NAMES, PLANNERS, PlannerParts, networks_of
from structdiffusion.postprocessing.ranking import Ranker

WEIGHTS = Path(__file__).parents[1] / "weights"


class Planner(Protocol):
    """The protocol of all planners, which propose arrangements."""

    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose up to `count` arrangements, best first."""


def load_planner(name: str, weights: Path | None = None) -> Planner:
    """Load a planner by name, such as "diffusion" (takes a sentence), "diffusion-tokens" (takes words) or "geometric".

    Args:
        name: one of `PLANNERS`.
        weights: a folder with a checkpoint for each network that the planner needs: `diffusion/`, `cvae/` or
            `structformer_SHAPE/`, and the discriminators `structure/` and `collision/`; `None` for those shipped.

    Raises:
        ValueError: for an unknown name.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    if name not in PLANNERS:
        raise ValueError(f"model cannot be {name!r}; legal values: {LEGAL_NAMES}")
    parts = PLANNERS[name]
    if parts.network == "geometric":
        return GeometricPlanner(parts.rollouts)
    folder = Path(weights) if weights is not None else WEIGHTS
    if not folder.is_dir():
        raise CheckpointError(f"there is no folder {folder} with checkpoints")
    missing = [network for network in networks_of(name) if not (folder / network).is_dir()]
    if missing:
        raise CheckpointError(
            f"{folder} lacks {', '.join(missing)}, which model {name!r} needs: `structagent train {missing[0]} "
            f"--data SCENES --out {folder / missing[0]}` makes it{'' if weights else '; a clone of the project has it'}"
        )
    if parts.network == "structformer":
        shapes = [shape for shape in SHAPES if (folder / structformer_name(shape)).is_dir()]
        by_shape = {shape: _load_structformer(folder, shape) for shape in shapes}
        post_process, search, _ = _load_judges(parts, folder)
        return StructFormerPlanner(by_shape, post_process, search)
    if parts.network == "cvae":
        cvae = PoseCVAE.from_pretrained(folder / "cvae")
        post_process, search, _ = _load_judges(parts, folder)
        return CVAEPlanner(cvae, post_process, search)
    model = PoseDiffusion.from_pretrained(folder / "diffusion")
    post_process, _, guide = _load_judges(parts, folder)
    try:
        return DiffusionPlanner(
            model, post_process, sentence=parts.sentence, steps=parts.steps, sampler=parts.sampler,
            guide=guide, guidance=parts.guidance, candidates=parts.candidates,
        )  # fmt: skip
    except ValueError as error:  # it was trained with fewer steps than this planner takes
        raise CheckpointError(f"{folder / 'diffusion'} cannot be used by model {name!r}: {error}") from error


def _load_judges(
    parts: PlannerParts, folder: Path
) -> tuple[PostProcessor, PoseSearch | None, StructureDiscriminator | None]:
    """Load the post-processing of a planner, and its search and guidance if it has them."""
    if not (parts.ranked or parts.cem or parts.guidance):
        return PostProcessor(parts.placed, parts.refined, None, parts.rollouts), None, None
    if parts.outcome:
        judge: StructureDiscriminator | OutcomeDiscriminator = OutcomeDiscriminator.from_pretrained(folder / "outcome")
    else:
        judge = StructureDiscriminator.from_pretrained(folder / "structure")
    ranker = None
    if parts.ranked:
        ranker = Ranker(
            judge,
            CollisionDiscriminator.from_pretrained(folder / "collision"),
            discriminators=parts.discriminators,
            mean_collision=parts.mean_collision,
            bounds=parts.bounds,
            estimated_checks=parts.checks,
        )
    post_process = PostProcessor(parts.placed, parts.refined, ranker, parts.rollouts)
    if isinstance(judge, OutcomeDiscriminator):
        return post_process, None, None
    return post_process, PoseSearch(judge) if parts.cem else None, judge if parts.guidance else None


def _load_structformer(folder: Path, shape: str) -> StructFormer:
    """Load the network for a shape; another shape's, in its place, is refused."""
    place = folder / structformer_name(shape)
    network = StructFormer.from_pretrained(place)
    if network.config.shape != shape:
        raise CheckpointError(f"{place} is the network for a {network.config.shape}; expected the one for a {shape}")
    return network

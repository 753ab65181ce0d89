"""Planners: from a scene and a goal to ranked arrangements, by the diffusion model or by geometry alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
import torch

from grounding.spec import SHAPES
from structdiffusion.baselines import CVAEPlanner, StructFormerPlanner
from structdiffusion.cem import PoseSearch
from structdiffusion.estimate import ObjectEstimate, estimate
from structdiffusion.footprints import CLEARANCE, clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.guidance import StructureScore, guided
from structdiffusion.layouts import LayoutError, lay_out
from structdiffusion.models import structformer_name
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import Arrangement, Goal, Scene, Table
from structdiffusion.planners import PLANNERS, PlannerParts
from structdiffusion.proposing import Observed, begin, finish, observed
from structdiffusion.ranking import Ranker, checks_score
from structdiffusion.scheduler import NoiseScheduler
from structdiffusion.settle import settle

WEIGHTS = Path(__file__).parent / "weights"
SAMPLING_STEPS = 25
# Told what is clean so far: (step, steps, motions (K, N, 4, 4)).
Preview = Callable[[int, int, np.ndarray], None]


class Planner(Protocol):
    """Whatever proposes arrangements, best first."""

    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]: ...


def load_planner(name: str, weights: Path | None = None) -> Planner:
    """The planner of a name, such as "diffusion" (told a sentence), "diffusion-tokens" (told words) or "geometric".

    Args:
        name: one of `PLANNERS`.
        weights: a folder with a checkpoint for each network that the planner needs: `diffusion/`, `cvae/` or
            `structformer_SHAPE/`, and the discriminators `structure/` and `collision/`; `None` for those shipped.

    Raises:
        ValueError: for an unknown name.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    if name not in PLANNERS:
        raise ValueError(f"model cannot be {name!r}; legal values: {', '.join(PLANNERS)}")
    parts = PLANNERS[name]
    if parts.network == "geometric":
        return GeometricPlanner()
    folder = Path(weights) if weights is not None else WEIGHTS
    if not folder.is_dir():
        raise CheckpointError(f"there is no folder {folder} with checkpoints")
    networks = [structformer_name(shape) for shape in SHAPES] if parts.network == "structformer" else [parts.network]
    missing = [network for network in networks if not (folder / network).is_dir()]
    if weights is None and missing:
        raise CheckpointError(
            f"the weights of model {name!r} do not come along: make DIR/{', DIR/'.join(missing)} as with `structagent "
            f"train {missing[0]} --data SCENES --out DIR/{missing[0]}`, copy structure/ and collision/ from {folder} "
            "to DIR, and give `--weights DIR`"
        )
    if parts.network == "structformer":
        return StructFormerPlanner({shape: _structformer(folder, shape) for shape in SHAPES}, *_judges(parts, folder))
    if parts.network == "cvae":
        return CVAEPlanner(PoseCVAE.from_pretrained(folder / "cvae"), *_judges(parts, folder))
    model = PoseDiffusion.from_pretrained(folder / "diffusion")
    ranker, _ = _judges(parts, folder)
    guide = StructureDiscriminator.from_pretrained(folder / "structure") if parts.guidance else None
    return DiffusionPlanner(model, ranker, sentence=parts.sentence, guide=guide, guidance=parts.guidance)


def _judges(parts: PlannerParts, folder: Path) -> tuple[Ranker | None, PoseSearch | None]:
    """What ranks and what improves a planner's samples, where it has them."""
    if not (parts.ranked or parts.cem):
        return None, None
    structure = StructureDiscriminator.from_pretrained(folder / "structure")
    ranker = Ranker(structure, CollisionDiscriminator.from_pretrained(folder / "collision")) if parts.ranked else None
    return ranker, PoseSearch(structure) if parts.cem else None


def _structformer(folder: Path, shape: str) -> StructFormer:
    """The network for a shape; another shape's, in its place, is refused."""
    place = folder / structformer_name(shape)
    network = StructFormer.from_pretrained(place)
    if network.config.shape != shape:
        raise CheckpointError(f"{place} is the network for a {network.config.shape}; expected the one for a {shape}")
    return network


class DiffusionPlanner:
    """StructDiffusion (paper section V): samples poses from the diffusion model and ranks them.

    Args:
        model: the denoiser.
        ranker: the discriminators.
        sentence: tell the model the sentence's embedding rather than word tokens.
        steps: denoising steps.
        sampler: "ddim", or "ddpm" as in the paper (with 200 steps).
        guide: the discriminator that guides the denoising (see `guidance`), with
        guidance: its weight; at 0 nothing guides.
    """

    def __init__(
        self,
        model: PoseDiffusion,
        ranker: Ranker | None,
        *,
        sentence: bool = True,
        steps: int = SAMPLING_STEPS,
        sampler: str = "ddim",
        guide: StructureDiscriminator | None = None,
        guidance: float = 0.0,
    ) -> None:
        self.model, self.ranker, self.sentence = model, ranker, sentence
        self.guide, self.guidance = guide, guidance if guide is not None else 0.0
        self.scheduler = NoiseScheduler(model.config.steps, model.config.prediction_type)
        self.scheduler.set_timesteps(steps, sampler)

    @torch.no_grad()
    def propose(
        self,
        scene: Scene,
        goal: Goal,
        *,
        count: int = 64,
        generator: torch.Generator,
        preview: Preview | None = None,
    ) -> list[Arrangement]:
        """`count` arrangements, best first; without a ranker, in the order of sampling.

        Raises:
            ValueError: when the sentence model gets no embedding, or the scene has too many objects.
        """
        seen = observed(scene, goal, self.model, self.sentence, generator)
        motions, frames = self.sample(seen, goal, count, generator, preview)
        return finish(seen, scene, goal, motions, frames, self.ranker, generator)

    @torch.no_grad()
    def sample(
        self, seen: Observed, goal: Goal, count: int, generator: torch.Generator, preview: Preview | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sampled motions (count, N, 4, 4) and structure frames (count, 4, 4), as the model gives them."""
        samples = begin(self.model, seen, goal, self.sentence, count, generator)
        score = StructureScore.of(self.guide, seen, samples, goal) if self.guidance else None
        state = torch.randn(count, 1 + len(seen.objects), 9, generator=generator)
        timesteps = self.scheduler.timesteps
        for index, timestep in enumerate(timesteps):
            now = timestep.expand(count)
            prediction = self.model(state, now, samples.condition)
            if score is not None:
                clean = self.scheduler.predict_clean(prediction, now, state)
                clean = guided(clean, self.scheduler.noise_level(timestep), self.guidance, self.model, score)
                prediction = self.scheduler.prediction_of(clean, now, state)
            step = self.scheduler.step(prediction, index, state, generator)
            state = step.previous
            if preview is not None:
                preview(index + 1, len(timesteps), samples.motions(self.model, step.predicted_clean)[0])
        return samples.motions(self.model, state)


class GeometricPlanner:
    """The exact planner, given only what the camera saw: a baseline without learning."""

    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Up to `count` layouts of the estimated outlines, those whose imagined checks hold first.

        Raises:
            LayoutError: when no layout exists for these objects on this table.
        """
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        objects = [estimate(cloud) for cloud in scene.objects]
        others = [estimate(cloud) for cloud in scene.distractors]
        arrangements, reason = [], None
        for _ in range(count):
            order = rng.permutation(len(objects))
            try:
                layout = lay_out([objects[i].layout_item() for i in order], goal.spec, scene.table, rng)
            except LayoutError as error:
                reason = error
                continue
            motions = np.zeros((len(objects), 4, 4))
            for place, i in enumerate(order):
                item_at = objects[i].outline.mean(axis=0) - objects[i].layout_item().footprint.mean(axis=0)
                turn = pose_from_xyz_yaw(0.0, 0.0, 0.0, layout.turns[place])
                turn[:2, 3] = layout.positions[place, :2] - turn[:2, :2] @ item_at
                turn[2, 3] = layout.positions[place, 2]
                motions[i] = turn
            motions = settle(objects, motions)
            scores = self._scores(objects, others, motions, goal, scene.table)
            arrangements.append(Arrangement(motions, scores, layout.world_from_structure))
        if not arrangements:
            raise reason
        return sorted(arrangements, key=lambda arrangement: -arrangement.scores["total"])

    @staticmethod
    def _scores(
        objects: Sequence[ObjectEstimate],
        others: Sequence[ObjectEstimate],
        motions: np.ndarray,
        goal: Goal,
        table: Table,
    ) -> dict[str, float]:
        outlines = [thing.outline_after(motion) for thing, motion in zip(objects, motions)]
        hits = sum(clear_gap(outline, other.outline) < CLEARANCE for outline in outlines for other in others)
        scores = {"checks": checks_score(objects, motions, goal.spec, table), "free of distractors": 1.0 / (1.0 + hits)}
        return {**scores, "total": math.prod(scores.values())}

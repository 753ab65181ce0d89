"""From a scene and a goal to ranked arrangements: encode once, sample a batch, settle, rank."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from structdiffusion.estimate import ObjectEstimate, estimate
from structdiffusion.footprints import CLEARANCE, clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.layouts import LayoutError, lay_out, setting_base, tower_order
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.encoders import word_ids
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import Arrangement, Goal, ObjectCloud, Scene, Table
from structdiffusion.placement import shift_into_place
from structdiffusion.ranking import Ranker, checks_score
from structdiffusion.scheduler import NoiseScheduler
from structdiffusion.settle import settle

PLANNERS = ("diffusion", "diffusion-tokens", "geometric")
WEIGHTS = Path(__file__).parent / "weights"
SAMPLING_STEPS = 25
_CLOUD_POINTS = 256  # as in training
# Told what is clean so far: (step, steps, motions (K, N, 4, 4)).
Preview = Callable[[int, int, np.ndarray], None]


class Planner(Protocol):
    """Whatever proposes arrangements, best first."""

    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]: ...


def load_planner(name: str, weights: Path | None = None) -> Planner:
    """The planner of a name: "diffusion" (told a sentence), "diffusion-tokens" (told words) or "geometric".

    Args:
        name: one of `PLANNERS`.
        weights: a folder with the checkpoints `diffusion/`, `structure/` and `collision/`; `None` for those shipped.

    Raises:
        ValueError: for an unknown name.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    if name not in PLANNERS:
        raise ValueError(f"model cannot be {name!r}; legal values: {', '.join(PLANNERS)}")
    if name == "geometric":
        return GeometricPlanner()
    folder = Path(weights) if weights is not None else WEIGHTS
    if not folder.is_dir():
        raise CheckpointError(f"there is no folder {folder} with checkpoints")
    return DiffusionPlanner(
        PoseDiffusion.from_pretrained(folder / "diffusion"),
        Ranker(
            StructureDiscriminator.from_pretrained(folder / "structure"),
            CollisionDiscriminator.from_pretrained(folder / "collision"),
        ),
        sentence=name == "diffusion",
    )


class DiffusionPlanner:
    """StructDiffusion (paper section V): samples poses from the diffusion model and ranks them.

    Args:
        model: the denoiser.
        ranker: the discriminators.
        sentence: tell the model the sentence's embedding rather than word tokens.
        steps: denoising steps.
        sampler: "ddim", or "ddpm" as in the paper (with 200 steps).
    """

    def __init__(
        self,
        model: PoseDiffusion,
        ranker: Ranker | None,
        *,
        sentence: bool = True,
        steps: int = SAMPLING_STEPS,
        sampler: str = "ddim",
    ) -> None:
        self.model, self.ranker, self.sentence = model, ranker, sentence
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
        if len(scene.objects) > self.model.config.max_objects:
            raise ValueError(
                f"{len(scene.objects)} objects are more than this model knows; legal: 1 to {self.model.config.max_objects}"
            )
        if self.sentence and goal.embedding is None:
            raise ValueError("the sentence model needs a sentence embedding; for slots alone use model 'diffusion-tokens'")
        objects = [estimate(cloud) for cloud in scene.objects]
        others = [estimate(cloud) for cloud in scene.distractors]
        clouds = _sampled_clouds(scene.objects, generator)
        nouns = torch.tensor(self.model.noun_ids([cloud.category for cloud in scene.objects]))
        motions, frames = self.sample(clouds, nouns, objects, goal, count, generator, preview)
        motions = np.array([settle(objects, row) for row in motions])
        for row, frame in zip(motions, frames):
            shift = shift_into_place(objects, row, goal.spec, scene.table)
            row[:, :2, 3] += shift
            frame[:2, 3] += shift
        arrangements = [Arrangement(row, {}, frame) for row, frame in zip(motions, frames)]
        if self.ranker is None:
            return arrangements
        other_clouds = _sampled_clouds(scene.distractors, generator)
        scores = self.ranker.scores(objects, others, clouds, other_clouds, nouns, motions, goal.spec, scene.table)
        ranked = [replace(arrangement, scores=row) for arrangement, row in zip(arrangements, scores)]
        return sorted(ranked, key=lambda arrangement: -arrangement.scores["total"])

    @torch.no_grad()
    def sample(
        self,
        clouds: Tensor,
        nouns: Tensor,
        objects: list[ObjectEstimate],
        goal: Goal,
        count: int,
        generator: torch.Generator,
        preview: Preview | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sampled motions (count, N, 4, 4) and structure frames (count, 4, 4), as the model gives them.

        Every sample has the objects in another order, since object i takes place i of the structure.
        """
        condition = self.model.condition(
            clouds[None],
            torch.ones(1, len(clouds), dtype=torch.bool),
            nouns[None],
            words=torch.tensor([word_ids(goal.spec)]),
            sentence=torch.from_numpy(goal.embedding).float()[None] if self.sentence else None,
        ).repeat(count)
        order = self._orders(objects, goal, count, generator)  # (K, N)
        rows = torch.arange(count)[:, None]
        condition = replace(condition, objects=condition.objects[rows, order])
        means = clouds.mean(dim=1)[order]  # (K, N, 3)
        back = order.argsort(dim=1)

        def motions(state: Tensor) -> tuple[np.ndarray, np.ndarray]:
            frame, position, turn = self.model.decode_state(state)
            motion = torch.eye(4).repeat(count, len(clouds), 1, 1)
            motion[..., :3, :3] = turn
            motion[..., :3, 3] = position - torch.einsum("knij,knj->kni", turn, means)
            return motion[rows, back].double().numpy(), frame.double().numpy()

        state = torch.randn(count, 1 + len(clouds), 9, generator=generator)
        timesteps = self.scheduler.timesteps
        for index, timestep in enumerate(timesteps):
            prediction = self.model(state, timestep.expand(count), condition)
            step = self.scheduler.step(prediction, index, state, generator)
            state = step.previous
            if preview is not None:
                preview(index + 1, len(timesteps), motions(step.predicted_clean)[0])
        return motions(state)

    def _orders(
        self, objects: list[ObjectEstimate], goal: Goal, count: int, generator: torch.Generator
    ) -> Tensor:
        """Which object takes which place, (count, N), as in the demonstrations.

        Random around a ring and along a line; what carries goes below in a tower; the base of a table setting
        comes first. With an open shape, every third sample has the order of each.
        """
        random = torch.rand(count, len(objects), generator=generator).argsort(dim=1)
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        items = [thing.layout_item() for thing in objects]
        stacked = torch.tensor([tower_order(items, rng) for _ in range(count)])
        base = setting_base(items)
        first = (random == base).long().argsort(dim=1, descending=True, stable=True)
        based = random.gather(1, first)
        if goal.spec.shape is None:
            third = (torch.arange(count) % 3)[:, None]
            return torch.where(third == 0, random, torch.where(third == 1, stacked, based))
        return {"tower": stacked, "table setting": based}.get(goal.spec.shape, random)


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


def _sampled_clouds(clouds: Sequence[ObjectCloud], generator: torch.Generator) -> Tensor:
    """The clouds with 256 points each: (N, 256, 3), drawn without repetition where there are enough."""
    rows = []
    for cloud in clouds:
        points = torch.from_numpy(np.asarray(cloud.points, dtype=np.float32))
        order = torch.randperm(len(points), generator=generator)
        rows.append(points[order[torch.arange(_CLOUD_POINTS) % len(points)]])
    return torch.stack(rows) if rows else torch.zeros(0, _CLOUD_POINTS, 3)

"""Process samples before they are proposed: set objects down, correct poses, rank arrangements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, estimate
from structdiffusion.observation import Arrangement, Scene, StructureGoal, Table
from structdiffusion.planners.samples import EncodedScene, PoseSamples, sample_clouds
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.postprocessing.ranking import Ranker
from structdiffusion.postprocessing.refinement import align_cutlery, fit_to_size, separate
from structdiffusion.postprocessing.settling import settle
from structdiffusion.postprocessing.table_regions import shift_into_place


@dataclass(frozen=True)
class PostProcessor:
    """A chain that turns samples into arrangements, best first. Each part can be disabled, to measure its effect.

    Attributes:
        placed: set objects down (`settle`), and move the structure as a whole into the requested thirds
            (`table_regions`).
        refined: correct poses that miss a check by little, and move objects apart (`refinement`).
        ranker: ranks the arrangements; without it they keep the order of sampling.
        rollouts: how many of the best-ranked are tried in physics rollouts (`physics_reranking`).
    """

    placed: bool = True
    refined: bool = True
    ranker: Ranker | None = None
    rollouts: int = 0

    def __call__(
        self, seen: EncodedScene, scene: Scene, goal: StructureGoal, sampled: PoseSamples, generator: torch.Generator
    ) -> list[Arrangement]:
        """Return the arrangements, best first. Without a ranker every total is 1."""
        motions, frames = sampled.motions.copy(), sampled.frames.copy()
        others = [estimate(cloud) for cloud in scene.distractors]
        if self.placed:
            for row, frame in zip(motions, frames):
                self._place(seen.objects, others, row, frame, goal.spec, scene.table)
        arrangements = [Arrangement(row, {"total": 1.0}, frame) for row, frame in zip(motions, frames)]
        if self.ranker is not None:
            other_clouds = sample_clouds(scene.distractors, generator)
            scores = self.ranker.scores(
                seen.objects, others, seen.clouds, other_clouds, seen.nouns, motions, goal.spec, scene.table,
                sampled.orders,
            )  # fmt: skip
            ranked = [replace(arrangement, scores=row) for arrangement, row in zip(arrangements, scores)]
            arrangements = sorted(ranked, key=lambda arrangement: -arrangement.scores["total"])
        if self.rollouts:
            arrangements = rerank_by_physics(PhysicsRollout(scene), arrangements, goal.spec, self.rollouts)
        return arrangements

    def _place(
        self,
        objects: Sequence[ObjectEstimate],
        others: Sequence[ObjectEstimate],
        motions: np.ndarray,
        frame: np.ndarray,
        spec: StructureSpec,
        table: Table,
    ) -> None:
        """Set one arrangement (N, 4, 4) down, refine it, and move it with its frame (4, 4), in place."""
        motions[:] = settle(objects, motions)
        if self.refined:
            motions[:] = fit_to_size(objects, motions, spec)
            motions[:] = align_cutlery(objects, motions, spec, math.atan2(frame[1, 0], frame[0, 0]))
        shift = shift_into_place(objects, motions, spec, table)
        motions[:, :2, 3] += shift
        frame[:2, 3] += shift
        if self.refined:
            motions[:] = separate(objects, others, motions)

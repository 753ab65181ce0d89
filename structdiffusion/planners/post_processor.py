"""Process samples before they are proposed: set objects down, correct poses, rank arrangements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import torch

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate, imagined_structures
from structdiffusion.geometry import yaw_of
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.samples import EncodedScene, PoseSamples, sample_clouds
from structdiffusion.postprocessing.anchoring import anchor, those_as_asked
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.postprocessing.ranking import Ranker
from structdiffusion.postprocessing.refinement import align_cutlery, fit_to_size, separate
from structdiffusion.postprocessing.settling import settle_each
from structdiffusion.postprocessing.table_regions import shift_into_place
from structdiffusion.structures.bodies import PlacedBody


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
        placed = self.place(seen, scene, goal.spec, sampled) if self.placed else sampled
        arrangements = those_as_asked(self.rank(seen, scene, goal.spec, placed, generator), scene)
        if self.rollouts:
            arrangements = rerank_by_physics(PhysicsRollout(scene), arrangements, goal.spec, self.rollouts)
        return arrangements

    def without_physics(self) -> PostProcessor:
        """Return the same chain without physics rollouts."""
        return replace(self, rollouts=0)

    def place(self, seen: EncodedScene, scene: Scene, spec: StructureSpec, sampled: PoseSamples) -> PoseSamples:
        """Set the samples down, refine them, and move each with its frame to its place on the table."""
        objects, others = seen.objects, [estimate(cloud) for cloud in scene.distractors]
        motions, frames = settle_each(objects, sampled.motions), sampled.frames.copy()

        def everyone() -> Iterator[tuple[int, list[PlacedBody]]]:
            return enumerate(imagined_structures(objects, motions))

        if self.refined:
            for k, bodies in everyone():
                motions[k] = fit_to_size(objects, motions[k], spec, bodies)
            for k, bodies in everyone():
                motions[k] = align_cutlery(objects, motions[k], spec, yaw_of(frames[k]), bodies)
        for k, bodies in everyone():
            shift = shift_into_place(objects, motions[k], spec, scene.table, bodies)
            motions[k, :, :2, 3] += shift
            frames[k, :2, 3] += shift
        motions, frames = anchor(objects, motions, frames, spec, scene.fixed)
        if self.refined:
            for k, bodies in everyone():
                motions[k] = separate(objects, others, motions[k], bodies)
            motions, frames = anchor(objects, motions, frames, spec, scene.fixed)
        return PoseSamples(motions, frames, sampled.orders)

    def rank(
        self, seen: EncodedScene, scene: Scene, spec: StructureSpec, placed: PoseSamples, generator: torch.Generator
    ) -> list[Arrangement]:
        """Return the samples as arrangements, best first; without a ranker in their order, and every total is 1."""
        if self.ranker is None:
            return [Arrangement(row, {"total": 1.0}, frame) for row, frame in zip(placed.motions, placed.frames)]
        others = [estimate(cloud) for cloud in scene.distractors]
        scores = self.ranker.scores(
            seen.objects, others, seen.clouds, sample_clouds(scene.distractors, generator), seen.nouns, placed.motions,
            spec, scene.table, placed.orders,
        )  # fmt: skip
        rows = zip(placed.motions, scores, placed.frames, strict=True)
        return sorted((Arrangement(*row) for row in rows), key=lambda arrangement: -arrangement.scores["total"])

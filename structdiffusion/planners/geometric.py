"""The geometric planner on observed objects: a baseline without learning."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch

from structdiffusion.completion.estimate import ObjectEstimate, estimate, imagined_structures
from structdiffusion.evaluation_protocol import CLEARANCE
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.layouts import lay_out, nearest_to_fitting
from structdiffusion.observation import Arrangement, Scene, StructureGoal, Table
from structdiffusion.postprocessing.anchoring import anchor, those_as_asked
from structdiffusion.postprocessing.estimated_checks import checks_scores
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.postprocessing.settling import settle_each
from structdiffusion.structures.structure import LayoutError


class GeometricPlanner:
    """The geometric planner, which uses only the camera's observation.

    Args:
        rollouts: how many of the best are tried in physics rollouts (`physics_reranking`).
    """

    def __init__(self, rollouts: int = 0) -> None:
        self.rollouts = rollouts

    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose up to `count` layouts of the estimated outlines, those whose estimated checks hold first.

        Raises:
            LayoutError: if no layout exists for these objects on this table.
        """
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        objects = [estimate(cloud) for cloud in scene.objects]
        others = [estimate(cloud) for cloud in scene.distractors]
        laid_out, frames, reasons = [], [], list[LayoutError]()
        for _ in range(count):
            order = rng.permutation(len(objects))
            try:
                layout = lay_out([objects[i].layout_item() for i in order], goal.spec, scene.table, rng)
            except LayoutError as error:
                reasons.append(error)
                continue
            motions = np.zeros((len(objects), 4, 4))
            for place, i in enumerate(order):
                item_at = objects[i].outline.mean(axis=0) - objects[i].layout_item().footprint.mean(axis=0)
                turn = pose_from_xyz_yaw(0.0, 0.0, 0.0, layout.turns[place])
                turn[:2, 3] = layout.positions[place, :2] - turn[:2, :2] @ item_at
                turn[2, 3] = layout.positions[place, 2]
                motions[i] = turn
            laid_out.append(motions)
            frames.append(layout.world_from_structure)
        if not laid_out:
            raise nearest_to_fitting(reasons)
        settled = settle_each(objects, np.array(laid_out))
        settled, placed_frames = anchor(objects, settled, np.array(frames), goal.spec, scene.fixed)
        scores = self._scores(objects, others, settled, goal, scene.table)
        arrangements = [Arrangement(*row) for row in zip(settled, scores, placed_frames, strict=True)]
        arrangements = those_as_asked(arrangements, scene)
        arrangements.sort(key=lambda arrangement: -arrangement.scores["total"])
        if self.rollouts:
            return rerank_by_physics(PhysicsRollout(scene), arrangements, goal.spec, self.rollouts)
        return arrangements

    @staticmethod
    def _scores(
        objects: Sequence[ObjectEstimate],
        others: Sequence[ObjectEstimate],
        motions: np.ndarray,
        goal: StructureGoal,
        table: Table,
    ) -> list[dict[str, float]]:
        """Score K layouts (K, N, 4, 4)."""
        structures = imagined_structures(objects, motions)
        rows = []
        for bodies, checks in zip(structures, checks_scores(objects, motions, goal.spec, table, structures)):
            hits = sum(clear_gap(body.footprint, other.outline) < CLEARANCE for body in bodies for other in others)
            rows.append({"checks": checks, "free of distractors": 1.0 / (1.0 + hits)})
        return [{**row, "total": math.prod(row.values())} for row in rows]

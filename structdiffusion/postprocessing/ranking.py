"""Score proposed arrangements, each score in [0, 1], and rank them (paper sections IV.C and V.D)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_structures
from structdiffusion.footprints import clear_gap
from structdiffusion.models.checkpoint import require_sound
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.scene_discriminator import SceneDiscriminator
from structdiffusion.observation import Table
from structdiffusion.postprocessing.estimated_checks import checks_scores, support_score
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.word_tokens import are_known_words, word_ids

# m between outlines, above which two objects cannot intersect, so the network is not evaluated.
_NEAR = 0.015
_PAIR_BATCH = 256
_OVERHANG = 0.01  # m beyond the edge that reduce the score by a factor e


@dataclass(frozen=True)
class Ranker:
    """Scores of arrangements from trained discriminators, the table's bounds and the checks on estimated outlines.

    Attributes:
        structure: the structure discriminator, or the outcome discriminator in its place.
        collision: the collision discriminator.
        estimated_checks: whether the checks of the evaluation protocol on estimated outlines, and supports, count.
        discriminators: whether the discriminators count.
        mean_collision: score collisions by the mean over pairs of the probability of no collision, as in the paper,
            instead of the probability that no pair collides (noisy or).
        bounds: whether hanging over the table's edge counts.
    """

    structure: SceneDiscriminator
    collision: CollisionDiscriminator
    estimated_checks: bool = True
    discriminators: bool = True
    mean_collision: bool = False
    bounds: bool = True

    @torch.no_grad()
    def scores(
        self,
        objects: Sequence[ObjectEstimate],
        others: Sequence[ObjectEstimate],
        clouds: Tensor,
        other_clouds: Tensor,
        nouns: Tensor,
        motions: np.ndarray,
        spec: StructureSpec,
        table: Table,
        orders: np.ndarray | None = None,
    ) -> list[dict[str, float]]:
        """Score K arrangements; each gets its scores, and their product as "total".

        Args:
            objects: N estimates; others: M estimates of the distractors.
            clouds: (N, P, 3) before anything moves; other_clouds: (M, P, 3).
            nouns: (N,) noun ids.
            motions: (K, N, 4, 4) upright motions, world frame.
            spec: the requested structure.
            table: the table.
            orders: (K, N) the object of each place, as in the demonstrations that trained the structure discriminator;
                with `None`, objects without a place of their own come in the order of `objects`.
        """
        bodies = imagined_structures(objects, motions)
        rows: list[dict[str, float]] = [{} for _ in motions]
        if self.discriminators:
            moved = torch.from_numpy(motions).to(clouds)
            at_goal = torch.einsum("knij,npj->knpi", moved[..., :3, :3], clouds) + moved[..., None, :3, 3]
            if orders is None:
                orders = np.tile(_places(objects, spec), (len(motions), 1))
            # Of a shape that the structure discriminator was not trained on, the other scores decide.
            if are_known_words(spec, self.structure.config.vocabulary):
                structure = self._structure(at_goal, nouns, spec, torch.from_numpy(orders))
                require_sound(structure, self.structure.kind)
                for row, score in zip(rows, structure, strict=True):
                    row[self.structure.kind] = float(score)
            free = self._collision_free(bodies, others, at_goal, other_clouds)
            require_sound(free, CollisionDiscriminator.kind)
            for row, score in zip(rows, free, strict=True):
                row["collision"] = float(score)
        checks = checks_scores(objects, motions, spec, table, bodies) if self.estimated_checks else []
        for k, row in enumerate(rows):
            if self.bounds:
                outlines = np.concatenate([body.footprint for body in bodies[k]])
                row["bounds"] = math.exp(-table.overhang(outlines) / _OVERHANG)
            if self.estimated_checks:
                row["checks"] = checks[k]
                row["support"] = support_score(objects, bodies[k])
            row["total"] = math.prod(row.values())
        return rows

    def _structure(self, at_goal: Tensor, nouns: Tensor, spec: StructureSpec, orders: Tensor) -> Tensor:
        """Score clouds at their goals (K, N, P, 3), place by place: (K,)."""
        count = len(at_goal)
        present = torch.ones(orders.shape, dtype=torch.bool)
        words = torch.tensor([word_ids(spec)]).expand(count, -1)
        in_place = at_goal[torch.arange(count)[:, None], orders]
        return self.structure(in_place, present, nouns[orders], words).sigmoid()

    def _collision_free(
        self,
        structures: list[list[PlacedBody]],
        others: Sequence[ObjectEstimate],
        at_goal: Tensor,
        other_clouds: Tensor,
    ) -> Tensor:
        """Return for each arrangement the probability that no pair collides: the product, or (as in the paper) the
        mean.

        One certain collision among 21 pairs reduces a mean by only five percent. Pairs too far apart to collide are
        skipped.
        """
        first, second, owner = [], [], []
        standing = [thing.outline for thing in others], [(0.0, thing.height) for thing in others]
        for k, row in enumerate(structures):
            outlines = [body.footprint for body in row] + standing[0]
            levels = [(body.z_bottom, body.z_top) for body in row] + standing[1]
            for i, j in _near_pairs(outlines, levels, len(row)):
                first.append(at_goal[k, i])
                second.append(at_goal[k, j] if j < len(row) else other_clouds[j - len(row)])
                owner.append(k)
        count, things = at_goal.shape[:2]
        pairs = things * (things - 1) / 2 + things * len(others)
        logarithm, hits = torch.zeros(count), torch.zeros(count)
        for start in range(0, len(owner), _PAIR_BATCH):
            part = slice(start, start + _PAIR_BATCH)
            logits = self.collision(torch.stack(first[part]), torch.stack(second[part]))
            owners = torch.tensor(owner[part])
            logarithm.index_add_(0, owners, torch.nn.functional.logsigmoid(-logits))
            hits.index_add_(0, owners, logits.sigmoid())
        return 1.0 - hits / max(pairs, 1.0) if self.mean_collision else logarithm.exp()


def _near_pairs(
    outlines: Sequence[np.ndarray], levels: Sequence[tuple[float, float]], count: int
) -> list[tuple[int, int]]:
    """Return which of the first `count` of M objects are close enough to which later one to evaluate the pair.

    Their boxes rule out most pairs.

    Args:
        outlines: M outlines (K, 2), metres.
        levels: the lowest and highest z of each, metres.
        count: the number of objects that are paired with all later ones.
    """
    low = np.array([[*outline.min(axis=0), bottom] for outline, (bottom, _) in zip(outlines, levels)])
    high = np.array([[*outline.max(axis=0), top] for outline, (_, top) in zip(outlines, levels)])
    apart = np.maximum(low[:count, None], low) - np.minimum(high[:count, None], high)  # (count, M, 3)
    return [
        (i, j)
        for i, j in np.argwhere((apart < _NEAR).all(axis=-1)).tolist()
        if i < j and clear_gap(outlines[i], outlines[j]) < _NEAR
    ]


def _places(objects: Sequence[ObjectEstimate], spec: StructureSpec) -> np.ndarray:
    """Return the objects (1, N) in their order, except those that have a fixed place in the requested structure."""
    order = np.arange(len(objects))[None]
    if spec.shape is None:
        return order
    items = [thing.layout_item() for thing in objects]
    ordered = structure_named(spec.shape).order_places(items, order, np.random.default_rng(0))
    return order if ordered is None else ordered

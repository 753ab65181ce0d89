"""Scores of imagined arrangements, each in [0, 1], and the order that they give (paper section IV.C and V.D)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import torch
from torch import Tensor

from grounding.spec import StructureSpec
from structdiffusion.estimate import ObjectEstimate, imagined_bodies
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.layouts import setting_base
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.encoders import word_ids
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import Table
from structdiffusion.success import check_structure

# Farther apart than this, metres, in outline, two objects cannot intersect: the network is not asked.
_NEAR = 0.015
_PAIR_BATCH = 256
_OVERHANG = 0.01  # m beyond the edge that costs a factor e
_WRONG = 0.5  # factor for an arrangement whose imagined checks do not all hold, times the share that do
# How far objects land from where they are put, roughly: m, rad. A goal that only just holds is worth less.
_SHIFT, _TURN, _TRIALS = 0.004, 0.03, 5

_WEDGED = 0.4  # factor for a thing on a round top, or neither in a vessel nor across it
_WELL_INSIDE, _RIM_SLACK = 0.75, 0.004  # of a vessel's outline; m that a rim may be wider than what covers it


@dataclass(frozen=True)
class Ranker:
    """Scores arrangements with the two discriminators, the table's bounds and the imagined checks.

    Attributes:
        structure, collision: trained discriminators.
        imagined_checks: whether the contract's checks on estimated outlines, and what carries what, count.
    """

    structure: StructureDiscriminator
    collision: CollisionDiscriminator
    imagined_checks: bool = True

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
    ) -> list[dict[str, float]]:
        """Scores of K arrangements, with their product as "total".

        Args:
            objects: N estimates; others: M estimates of the distractors.
            clouds: (N, P, 3) before anything moves; other_clouds: (M, P, 3).
            nouns: (N,) noun ids.
            motions: (K, N, 4, 4) upright motions, world frame.
            spec: what was asked for.
            table: the table.
        """
        count = len(motions)
        moved = torch.from_numpy(motions).to(clouds)
        at_goal = torch.einsum("knij,npj->knpi", moved[..., :3, :3], clouds) + moved[..., None, :3, 3]
        present = torch.ones(count, len(objects), dtype=torch.bool)
        words = torch.tensor([word_ids(spec)]).expand(count, -1)
        order = list(range(len(objects)))
        if spec.shape == "table setting":  # as in the demonstrations, where the base comes first
            base = setting_base([thing.layout_item() for thing in objects])
            order = [base, *(i for i in order if i != base)]
        structure = self.structure(at_goal[:, order], present, nouns[order].expand(count, -1), words).sigmoid()
        outlines = [[thing.outline_after(motion) for thing, motion in zip(objects, row)] for row in motions]
        free = self._collision_free(outlines, [thing.outline for thing in others], at_goal, other_clouds)
        rows = []
        for k in range(count):
            row = {
                "structure": float(structure[k]),
                "collision": float(free[k]),
                "bounds": math.exp(-table.overhang(np.concatenate(outlines[k])) / _OVERHANG),
            }
            if self.imagined_checks:
                row["checks"] = checks_score(objects, motions[k], spec, table)
                row["support"] = support_score(objects, motions[k])
            row["total"] = math.prod(row.values())
            rows.append(row)
        return rows

    def _collision_free(
        self, outlines: list[list[np.ndarray]], others: list[np.ndarray], at_goal: Tensor, other_clouds: Tensor
    ) -> Tensor:
        """For each arrangement, the chance that no pair collides: the product over pairs, not the mean.

        One hard hit among 21 pairs would cost a mean only five percent.
        """
        first, second, owner = [], [], []
        for k, row in enumerate(outlines):
            for i, outline in enumerate(row):
                for j in range(i + 1, len(row)):
                    if clear_gap(outline, row[j]) < _NEAR:
                        first.append(at_goal[k, i])
                        second.append(at_goal[k, j])
                        owner.append(k)
                for j, other in enumerate(others):
                    if clear_gap(outline, other) < _NEAR:
                        first.append(at_goal[k, i])
                        second.append(other_clouds[j])
                        owner.append(k)
        logarithm = torch.zeros(len(outlines))
        for start in range(0, len(owner), _PAIR_BATCH):
            part = slice(start, start + _PAIR_BATCH)
            logits = self.collision(torch.stack(first[part]), torch.stack(second[part]))
            logarithm.index_add_(0, torch.tensor(owner[part]), torch.nn.functional.logsigmoid(-logits))
        return logarithm.exp()


def checks_score(objects: Sequence[ObjectEstimate], motions: np.ndarray, spec: StructureSpec, table: Table) -> float:
    """How surely the contract's checks hold, in [0, 1], for objects that land a few millimetres off.

    The mean over `_TRIALS` trials, the first as imagined, the others with the same small errors for every
    arrangement. A trial in which a check fails counts half of the share of checks that hold.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) upright motions, world frame.
    """
    rng = np.random.default_rng(0)
    score = 0.0
    for trial in range(_TRIALS):
        landed = motions if trial == 0 else np.array([_landed(m, thing, rng) for m, thing in zip(motions, objects)])
        held = [check.passed for check in check_structure(imagined_bodies(objects, landed), spec, table)]
        score += (1.0 if all(held) else _WRONG * sum(held) / len(held)) / _TRIALS
    return score


def support_score(objects: Sequence[ObjectEstimate], motions: np.ndarray) -> float:
    """How well whatever is stacked is carried, in [0, 1]; 1 where nothing is.

    On a level top: the share of the outline that is carried, 1 from a half on. On a vessel: 1 when the object
    either covers the rim or goes well inside; in between it may wedge or tip.

    Args: as `checks_score`.
    """
    bodies, score = imagined_bodies(objects, motions), 1.0
    for body in bodies:
        upper = shapely.Polygon(body.footprint)
        for carrier in body.rests_on:
            lower = shapely.Polygon(bodies[carrier].footprint)
            if not objects[carrier].stackable:
                score *= _WEDGED
            elif objects[carrier].hollow:
                inside = shapely.affinity.scale(lower, _WELL_INSIDE, _WELL_INSIDE)
                score *= 1.0 if inside.contains(upper) or upper.buffer(_RIM_SLACK).contains(lower) else _WEDGED
            else:
                score *= min(1.0, 2.0 * upper.intersection(lower).area / upper.area)
    return score


def _landed(motion: np.ndarray, thing: ObjectEstimate, rng: np.random.Generator) -> np.ndarray:
    """The motion with a small error: a turn about the object's middle, and a shift."""
    error = pose_from_xyz_yaw(0.0, 0.0, 0.0, _TURN * rng.standard_normal())
    middle = (motion @ np.append(thing.mean, 1.0))[:3]
    error[:3, 3] = middle - error[:3, :3] @ middle
    error[:2, 3] += _SHIFT * rng.standard_normal(2)
    return error @ motion

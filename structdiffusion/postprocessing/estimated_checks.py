"""Score proposed arrangements by their estimated outlines: how surely the checks hold, and what is carried."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_structures
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures.bodies import PlacedBody

_WRONG = 0.5  # factor for an arrangement that fails some of the checks on estimated outlines, times the share that hold
# Approximate landing errors: m, rad, and the number of trials with them. A goal that barely holds scores less.
_SHIFT, _TURN, _TRIALS = 0.004, 0.03, 5

_WEDGED = 0.4  # factor for an object on a round top, or neither inside a vessel nor across it
_WELL_INSIDE, _RIM_SLACK = 0.75, 0.004  # share of a vessel's outline; m by which a rim may be wider than what covers it


def checks_scores(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    spec: StructureSpec,
    table: Table,
    bodies: Sequence[list[PlacedBody]] | None = None,
) -> list[float]:
    """Score how surely the checks of the evaluation protocol hold, in [0, 1], for objects that land a few millimetres
    off.

    If a check fails at the proposed poses, the score is half of the share of checks that hold. Otherwise it is the mean
    over `_TRIALS` trials, the first at the proposed poses, the others with the same small errors for every arrangement;
    a trial in which a check fails counts half of the share of checks that hold.

    Args:
        objects: N estimates.
        motions: (K, N, 4, 4) upright motions, world frame.
        spec: the requested structure.
        table: the table.
        bodies: the K structures, if they are known (`imagined_structures`).
    """
    proposed = imagined_structures(objects, motions) if bodies is None else bodies
    scores = [_held(structure, spec, table) for structure in proposed]
    sure = [k for k, score in enumerate(scores) if score == 1.0]
    rng = np.random.default_rng(0)
    trials = [imagined_structures(objects, _landed(motions[sure], objects, rng)) for _ in range(_TRIALS - 1)]
    for number, k in enumerate(sure):
        scores[k] = (1.0 + sum(_held(structures[number], spec, table) for structures in trials)) / _TRIALS
    return scores


def _held(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> float:
    """Return 1 if all checks hold, or half of the share of those that do."""
    held = [check.passed for check in check_structure(bodies, spec, table)]
    return 1.0 if all(held) else _WRONG * sum(map(bool, held)) / len(held)


def support_score(objects: Sequence[ObjectEstimate], bodies: Sequence[PlacedBody]) -> float:
    """Score how well stacked objects are supported, in [0, 1]; 1 if nothing is stacked.

    On a level top, the score is the supported share of the outline, 1 from a half on. On a vessel, it is the same if
    the object covers the rim, and 1 if the object fits well inside; in between it may wedge or tip.

    Args:
        objects: N estimates.
        bodies: the proposed structure (`imagined_bodies`).
    """
    score = 1.0
    for body in bodies:
        if not body.rests_on:
            continue
        upper = shapely.Polygon(body.footprint)
        for carrier in body.rests_on:
            lower = shapely.Polygon(bodies[carrier].footprint)
            carried = min(1.0, 2.0 * upper.intersection(lower).area / upper.area)
            if not objects[carrier].stackable:
                score *= _WEDGED
            elif objects[carrier].hollow:
                inside = shapely.affinity.scale(lower, _WELL_INSIDE, _WELL_INSIDE)
                covers = upper.buffer(_RIM_SLACK).contains(lower)
                score *= 1.0 if inside.contains(upper) else carried if covers else _WEDGED
            else:
                score *= carried
    return score


def _landed(motions: np.ndarray, objects: Sequence[ObjectEstimate], rng: np.random.Generator) -> np.ndarray:
    """Return the motions (K, N, 4, 4) with a small error of each object: a rotation about its middle, and a shift."""
    landed = np.empty_like(motions)
    for i, thing in enumerate(objects):
        error = np.tile(pose_from_xyz_yaw(0.0, 0.0, 0.0, _TURN * rng.standard_normal()), (len(motions), 1, 1))
        middle = (motions[:, i] @ np.append(thing.mean, 1.0))[:, :3]
        error[:, :3, 3] = middle - (error[:, :3, :3] @ middle[..., None])[..., 0]
        error[:, :2, 3] += _SHIFT * rng.standard_normal(2)
        landed[:, i] = error @ motions[:, i]
    return landed

"""Refine proposed arrangements: correct small misses of the evaluation protocol's bands, and move objects apart.

Sampled poses are accurate to about a centimetre. A smaller error is enough to miss a band of sizes or gaps, or the free
space between two rims. The observed outlines determine how far to move; nothing moves if nothing is wrong.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_bodies
from structdiffusion.footprints import separation_along
from structdiffusion.geometry import HEADING_OF_ROTATION, pose_from_xyz_yaw
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody

# m of clear gap to which neighbours are separated: the unseen side of an object may reach a little farther
_GAP = 0.006
_ROUNDS = 8


def fit_to_size(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    spec: StructureSpec,
    bodies: Sequence[PlacedBody] | None = None,
) -> np.ndarray:
    """Give a structure the requested size, and make it as round, straight and even as the protocol requires.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) set down (`settle`), world frame.
        spec: the requested slots.
        bodies: the `imagined_bodies` of these motions, if they are known.

    Returns:
        (N, 4, 4); the same motions where the shape is open.
    """
    result = motions.copy()
    if spec.shape is not None:
        bodies = imagined_bodies(objects, motions) if bodies is None else bodies
        result[:, :2, 3] += structure_named(spec.shape).corrections(bodies, spec.size)
    return result


def align_cutlery(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    spec: StructureSpec,
    heading: float,
    bodies: Sequence[PlacedBody] | None = None,
) -> np.ndarray:
    """Turn objects with a front to their proper direction, such as the cutlery of a table setting away from the diner.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) set down (`settle`), world frame.
        spec: the requested slots; its rotation overrides `heading`.
        heading: that the sampled structure faces, radians.
        bodies: the `imagined_bodies` of these motions, if they are known.

    Returns:
        (N, 4, 4); each object turns about its own centroid.
    """
    result = motions.copy()
    if spec.shape is None:
        return result
    bodies = imagined_bodies(objects, motions) if bodies is None else bodies
    heading = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else heading
    for index, angle in enumerate(structure_named(spec.shape).turns(bodies, heading)):
        if angle:
            turn = pose_from_xyz_yaw(0.0, 0.0, 0.0, float(angle))
            turn[:2, 3] = bodies[index].centroid - turn[:2, :2] @ bodies[index].centroid
            result[index] = turn @ result[index]
    return result


def separate(
    objects: Sequence[ObjectEstimate],
    others: Sequence[ObjectEstimate],
    motions: np.ndarray,
    bodies: Sequence[PlacedBody] | None = None,
) -> np.ndarray:
    """Separate objects on the table by a clear gap; objects on top of one move with it.

    Args:
        objects: N estimates; others: of the distractors, which stay.
        motions: (N, 4, 4) set down (`settle`), world frame.
        bodies: the `imagined_bodies` of these motions, if they are known.
    """
    bodies = imagined_bodies(objects, motions) if bodies is None else bodies
    group = list(range(len(bodies)))  # the lowest of what stands on one another
    for index in sorted(group, key=lambda i: bodies[i].z_bottom):
        if bodies[index].rests_on:
            group[index] = group[bodies[index].rests_on[0]]
    roots = sorted(set(group))
    outlines = {root: bodies[root].footprint for root in roots}
    fixed = [other.outline for other in others]
    moved = {root: np.zeros(2) for root in roots}
    for _ in range(_ROUNDS):
        still = True
        for a, b in itertools.combinations(roots, 2):
            push = _push(outlines[a] + moved[a], outlines[b] + moved[b])
            if push is not None:
                moved[a], moved[b], still = moved[a] - push / 2, moved[b] + push / 2, False
        for root, outline in itertools.product(roots, fixed):
            push = _push(outline, outlines[root] + moved[root])
            if push is not None:
                moved[root], still = moved[root] + push, False
        if still:
            break
    result = motions.copy()
    result[:, :2, 3] += [moved[group[i]] for i in range(len(bodies))]
    return result


def _push(still: np.ndarray, moving: np.ndarray) -> np.ndarray | None:
    """Return the shift (2,) of the second outline (L, 2) from the first (K, 2), along the line of their middles."""
    middle, other = still.mean(axis=0), moving.mean(axis=0)
    between = other - middle
    apart = float(np.linalg.norm(between))
    reach = np.linalg.norm(still - middle, axis=1).max() + np.linalg.norm(moving - other, axis=1).max()
    if apart >= reach + _GAP:
        return None
    if shapely.distance(shapely.Polygon(still), shapely.Polygon(moving)) >= _GAP - 1e-4:
        return None
    direction = between / apart if apart > 1e-6 else np.array([0.0, 1.0])
    needed = separation_along(still - middle, moving - other, direction, _GAP)
    return max(0.0, needed - apart) * direction

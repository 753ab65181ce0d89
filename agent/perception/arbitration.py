"""Decide what is one object, from what geometry, colours and the segmentation network take for objects."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from agent.perception.clustering import Voxels
from agent.perception.masks import Masks, VoxelMasks
from agent.perception.piece_merging import merged
from agent.perception.piece_network import piece_network
from agent.perception.pieces import Proposals, Surface

GEOMETRY, NETWORK, BOTH = "geometry", "network", "both"
METHODS = (GEOMETRY, NETWORK, BOTH)
DEFAULT = BOTH
_NEAR = 0.02  # m to the next voxel that the network sees an object at


def decided(surface: Surface, proposals: Proposals, method: str) -> np.ndarray:
    """Return the object (V,) of each voxel, -1 for none.

    Args:
        surface: the voxels.
        proposals: of objects; without masks, geometry decides.
        method: one of `METHODS`.
    """
    if method == GEOMETRY or proposals.masks is None:
        return proposals.regions
    if method == NETWORK:
        return proposals.masks.of_voxel
    return merged(surface, proposals, piece_network())


def masks_of_voxels(masks: Masks, voxels: Voxels, chosen: np.ndarray, connected: np.ndarray) -> VoxelMasks:
    """Return what the network sees at each voxel; one where it sees nothing has the mask of a near one.

    Args:
        masks: of all points.
        voxels: of some points.
        chosen: (P,) which points these are.
        connected: (V,) the connected part of each voxel, -1 for none.
    """
    of_voxel = _filled(_of_voxels(masks.of_point[chosen], voxels, len(masks.certainty)), connected, voxels)
    return VoxelMasks(
        of_voxel, voxels.mean(masks.share[chosen]), voxels.mean(masks.votes[chosen]), voxels.positions,
        masks.certainty, masks.centres, masks.spreads,
    )  # fmt: skip


def _of_voxels(of_point: np.ndarray, voxels: Voxels, count: int) -> np.ndarray:
    """Return the mask (V,) that most points of each voxel have; -1 where most have none."""
    votes = np.zeros((len(voxels.count), count + 1), dtype=np.int32)
    np.add.at(votes, (voxels.of_point, of_point), 1)  # -1 is the last column
    best = votes.argmax(axis=1)
    return np.where(best == count, -1, best)


def _filled(mask: np.ndarray, connected: np.ndarray, voxels: Voxels) -> np.ndarray:
    """Give voxels of connected parts that have no mask that of a near voxel, and those of no part none."""
    mask = np.where(connected < 0, -1, mask)
    known = mask >= 0
    free = ~known & (connected >= 0)
    if not known.any() or not free.any():
        return mask
    away, nearest = cKDTree(voxels.positions[known]).query(voxels.positions[free], distance_upper_bound=_NEAR)
    mask[free] = np.append(mask[known], -1)[nearest]
    return mask

"""Decide between what geometry and what the segmentation network take for objects.

Geometry proposes; the network may divide one of its objects, or join several, where it is certain and geometry's own
evidence does not contradict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from agent.perception.clustering import Voxels
from agent.perception.network_masks import Masks

GEOMETRY, NETWORK, BOTH = "geometry", "network", "both"
METHODS = (GEOMETRY, NETWORK, BOTH)
DEFAULT = GEOMETRY
_LEAST = 60  # voxels of a piece that is divided off
_NEAR = 0.02  # m to the next voxel that the network sees an object at


@dataclass(frozen=True)
class Arbiter:
    """What the network sees, and how far it is believed.

    Attributes:
        masks: of all points.
        method: one of `METHODS`.
    """

    masks: Masks
    method: str

    def regrouped(self, part: np.ndarray, connected: np.ndarray, voxels: Voxels, chosen: np.ndarray) -> np.ndarray:
        """Return the object (V,) of each voxel.

        Args:
            part: (V,) geometry's object of each voxel, -1 for none.
            connected: (V,) the connected part that it was divided from.
            voxels: of the points above the table.
            chosen: (P,) which points these are.
        """
        mask = _of_voxels(self.masks.of_point[chosen], voxels, len(self.masks.certainty))
        mask = _filled(mask, connected, voxels)
        if self.method == NETWORK:
            return mask
        return part


def _of_voxels(of_point: np.ndarray, voxels: Voxels, count: int) -> np.ndarray:
    """Return the mask (V,) that most points of each voxel have; -1 where most have none."""
    votes = np.zeros((len(voxels.count), count + 1), dtype=np.int32)
    np.add.at(votes, (voxels.of_point, of_point), 1)  # -1 is the last column
    best = votes.argmax(axis=1)
    return np.where(best == count, -1, best)


def _filled(mask: np.ndarray, connected: np.ndarray, voxels: Voxels) -> np.ndarray:
    """Give voxels without a mask that of a near voxel of the same connected part."""
    mask = np.where(connected < 0, -1, mask)
    known = mask >= 0
    free = ~known & (connected >= 0)
    if not known.any() or not free.any():
        return mask
    away, nearest = cKDTree(voxels.positions[known]).query(voxels.positions[free], distance_upper_bound=_NEAR)
    mask[free] = np.append(mask[known], -1)[nearest]
    return mask

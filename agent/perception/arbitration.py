"""Decide between what geometry and what the segmentation network take for objects.

Geometry proposes; the network may divide one of its objects, or join several, where it is certain and geometry's own
evidence does not contradict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from agent.perception.clustering import Voxels
from agent.perception.color import differ
from agent.perception.masks import Masks

GEOMETRY, NETWORK, BOTH = "geometry", "network", "both"
METHODS = (GEOMETRY, NETWORK, BOTH)
DEFAULT = BOTH
_NEAR = 0.02  # m to the next voxel that the network sees an object at
_LEAST = 80  # voxels of each object that another is divided into
_LEAST_SHARE = 0.05  # of that one's voxels
_NARROWEST = 0.015  # m: what is neither wider nor higher is the edge of something
_CERTAIN_TO_DIVIDE, _CERTAIN_TO_JOIN = 0.9, 0.8  # masks; chosen on scenes of validation objects
_CERTAIN_TO_KEEP = 0.6  # masks that keep an object of several colours whole
_SEPARATION = 0.85  # times the sum of the spreads: the centres of two objects are farther apart
_WITHIN = 0.5  # of a mask lies in the object that it divides
_COVERED = 0.75  # of every object that a mask joins
_ALIKE = 18.0  # apart in CIELAB: one colour in light and shade


@dataclass(frozen=True)
class Arbiter:
    """What the network sees, and how far it is believed.

    Attributes:
        masks: of all points.
        method: one of `METHODS`.
    """

    masks: Masks
    method: str

    def mask_of(self, connected: np.ndarray, voxels: Voxels, chosen: np.ndarray) -> np.ndarray:
        """Return the network's mask (V,) of each voxel, -1 for none.

        Args:
            connected: (V,) the connected part of each voxel, -1 for none.
            voxels: of the points above the table.
            chosen: (P,) which points these are.
        """
        return _filled(_of_voxels(self.masks.of_point[chosen], voxels, len(self.masks.certainty)), connected, voxels)

    def regrouped(
        self, part: np.ndarray, connected: np.ndarray, mask: np.ndarray, positions: np.ndarray, lab: np.ndarray | None
    ) -> np.ndarray:
        """Return the object (V,) of each voxel.

        Args:
            part: (V,) geometry's object of each voxel, -1 for none.
            connected: (V,) the connected part that it was divided from.
            mask: (V,) the network's, as `mask_of` returns it.
            positions: (V, 3) of the voxels.
            lab: (V, 3) colours in CIELAB, or `None`.
        """
        if self.method == NETWORK:
            return mask
        part = divided(part, mask, self.masks, positions)
        return united(part, connected, mask, self.masks.certainty, lab)


def whole_again(part: np.ndarray, divided: np.ndarray, mask: np.ndarray, certainty: np.ndarray) -> np.ndarray:
    """Join the pieces of an object that one mask covers with certainty: a print has several colours too.

    Args:
        part, divided: (V,) the object of each voxel before and after it was divided, -1 for none.
        mask: (V,) the network's, -1 for none.
        certainty: (M,) of each mask.
    """
    result = divided.copy()
    for index in np.unique(part[part >= 0]):
        pieces = np.unique(divided[(part == index) & (divided >= 0)])
        if len(pieces) < 2:
            continue
        owner: dict[int, int] = {}
        for piece in pieces:
            own = mask[divided == piece]
            votes = np.bincount(own[own >= 0], minlength=len(certainty)) if len(certainty) else np.zeros(1)
            best = int(votes.argmax())
            if votes[best] < _COVERED * len(own) or certainty[best] < _CERTAIN_TO_KEEP:
                continue
            result[divided == piece] = owner.setdefault(best, int(piece))
    return result


def divided(part: np.ndarray, mask: np.ndarray, masks: Masks, positions: np.ndarray) -> np.ndarray:
    """Divide the objects in which the network is certain to see several.

    Args:
        part: (V,) the object of each voxel, -1 for none.
        mask: (V,) the network's.
        masks: what the network says of each.
        positions: (V, 3) of the voxels.
    """
    part, certainty = part.copy(), masks.certainty
    sizes = np.bincount(mask[mask >= 0], minlength=len(certainty))
    for index in np.unique(part[part >= 0]):
        own = np.flatnonzero(part == index)
        inside = np.bincount(mask[own][mask[own] >= 0], minlength=len(certainty))
        enough = inside >= max(_LEAST, _LEAST_SHARE * len(own))
        pieces = np.flatnonzero(enough & (inside >= _WITHIN * sizes) & (certainty >= _CERTAIN_TO_DIVIDE))
        pieces = np.array([k for k in pieces if _width(positions[own[mask[own] == k]]) > _NARROWEST])
        pieces = _separated(pieces[np.argsort(-inside[pieces])] if len(pieces) else pieces, masks)
        if len(pieces) < 2:
            continue
        known = np.isin(mask[own], pieces)
        nearest = cKDTree(positions[own[known]]).query(positions[own[~known]])[1]
        piece = mask[own].copy()
        piece[~known] = piece[known][nearest]
        for number in pieces[1:]:
            part[own[piece == number]] = part.max() + 1
    return part


def _separated(pieces: np.ndarray, masks: Masks) -> np.ndarray:
    """Return the masks, from the largest on, whose votes are clearly apart from those of the masks before."""
    kept = list[int]()
    for piece in pieces:
        apart = np.linalg.norm(masks.centres[kept] - masks.centres[piece], axis=1)
        if (apart > _SEPARATION * (masks.spreads[kept] + masks.spreads[piece])).all():
            kept.append(int(piece))
    return np.array(kept)


def united(
    part: np.ndarray, connected: np.ndarray, mask: np.ndarray, certainty: np.ndarray, lab: np.ndarray | None
) -> np.ndarray:
    """Join the objects that the network is certain to see as one, where their colours do not say otherwise.

    Args:
        part, mask: as `divided` takes them.
        certainty: (M,) of each mask.
        connected: (V,) the connected part of each voxel.
        lab: (V, 3) colours in CIELAB, or `None`.
    """
    part = part.copy()
    for number in np.flatnonzero(certainty >= _CERTAIN_TO_JOIN):
        sizes = np.bincount(part[part >= 0])
        inside = np.bincount(part[(mask == number) & (part >= 0)], minlength=len(sizes))
        # Specks are left alone: noise beside an object would widen it.
        covered = np.flatnonzero((inside >= _COVERED * sizes) & (sizes >= _LEAST))
        for other in covered[np.argsort(-sizes[covered])][1:]:
            first = covered[sizes[covered].argmax()]
            if _may_be_one(part == first, part == other, connected, lab):
                part[part == other] = first
    return part


def _may_be_one(one: np.ndarray, other: np.ndarray, connected: np.ndarray, lab: np.ndarray | None) -> bool:
    """Return whether nothing speaks against two objects (V,) being one: what is apart has to be alike."""
    if np.intersect1d(connected[one], connected[other]).size:
        return not differ(lab, one, other)
    if lab is None:
        return False
    return bool(np.linalg.norm(np.median(lab[one], axis=0) - np.median(lab[other], axis=0)) < _ALIKE)


def _width(positions: np.ndarray) -> float:
    """Return the smaller side, metres, of the upright box around voxels (V, 3), seen from above, or their height."""
    corners = np.array(shapely.LineString(positions[:, :2]).minimum_rotated_rectangle.exterior.coords)
    across = float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())
    return max(across, float(np.ptp(positions[:, 2])))


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

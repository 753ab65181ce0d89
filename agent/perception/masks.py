"""Define what the segmentation network sees, so that who decides about it need not load the network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Masks:
    """The objects that the network sees among P points.

    Attributes:
        of_point: (P,) the mask of each point, counted from 0; -1 where there is none.
        share: (P,) the probability that each point belongs to an object at all.
        certainty: (M,) how well the votes of each mask agree: 1 is best.
        centres: (M, 3) the mean vote of each, metres.
        spreads: (M,) metres.
        votes: (P, 3) where the network takes the middle of each point's object to be, metres.
    """

    of_point: np.ndarray
    share: np.ndarray
    certainty: np.ndarray
    centres: np.ndarray
    spreads: np.ndarray
    votes: np.ndarray


@dataclass(frozen=True)
class VoxelMasks:
    """The objects that the network sees among V voxels.

    Attributes:
        of_voxel: (V,) the mask of each voxel, counted from 0; -1 where there is none.
        share: (V,) the probability that each belongs to an object at all.
        votes: (V, 3) where the network takes the middle of its object to be, metres.
        places: (V, 3) the voxels in the frame of the votes.
        certainty, centres, spreads: as those of `Masks`.
    """

    of_voxel: np.ndarray
    share: np.ndarray
    votes: np.ndarray
    places: np.ndarray
    certainty: np.ndarray
    centres: np.ndarray
    spreads: np.ndarray

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
    """

    of_point: np.ndarray
    share: np.ndarray
    certainty: np.ndarray
    centres: np.ndarray
    spreads: np.ndarray

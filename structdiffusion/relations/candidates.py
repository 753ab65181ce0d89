"""Candidate places of one figure, evaluated all at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely


@dataclass(frozen=True)
class Candidates:
    """One figure at C places to choose from, world frame, metres.

    Attributes:
        outline: (K, 2) the outline of the figure about its centroid.
        centroids: (C, 2) the places.
        before: (2,) its centroid before anything moved.
    """

    outline: np.ndarray
    centroids: np.ndarray
    before: np.ndarray

    @cached_property
    def polygons(self) -> np.ndarray:
        """Return the outline at each place, (C,) shapely polygons."""
        return shapely.polygons(self.centroids[:, None] + self.outline)

    def gaps(self, outline: np.ndarray) -> np.ndarray:
        """Return the clear gap (C,), metres, from each place to another outline (L, 2); 0 if they overlap."""
        return shapely.distance(self.polygons, shapely.Polygon(outline))

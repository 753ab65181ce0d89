"""Share the geometry of circles and arcs: the least-squares circle, the angular gaps, and a requested radius."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from structdiffusion.evaluation_protocol import max_off_circle
from structdiffusion.footprints import fit_circle
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check
from structdiffusion.structures.structure import LayoutError, Structure, a_structure


class RingStructure(Structure):
    """A structure whose objects lie on a circle or a part of one."""

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centre (2,) of the least-squares circle; of fewer than three objects, the mean."""
        return super().centre(bodies) if len(bodies) < self.least else fit_ring(bodies)[0]

    def radius(self, bodies: Sequence[PlacedBody]) -> float:
        """Return the radius of the least-squares circle, metres; not a number for fewer than three objects."""
        return math.nan if len(bodies) < self.least else fit_ring(bodies)[1]

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices counter-clockwise from the widest gap."""
        offsets = np.array([body.centroid for body in bodies]) - self.centre(bodies)
        order = np.argsort(np.arctan2(offsets[:, 1], offsets[:, 0]))
        return [int(i) for i in np.roll(order, -1 - int(angular_gaps(offsets)[1].argmax()))]


def fit_ring(bodies: Sequence[PlacedBody]) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the centre (2,) and radius of the least-squares circle, and the offsets (N, 2) from its centre, metres."""
    points = np.array([body.centroid for body in bodies])
    centre, radius = fit_circle(points)
    return centre, radius, points - centre


def roundness_check(offsets: np.ndarray, radius: float) -> Check:
    """Check how far the objects at `offsets` (N, 2) from the centre are off the circle."""
    worst, allowed = float(np.abs(np.linalg.norm(offsets, axis=1) - radius).max()), max_off_circle(radius)
    return Check("distance to the circle (m)", worst <= allowed, worst, f"<= {allowed:.3f}")


def radius_with_room(name: str, radius: float, tightest: float) -> float:
    """Return a requested radius, metres.

    Raises:
        LayoutError: if it is less than the tightest at which the objects clear each other.
    """
    if radius < tightest:
        raise LayoutError(
            f"{a_structure(name)} with a radius of {radius:.3g} m is too small for these objects: they need "
            f"{tightest:.3f} m or more"
        )
    return radius


def angular_gaps(offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (N,) of objects about the centre, sorted, and the gap (N,) that follows each, radians."""
    angles = np.sort(np.arctan2(offsets[:, 1], offsets[:, 0]))
    return angles, np.diff(np.append(angles, angles[0] + 2 * math.pi))

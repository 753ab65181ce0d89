"""The conditions of the evaluation protocol that several structures share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import SIZE_BANDS, X_POSITION_THIRDS, Y_POSITION_THIRDS
from structdiffusion.footprints import centre_range
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import PlacedBody

# How the checks that measure a slot are called, in part: `structdiffusion.protocol.slot_measurement` finds them by it.
SIZE_MEASURE, HEADING_MEASURE, PLACE_MEASURE = "extent / tightest extent", "heading", "place in the range"


@dataclass(frozen=True)
class Check:
    """One condition of the evaluation protocol: its name, whether it held, the measured value and the limit."""

    name: str
    passed: bool
    measured: float
    limit: str

    @property
    def sentence(self) -> str:
        """Return what was measured and what is allowed: "gap off the mean gap (m): 0.0212, allowed <= 0.015"."""
        return f"{self.name}: {self.measured:.3g}, allowed {self.limit}"


def count_check(bodies: Sequence[PlacedBody], shape: str, least: int) -> Check:
    """Check that at least `least` objects take part."""
    return Check(f"objects in the {shape}", len(bodies) >= least, len(bodies), f">= {least}")


def heading_check(name: str, measured_yaw: float, rotation: str, limit_degrees: float) -> Check:
    """Check how many degrees a measured heading (rad, world frame) is off the one that a rotation names."""
    off = abs(math.degrees(wrap_angle(measured_yaw - HEADING_OF_ROTATION[rotation])))
    return Check(name, off <= limit_degrees, off, f"<= {limit_degrees:g}")


def size_checks(ratio: float, spec: StructureSpec) -> list[Check]:
    """Check the ratio of extent and tightest extent, if a size was requested."""
    if spec.size is None:
        return []
    low, high = SIZE_BANDS[spec.size]
    limit = f"< {high:g}" if low == 0 else f">= {low:g}" + ("" if math.isinf(high) else f" and < {high:g}")
    return [Check(SIZE_MEASURE, low <= ratio < high, ratio, limit)]


def on_table_check(bodies: Sequence[PlacedBody]) -> Check:
    """Check that no object stands on another."""
    stacked = sum(body.rests_on != () for body in bodies)
    return Check("objects on top of others", stacked == 0, stacked, "0")


def position_checks(bodies: Sequence[PlacedBody], centre: np.ndarray, spec: StructureSpec, table: Table) -> list[Check]:
    """Check the thirds of its range in which the centre (2,) lies; left is +y, top is +x.

    The range is that in which the centre can lie with everything on the table.
    """
    ranges = centre_range([body.footprint for body in bodies], centre, table)
    checks = []
    for value, axis, names in ((spec.x_position, 1, X_POSITION_THIRDS), (spec.y_position, 0, Y_POSITION_THIRDS)):
        if value is not None:
            low, high = ranges[axis]
            # A structure as wide as the table has no range: its centre counts as the middle of it.
            share = (centre[axis] - low) / (high - low) if high - low > 1e-6 else 0.5
            third = names.index(value)
            passed = third / 3 <= share <= (third + 1) / 3
            limit = f"{third / 3:.2f} to {(third + 1) / 3:.2f}"
            checks.append(Check(f"{value}: {PLACE_MEASURE}", passed, float(share), limit))
    return checks

"""Move a proposed structure as a whole to the requested region of the table.

The position of a structure and the relative poses of its parts are independent. A third of the room that a large
structure has on the table may be three centimetres wide, which sampling alone hits only by chance; the observed
outlines determine how far to move.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_bodies
from structdiffusion.evaluation_protocol import X_POSITION_THIRDS, Y_POSITION_THIRDS
from structdiffusion.footprints import centre_range
from structdiffusion.observation import Table
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody

# Kept from the borders of a third, as a share of it; and from the edge of the table, m.
_MARGIN, _EDGE = 0.35, 0.008


def shift_into_place(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    spec: StructureSpec,
    table: Table,
    bodies: Sequence[PlacedBody] | None = None,
) -> np.ndarray:
    """Return the least shift (2,), metres, that brings the structure onto the table and into the requested thirds.

    Zero along an axis on which it does not fit at all. With an open shape, zero: its centre is not defined.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) upright motions, world frame.
        spec: the requested slots.
        table: the table.
        bodies: the `imagined_bodies` of these motions, if they are known.
    """
    shift = np.zeros(2)
    if spec.shape is None:
        return shift
    bodies = imagined_bodies(objects, motions) if bodies is None else bodies
    centre = structure_named(spec.shape).centre(bodies)
    inner = Table(table.x_min + _EDGE, table.x_max - _EDGE, table.y_min + _EDGE, table.y_max - _EDGE)
    for axis, value, names in ((0, spec.y_position, Y_POSITION_THIRDS), (1, spec.x_position, X_POSITION_THIRDS)):
        low, high = centre_range([body.footprint for body in bodies], centre, inner)[axis]
        if high <= low:
            continue
        if value is not None:
            third = (high - low) / 3
            start = low + names.index(value) * third
            low, high = start + _MARGIN * third, start + (1 - _MARGIN) * third
        shift[axis] = np.clip(centre[axis], low, high) - centre[axis]
    return shift

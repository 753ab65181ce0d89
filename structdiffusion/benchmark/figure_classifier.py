"""Name the family of a finished structure blindly: the nearest of 20 figures by the checks of the
evaluation protocol.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.benchmark.figure_families import COUNTS
from structdiffusion.observation import Table
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody

# The 12 families, and eight that look like some of them.
NAMES = (*COUNTS, "letter A", "letter U", "letter X", "diamond", "arrow", "wave", "castle", "podium")
_TOUCHING = 0.006  # m between the bottom of an object and the top of what carries it


def named(bodies: Sequence[PlacedBody], table: Table) -> str | None:
    """Return the figure whose checks hold best; `None` if none takes so many objects.

    Of equal ones it is the one with the nearest outline, or of upright ones that with the most checks.
    """
    standing = with_supports(bodies)
    stacked = any(body.rests_on for body in standing)
    best: tuple[float, float, str] | None = None
    for name in NAMES:
        structure = structure_named(name)
        if structure.stacks != stacked:
            continue
        checks = structure.check(standing, StructureSpec(name), table)
        if not checks[0].passed:
            continue
        held = sum(check.passed for check in checks) / len(checks)
        rank = (-held, -len(checks) if stacked else checks[1].measured, name)
        best = rank if best is None else min(best, rank)
    return None if best is None else best[2]


def with_supports(bodies: Sequence[PlacedBody]) -> list[PlacedBody]:
    """Return bodies with what carries them, as it looks: where an outline overlaps another whose top it begins at."""
    outlines = [shapely.Polygon(body.footprint) for body in bodies]
    tops = np.array([body.z_top for body in bodies])
    found = []
    for i, body in enumerate(bodies):
        carriers = tuple(
            j
            for j in range(len(bodies))
            if j != i and body.z_bottom > _TOUCHING and abs(tops[j] - body.z_bottom) < _TOUCHING
            and outlines[i].intersection(outlines[j]).area > 1e-5
        )  # fmt: skip
        found.append(
            PlacedBody(
                body.name,
                body.category,
                body.footprint,
                body.centroid,
                body.z_bottom,
                body.z_top,
                body.front_yaw,
                carriers,
            )
        )
    return found

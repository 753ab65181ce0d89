"""The semantic checks of the evaluation protocol: does the structure on the table match the spec?

The module is pure geometry. It is used on true models after physics (the verdict), and on proposed scenes whose
footprints are estimated from partial clouds (a score for ranking). `structdiffusion.structures` defines the checks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.spec import StructureSpec
from structdiffusion.observation import Table
from structdiffusion.structures import OPEN_SHAPES, structure_named
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check


def check_structure(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    """Check everything that the spec specifies. With an open shape, check as the shape that passes the most.

    Args:
        bodies: the N objects that take part, at rest.
        spec: the requested structure.
        table: the table's rectangle.
    """
    if spec.shape is not None:
        return structure_named(spec.shape).check(bodies, spec, table)
    options = [
        structure.check(bodies, replace(spec, shape=structure.name), table)
        for structure in OPEN_SHAPES.values()
        if structure.can_carry(spec)
    ]
    return max(options, key=lambda checks: sum(check.passed for check in checks) / len(checks))

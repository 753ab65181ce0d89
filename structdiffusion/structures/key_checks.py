"""Check the keys of a structure that concern its own objects (evaluation protocol, part two)."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_LENGTH_OFF, MAX_RADIUS_OFF, max_gap_off
from structdiffusion.footprints import clear_gap
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check
from structdiffusion.structures.keys import StructureKeys
from structdiffusion.structures.sequences import order_checks


def check_keys(bodies: Sequence[PlacedBody], spec: StructureSpec, keys: StructureKeys) -> list[Check]:
    """Check order, gap, radius, length, rows and columns; `along` is a matter of the table and not checked here.

    Args:
        bodies: the N objects of the structure, at rest, in the order "listed".
        spec: the requested structure, with its shape.
        keys: the requested keys; `None` is not checked.

    Returns:
        The checks; of fewer objects than the structure needs, none, because `Structure.check` fails there.

    Raises:
        ValueError: for a spec without a shape.
    """
    if spec.shape is None:
        raise ValueError("a structure without a shape cannot have keys")
    structure = structure_named(spec.shape)
    if len(bodies) < structure.least:
        return []
    checks: list[Check] = []
    if keys.order is not None:
        checks += order_checks(bodies, structure.sequence(bodies), keys.order)
    if keys.gap is not None:
        gaps = [clear_gap(bodies[i].footprint, bodies[j].footprint) for i, j in structure.neighbours(bodies, spec)]
        off, limit = max((abs(gap - keys.gap) for gap in gaps), default=float("inf")), max_gap_off(keys.gap)
        checks.append(Check(f"clear gap off {keys.gap:.3g} (m)", off <= limit, off, f"<= {limit:.3f}"))
    for name, wanted, measured, limit in (
        ("radius", keys.radius, structure.radius, MAX_RADIUS_OFF),
        ("length", keys.length, structure.length, MAX_LENGTH_OFF),
    ):
        if wanted is not None:
            off = abs(measured(bodies) - wanted)
            checks.append(Check(f"{name} off {wanted:g} (m)", off <= limit, off, f"<= {limit:g}"))
    if keys.rows is not None or keys.columns is not None:
        found = structure.rows_and_columns(bodies)
        for name, wanted, count in zip(("rows", "columns"), (keys.rows, keys.columns), found):
            if wanted is not None:
                checks.append(Check(name, count == wanted, count, f"{wanted}"))
    return checks

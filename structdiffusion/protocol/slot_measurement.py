"""Measure which values of the five slots a structure realises, by the measures of the evaluation protocol.

The module is pure geometry, on estimated or true bodies. The measures are those of the checks of
`structdiffusion.structures`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grounding.spec import LEGAL_VALUES, StructureSpec
from structdiffusion.evaluation_protocol import SIZE_BANDS, X_POSITION_THIRDS, Y_POSITION_THIRDS
from structdiffusion.layouts import lay_out
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures import OPEN_SHAPES, structure_named
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import HEADING_MEASURE, PLACE_MEASURE, SIZE_MEASURE
from structdiffusion.structures.structure import LayoutError

_POSITIONS = {"x_position": X_POSITION_THIRDS, "y_position": Y_POSITION_THIRDS}
_FIT_ATTEMPTS = 10  # layouts tried before a value counts as one that does not fit


def realised_shape(bodies: Sequence[PlacedBody], table: Table) -> str:
    """Return the shape that an open shape became: the one whose checks hold best and, of equal ones, the one with most
    checks.

    Objects that have no place in a table setting do not form one, although they may pass its checks.
    """
    suited = [
        shape
        for shape, structure in OPEN_SHAPES.items()
        if structure.nouns is None or all(body.category in structure.nouns for body in bodies)
    ]

    def held(shape: str) -> tuple[float, int]:
        checks = check_structure(bodies, StructureSpec(shape), table)
        return sum(check.passed for check in checks) / len(checks), len(checks)

    return max(suited, key=held)


def realised_spec(bodies: Sequence[PlacedBody], table: Table, shape: str | None = None) -> StructureSpec:
    """Return the values that bodies realise; if none is met exactly, the nearest.

    Args:
        bodies: the N objects of the structure, world frame, metres.
        table: the table.
        shape: which shape they are measured as; by default `realised_shape`.

    Returns:
        A value for every slot that the shape can carry. `None` for what cannot be measured: the heading of a closed
        ring, or anything of a ring of two or of a setting without a base. A line faces "north" or "east",
        not the opposite.
    """
    shape = realised_shape(bodies, table) if shape is None else shape
    values: dict[str, str | None] = {}
    for slot in structure_named(shape).slots:
        measure = _rotation if slot == "rotation" else _size if slot == "size" else _position
        values[slot] = measure(bodies, table, shape, slot)
    return StructureSpec(shape, **values)


def distinct_values(shape: str | None, slot: str) -> tuple[str, ...]:
    """Return the values of a slot that can be distinguished in a structure of a shape."""
    return structure_named(shape).rotations if shape is not None and slot == "rotation" else LEGAL_VALUES[slot]


def fitting_values(
    items: Sequence[LayoutItem], spec: StructureSpec, slot: str, table: Table, rng: np.random.Generator
) -> tuple[str, ...]:
    """Return the values of an open slot for which the structure fits on the table.

    Args:
        items: the objects that take part.
        spec: the requested structure; other open slots may take any value.
        slot: the open slot.
        table: the table.
        rng: of the layouts that are tried.
    """

    def fits(value: str) -> bool:
        for _ in range(_FIT_ATTEMPTS):
            try:
                lay_out(items, replace(spec, **{slot: value}), table, rng)
                return True
            except LayoutError:
                continue
        return False

    legal = distinct_values(spec.shape, slot)
    if slot == "shape":
        legal = tuple(shape for shape, structure in OPEN_SHAPES.items() if structure.can_carry(spec))
    return tuple(value for value in legal if fits(value))


def evenness(values: Sequence[str], fits: Sequence[str]) -> float | None:
    """Return how evenly values are spread over those that fit: 0 if all are equal, on average 1 if all are equally
    likely.

    A few even draws rarely look even: their entropy is below that of the values they are drawn of, in the mean by
    a good deal (Miller, 1955), which is no fault of who drew them. Hence the mean entropy of as many even draws is the
    measure, and a lucky few may come out above 1.

    Args:
        values: the realised value of each sample; values that do not fit and `None` are not counted.
        fits: the different values that there may be.

    Returns:
        The entropy divided by that of the same number of even draws, or `None` if only one value fits.
    """
    values = [value for value in values if value in fits]
    if min(len(values), len(fits)) < 2:
        return None
    shares = np.array(list(Counter(values).values())) / len(values)
    return float(-(shares * np.log(shares)).sum()) / _entropy_of_even_draws(len(values), len(fits))


def _entropy_of_even_draws(draws: int, values: int) -> float:
    """Return the mean entropy, in nats, of the shares in `draws` independent draws of `values`
    equally likely values.
    """
    often = np.arange(1, draws + 1)  # how often one of the values is drawn: binomial
    ways = [math.lgamma(draws + 1) - math.lgamma(n + 1) - math.lgamma(draws - n + 1) for n in often]
    chances = np.exp(np.array(ways) - often * math.log(values) + (draws - often) * math.log1p(-1 / values))
    shares = often / draws
    return float(-values * (chances * shares * np.log(shares)).sum())


def _size(bodies: Sequence[PlacedBody], table: Table, shape: str, slot: str) -> str | None:
    ratio = _measure(bodies, StructureSpec(shape, size="small"), table, SIZE_MEASURE)
    if ratio is None:
        return None
    return next(size for size, (low, high) in SIZE_BANDS.items() if low <= ratio < high)


def _position(bodies: Sequence[PlacedBody], table: Table, shape: str, slot: str) -> str | None:
    names = _POSITIONS[slot]
    share = _measure(bodies, StructureSpec(shape, **{slot: names[-1]}), table, PLACE_MEASURE)
    return None if share is None else names[int(np.clip(3 * share, 0, 2))]


def _rotation(bodies: Sequence[PlacedBody], table: Table, shape: str, slot: str) -> str | None:
    if not structure_named(shape).has_heading(bodies):
        return None
    off: dict[str, float] = {}
    for rotation in distinct_values(shape, slot):
        degrees = _measure(bodies, StructureSpec(shape, rotation=rotation), table, HEADING_MEASURE)
        if degrees is not None:
            off[rotation] = degrees
    return min(off, key=off.__getitem__, default=None)


def _measure(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table, name: str) -> float | None:
    """Return the measurement of the named check; `None` if there are too few bodies for it."""
    checks = check_structure(bodies, spec, table)
    return next((check.measured for check in checks if name in check.name), None)

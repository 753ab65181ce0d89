"""Orders along a structure: by which measure objects follow one another, and from which end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from grounding.goals.parts import Order
from structdiffusion.evaluation_protocol import MAX_RELATION_OFF_DEGREES, ORDER_TIE
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check
from structdiffusion.structures.structure import LayoutError, a_structure

# The direction in the world frame in which each end of a flat structure lies.
DIRECTION_OF_START = {
    "left": np.array([0.0, 1.0]), "right": np.array([0.0, -1.0]), "far": np.array([1.0, 0.0]),
    "near": np.array([-1.0, 0.0]),
}  # fmt: skip


def measure(thing: LayoutItem | PlacedBody, by: str) -> float:
    """Return the height, the width or the cube root of the volume of an object, metres.

    Its width is the longer side of the tightest rectangle about its outline, its volume that of the upright prism over
    the outline, so that a mug is as large as a can of its size.
    """
    height = thing.height if isinstance(thing, LayoutItem) else thing.z_top - thing.z_bottom
    if by == "height":
        return float(height)
    if by == "width":
        return float(max(_tightest_box(thing.footprint)))
    return float(shapely.Polygon(thing.footprint).area * max(height, 0.0)) ** (1 / 3)


def _tightest_box(outline: np.ndarray) -> tuple[float, float]:
    """Return the sides (m) of the smallest rectangle about a convex outline (K, 2): one runs along one of its edges."""
    edges = np.roll(outline, -1, axis=0) - outline
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    axes = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    along = np.ptp(outline @ axes.T, axis=0)
    across = np.ptp(outline @ np.stack((-axes[:, 1], axes[:, 0])), axis=0)
    best = int((along * across).argmin())
    return float(along[best]), float(across[best])


@dataclass(frozen=True)
class Run:
    """How a line or an arc is laid for an order.

    Attributes:
        heading: that it faces, radians; from its first to its last place is to the right of that.
        sequence: item indices from the first place to the last.
    """

    heading: float
    sequence: tuple[int, ...]


def run_of(
    items: Sequence[LayoutItem],
    order: Order | None,
    heading: float,
    rotation: str | None,
    along: str | None,
    name: str,
    rng: np.random.Generator,
) -> Run:
    """Choose the heading of a line or an arc and which item takes which place.

    Args:
        items: the objects; "listed" is their order.
        order: the requested order, or `None`.
        heading: the one to face unless the order needs another, radians.
        rotation: the requested one; the heading then stays.
        along: the edge that the structure runs along; the heading then stays.
        name: of the structure, for messages.
        rng: of a direction that is left open.

    Raises:
        LayoutError: if the order begins at an end that the structure, facing as requested, does not have.
    """
    if order is None:
        return Run(heading, tuple(range(len(items))))
    sequence = sequence_by(items, order, rng)
    if order.start is None:
        return Run(heading, sequence)
    toward_start = DIRECTION_OF_START[order.start]
    if rotation is None and along is None:
        # To the right of the heading lies the last place: the start is to its left.
        return Run(math.atan2(-toward_start[0], toward_start[1]), sequence)
    # Left of the heading.
    left = float(np.array([-math.sin(heading), math.cos(heading)]) @ toward_start)
    if abs(left) < math.cos(math.radians(MAX_RELATION_OFF_DEGREES)):
        why = f"along the {along} edge" if along is not None else f"facing {rotation}"
        raise LayoutError(f"{a_structure(name)} {why} has no {order.start} end from which an order could begin")
    return Run(heading, sequence if left > 0 else sequence[::-1])


def sequence_by(items: Sequence[LayoutItem], order: Order, rng: np.random.Generator) -> tuple[int, ...]:
    """Return item indices from the end at which an order begins; if either end is possible, `rng` draws it."""
    if order.by == "listed":
        sequence = tuple(range(len(items)))
        return sequence[::-1] if order.direction == "descending" else sequence
    sequence = tuple(sorted(range(len(items)), key=lambda i: measure(items[i], order.by)))
    descending = order.direction == "descending" if order.direction else bool(rng.integers(2))
    return sequence[::-1] if descending else sequence


def order_checks(bodies: Sequence[PlacedBody], sequence: Sequence[int], order: Order) -> list[Check]:
    """Check that bodies follow one another in an order, from the end at which it begins.

    Args:
        bodies: in the order "listed".
        sequence: their indices along the structure, from one of its ends; of a tower, from the bottom.
        order: the requested order.
    """
    checks: list[Check] = []
    forward = [list(sequence), list(sequence)[::-1]]
    if order.start in ("bottom", "top"):
        forward = forward[:1] if order.start == "bottom" else forward[1:]
    elif order.start is not None:
        run = bodies[sequence[0]].centroid - bodies[sequence[-1]].centroid
        toward = float(run @ DIRECTION_OF_START[order.start]) / max(float(np.linalg.norm(run)), 1e-9)
        off, limit = math.degrees(math.acos(min(1.0, abs(toward)))), MAX_RELATION_OFF_DEGREES
        checks.append(Check(f"ends off the direction {order.start} (deg)", off <= limit, off, f"<= {limit:g}"))
        forward = forward[:1] if toward >= 0 else forward[1:]
    if order.by == "listed":
        ranks = [[-i for i in way] if order.direction == "descending" else way for way in forward]
        wrong = min(sum(a > b for a, b in zip(way, way[1:])) for way in ranks)
        return [*checks, Check("objects out of their order", wrong == 0, wrong, "0")]
    values = np.array([measure(body, order.by) for body in bodies])
    ways = [values[way] for way in forward]
    ways = [
        sign * way
        for way in ways
        for sign, direction in ((1, "ascending"), (-1, "descending"))
        if order.direction in (None, direction)
    ]
    # How much an earlier object exceeds a later one.
    worst = min(float((np.maximum.accumulate(way) - way).max()) for way in ways)
    return [*checks, Check(f"{order.by} out of order by (m)", worst <= ORDER_TIE, worst, f"<= {ORDER_TIE:g}")]

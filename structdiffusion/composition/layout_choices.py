"""Choose the open variables of a layout: its size, its heading, and the lowest object of a stack."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from grounding.goals.parts import Order, StructurePart, takes_key
from structdiffusion.composition.items import TableState
from structdiffusion.geometry import HEADING_OF_ROTATION
from structdiffusion.protocol.goal_keys import EDGE_AXES
from structdiffusion.structures import structure_named
from structdiffusion.structures.structure import LayoutError

_ORDERS = 18  # of a stack: the last of so many is among the less usual ones
_SIZES = (None, "medium", "small")  # of an open size, drawn in turn: a large structure may not fit


def in_another_order(part: StructurePart, state: TableState, number: int, rng: np.random.Generator) -> StructurePart:
    """Return the part, or every second time one of a stack with its objects in a less usual order.

    Hidden sides of the objects decide which order is stable.
    """
    if part.shape is None or part.order is not None or number % 2 == 0:
        return part
    structure = structure_named(part.shape)
    if not structure.stacks or not takes_key(structure.name, "order"):
        return part
    objects = part.indices
    items = [state.items[i].layout_item() for i in objects]
    random = np.tile(np.arange(len(objects)), (_ORDERS, 1))
    orders = structure.order_places(items, random, rng)
    chosen = random[0] if orders is None else orders[-1]
    return replace(part, objects=tuple(objects[i] for i in chosen), order=Order("listed", None, "bottom"))


def size_of(part: StructurePart, number: int) -> str | None:
    """Return the size of the next layout: an open one changes, unless a length says how large the structure is."""
    measured = part.gap is not None or part.radius is not None or part.length is not None
    sized = part.shape is not None and "size" in structure_named(part.shape).slots
    return part.size if part.size or measured or not sized else _SIZES[number % len(_SIZES)]


def heading_of(part: StructurePart, number: int, rng: np.random.Generator) -> float:
    """Return the heading (rad) that a structure faces: a line along an edge faces that edge or away from it.

    If it is open, every second one is aligned with the table, where more fits.
    """
    drawn = float(rng.uniform(-math.pi, math.pi)) if number % 2 else math.pi / 2 * float(rng.integers(4))
    headings = [HEADING_OF_ROTATION[part.rotation]] if part.rotation else [drawn]
    if part.along is not None:
        across = [0.0, math.pi] if EDGE_AXES[part.along][0] == 0 else [math.pi / 2, -math.pi / 2]
        if part.rotation and not any(math.isclose(math.cos(headings[0] - yaw), 1.0) for yaw in across):
            raise LayoutError(f"a line that faces {part.rotation} cannot run along the {part.along} edge")
        headings = headings if part.rotation else [across[int(rng.integers(2))]]
    return headings[0]

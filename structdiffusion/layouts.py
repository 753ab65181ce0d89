"""The geometric planner: exact layouts of structures on a table, from spec, footprints and table.

It draws the training and evaluation scenes, and is also a baseline. `structdiffusion.structures` defines what a
structure looks like, and which object takes which place. The structure frame has its origin at the structure's centre
on the table and +x along its heading.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import X_POSITION_THIRDS, Y_POSITION_THIRDS
from structdiffusion.footprints import centre_range, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, pose_from_xyz_yaw, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures import OPEN_SHAPES, structure_named
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.structure import LIFT, Draft, LayoutError, a_structure

# Where inside a third of the centre's range: away from its limits by this share of the third.
_THIRD_MARGIN = 0.15
# m: a third narrower than this is meaningless to a person, so a position in it counts as one that does not fit.
_NARROWEST_THIRD = 0.03
_EDGE_MARGIN = 0.005  # m, to the table's edge


class NoRoomError(LayoutError):
    """Raised if a structure is larger than the table.

    Attributes:
        excess: metres by which.
    """

    def __init__(self, message: str, excess: float) -> None:
        super().__init__(message)
        self.excess = excess


def nearest_to_fitting(reasons: Sequence[LayoutError]) -> LayoutError:
    """Return the reason of the layout that comes nearest to fitting, as it says what is missing at least; otherwise the
    first.
    """
    return min(reasons, key=lambda reason: reason.excess if isinstance(reason, NoRoomError) else math.inf)


@dataclass(frozen=True)
class Layout:
    """The poses of all objects of a structure.

    Attributes:
        spec: the spec of the layout: the requested one, with an open shape decided.
        order: (N,) item indices, place by place.
        positions: (N, 3) world x, y of each item's footprint centroid and z of its bottom, metres, by item.
        turns: (N,) rotation of each item about z relative to its present pose, radians, by item.
        world_from_structure: (4, 4) the structure frame.
    """

    spec: StructureSpec
    order: tuple[int, ...]
    positions: np.ndarray
    turns: np.ndarray
    world_from_structure: np.ndarray


def lay_out(
    items: Sequence[LayoutItem],
    spec: StructureSpec,
    table: Table,
    rng: np.random.Generator,
    keys: StructureKeys = NO_KEYS,
) -> Layout:
    """Draw an exact layout that satisfies the evaluation protocol. Open slots are drawn by `rng`.

    Args:
        items: the objects; the order "listed" is theirs.
        spec: the requested structure.
        table: the table.
        rng: of everything that is open.
        keys: further requirements; none for a spec without a shape.

    Raises:
        LayoutError: if the objects do not suit the structure, a key cannot be kept with them, or it does not fit on the
            table.
    """
    if spec.shape is None:
        return _lay_out_any_shape(items, spec, table, rng)
    heading = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else rng.uniform(-math.pi, math.pi)
    draft, centre = _placed_draft(items, spec, table, heading, rng, keys)
    positions, turns = np.zeros((len(items), 3)), np.zeros(len(items))
    for place, item in enumerate(draft.order):
        positions[item] = (*(centre + draft.offsets[place]), draft.heights[place] + LIFT)
        turns[item] = wrap_angle(draft.turns[place])
    frame = pose_from_xyz_yaw(centre[0], centre[1], 0.0, draft.heading)
    return Layout(spec, draft.order, positions, turns, frame)


def _placed_draft(
    items: Sequence[LayoutItem],
    spec: StructureSpec,
    table: Table,
    heading: float,
    rng: np.random.Generator,
    keys: StructureKeys,
) -> tuple[Draft, np.ndarray]:
    """Draw a structure and its centre (2,); if it does not fit and its size is open, try a smaller or a rotated one."""
    assert spec.shape is not None
    structure, reasons = structure_named(spec.shape), list[LayoutError]()
    smaller = structure.smaller_to_fit and spec.size is None and keys == NO_KEYS
    sizes = (None, "medium", "small") if smaller else (spec.size,)
    # What follows the table's edges fits more easily.
    headings = (heading,) if keys == NO_KEYS or spec.rotation else (heading, 0.0, math.pi / 2)
    for size, yaw in product(sizes, headings):
        try:
            draft = structure.draft(items, replace(spec, size=size) if size else spec, yaw, rng, keys)
            placed = zip(draft.order, draft.turns, draft.offsets)
            outlines = [turned(items[i].footprint, turn) + at for i, turn, at in placed]
            return draft, _place_centre(outlines, spec, table, rng)
        except LayoutError as error:
            reasons.append(error)
    raise nearest_to_fitting(reasons)


def _lay_out_any_shape(
    items: Sequence[LayoutItem], spec: StructureSpec, table: Table, rng: np.random.Generator
) -> Layout:
    reasons = []
    for shape in rng.permutation(list(OPEN_SHAPES)):
        if structure_named(str(shape)).can_carry(spec):
            try:
                return lay_out(items, replace(spec, shape=str(shape)), table, rng)
            except LayoutError as error:
                reasons.append(str(error))
    raise LayoutError("no shape can be built with these objects: " + "; ".join(reasons))


def _no_room(name: str, outlines: Sequence[np.ndarray], table: Table) -> NoRoomError:
    """Return the error of a structure that reaches beyond the table: in the direction in which it does so most."""
    extent = np.ptp(np.concatenate(outlines), axis=0)
    room = np.array([table.x_max - table.x_min, table.y_max - table.y_min])
    worst = int((extent - room).argmax())
    return NoRoomError(
        f"{name} of these objects is {extent[worst]:.2f} m {('deep', 'wide')[worst]}, "
        f"and the table has room for {room[worst]:.2f} m",
        float((extent - room)[worst]),
    )


def _place_centre(
    outlines: Sequence[np.ndarray], spec: StructureSpec, table: Table, rng: np.random.Generator
) -> np.ndarray:
    """Draw a centre (2,) in the thirds asked for, with everything on the table.

    Raises:
        LayoutError: if the structure is too large for the table.
    """
    inner = Table(
        table.x_min + _EDGE_MARGIN, table.x_max - _EDGE_MARGIN, table.y_min + _EDGE_MARGIN, table.y_max - _EDGE_MARGIN
    )
    name = a_structure(f"{spec.size} {spec.shape}" if spec.size else str(spec.shape))
    centre = np.zeros(2)
    for axis, value, names in (
        (0, spec.y_position, Y_POSITION_THIRDS),
        (1, spec.x_position, X_POSITION_THIRDS),
    ):
        low, high = centre_range(outlines, np.zeros(2), inner)[axis]
        if high <= low:
            raise _no_room(name, outlines, inner)
        if value is None:
            centre[axis] = rng.uniform(low, high)
            continue
        third = (high - low) / 3
        if third < _NARROWEST_THIRD:
            raise LayoutError(
                f"{name} of these objects fills so much of the table that {value!r} has no meaning: "
                f"its centre can move by only {high - low:.3f} m"
            )
        start = low + names.index(value) * third
        centre[axis] = rng.uniform(start + _THIRD_MARGIN * third, start + (1 - _THIRD_MARGIN) * third)
    return centre

"""The geometric planner: exact layouts of the four structures, from spec, footprints and table.

It draws the training and evaluation scenes, and is a baseline by itself. Object i takes place i:
around the ring counter-clockwise from the opening, along the line from the left of its heading to
the right, up the tower. The structure frame has its origin at the structure's centre on the table
and +x along its heading.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grounding.spec import SHAPES, SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.footprints import (
    CLEARANCE,
    centre_range,
    clear_gap,
    separation_along,
    tightest_ring_radius,
    turned,
)
from structdiffusion.geometry import HEADING_OF_ROTATION, pose_from_xyz_yaw, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.tableware import BASES, CUTLERY, DRINKWARE

# Extent over tightest extent is drawn well inside the contract's bands, so that small errors of
# measurement or placement do not leave them.
_RATIO = {"small": (1.03, 1.2), "medium": (1.42, 1.68), "large": (1.95, 2.3)}
# The opening of a ring that faces somewhere, over its other gaps: inside the contract's 1.5 to 3.
_OPENING = (1.9, 2.4)
# Longer than this (length over width), an object is turned to stand across the line, or along the ring's radius.
_ELONGATED = 1.6
# Where inside a third of the centre's range: away from its limits by this share of the third.
_THIRD_MARGIN = 0.15
# A third narrower than this, metres, means nothing to a person: such a wish counts as one that does not fit.
_NARROWEST_THIRD = 0.03
_EDGE_MARGIN = 0.005  # m, to the table's edge
_LIFT = 0.0005  # m, so that touching surfaces do not start inside each other


class LayoutError(ValueError):
    """These objects cannot make this structure on this table; the message says why."""


@dataclass(frozen=True)
class LayoutItem:
    """What the planner has to know of an object, as it stands now.

    Attributes:
        category: its noun.
        footprint: (K, 2) convex outline about the footprint's centroid, turned as it stands in the world, metres.
        height: metres.
        front_yaw: the world heading of its front as it stands, radians.
        stackable: whether something can stand on it.
        flat_bottom: whether it can stand on something.
    """

    category: str
    footprint: np.ndarray
    height: float
    front_yaw: float = 0.0
    stackable: bool = True
    flat_bottom: bool = True


@dataclass(frozen=True)
class Layout:
    """Where everything goes.

    Attributes:
        spec: what was built: the wish with its open shape decided.
        order: (N,) item indices, place by place.
        positions: (N, 3) world x, y of each item's footprint centroid and z of its bottom, metres, by item.
        turns: (N,) how far each item is turned about z from how it stands now, radians, by item.
        world_from_structure: (4, 4) the structure frame.
    """

    spec: StructureSpec
    order: tuple[int, ...]
    positions: np.ndarray
    turns: np.ndarray
    world_from_structure: np.ndarray


@dataclass(frozen=True)
class _Draft:
    """A structure about its own centre, heading included, not yet put on the table."""

    order: tuple[int, ...]
    offsets: np.ndarray  # (N, 2) by place
    heights: np.ndarray  # (N,) z of the bottoms, by place
    turns: np.ndarray  # (N,) by place
    heading: float


def lay_out(items: Sequence[LayoutItem], spec: StructureSpec, table: Table, rng: np.random.Generator) -> Layout:
    """An exact layout that satisfies the contract. Open slots are drawn by `rng`.

    Raises:
        LayoutError: when the objects do not suit the structure, or it does not fit on the table.
    """
    if spec.shape is None:
        return _lay_out_any_shape(items, spec, table, rng)
    heading = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else rng.uniform(-math.pi, math.pi)
    draft = _DRAFTS[spec.shape](items, spec, heading, rng)
    outlines = [turned(items[i].footprint, turn) + at for i, turn, at in zip(draft.order, draft.turns, draft.offsets)]
    centre = _place_centre(outlines, spec, table, rng)
    positions, turns = np.zeros((len(items), 3)), np.zeros(len(items))
    for place, item in enumerate(draft.order):
        positions[item] = (*(centre + draft.offsets[place]), draft.heights[place] + _LIFT)
        turns[item] = wrap_angle(draft.turns[place])
    frame = pose_from_xyz_yaw(*centre, 0.0, draft.heading)
    return Layout(spec, draft.order, positions, turns, frame)


def _lay_out_any_shape(
    items: Sequence[LayoutItem], spec: StructureSpec, table: Table, rng: np.random.Generator
) -> Layout:
    reasons = []
    for shape in rng.permutation(SHAPES):
        if all(slot in SLOTS_OF_SHAPE[str(shape)] for slot, _ in spec.tokens()):
            try:
                return lay_out(items, replace(spec, shape=str(shape)), table, rng)
            except LayoutError as error:
                reasons.append(str(error))
    raise LayoutError("no shape can be built with these objects: " + "; ".join(reasons))


def _ratio(spec: StructureSpec, rng: np.random.Generator) -> float:
    return float(rng.uniform(*_RATIO[spec.size or str(rng.choice(list(_RATIO)))]))


def _alignment(item: LayoutItem, axis_yaw: float) -> float:
    """The turn that brings a long object's axis to `axis_yaw` the short way round; 0 for a compact one."""
    centred = item.footprint - item.footprint.mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred)
    long_axis = vectors[:, 1]
    shadows = item.footprint @ vectors
    width, length = np.ptp(shadows, axis=0)
    if length < _ELONGATED * width or values[1] <= 0:
        return 0.0
    turn = wrap_angle(axis_yaw - math.atan2(long_axis[1], long_axis[0]))
    return turn - math.copysign(math.pi, turn) if abs(turn) > math.pi / 2 else turn


def _draft_circle(
    items: Sequence[LayoutItem], spec: StructureSpec, heading: float, rng: np.random.Generator
) -> _Draft:
    if len(items) < 3:
        raise LayoutError(f"a circle needs 3 or more objects, got {len(items)}")
    count = len(items)
    opening = rng.uniform(*_OPENING) if spec.rotation else 1.0
    gap = 2 * math.pi / (count - 1 + opening)
    angles = heading + opening * gap / 2 + gap * np.arange(count)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    turns = np.array([_alignment(item, angle) for item, angle in zip(items, angles)])
    outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
    radius = _ratio(spec, rng) * tightest_ring_radius(outlines, directions)
    return _Draft(tuple(range(count)), radius * directions, np.zeros(count), turns, heading)


def _draft_line(items: Sequence[LayoutItem], spec: StructureSpec, heading: float, rng: np.random.Generator) -> _Draft:
    if len(items) < 2:
        raise LayoutError(f"a line needs 2 or more objects, got {len(items)}")
    direction = np.array([math.sin(heading), -math.cos(heading)])  # to the right of the heading
    turns = np.array([_alignment(item, heading) for item in items])
    outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
    tight = np.array([separation_along(a, b, direction) for a, b in zip(outlines, outlines[1:])])
    # Every gap grows by the same length, so that the clear gaps stay even.
    spread = (_ratio(spec, rng) - 1) * tight.sum() / len(tight)
    along = np.concatenate(([0.0], np.cumsum(tight + spread)))
    along -= along[-1] / 2
    return _Draft(tuple(range(len(items))), along[:, None] * direction, np.zeros(len(items)), turns, heading)


def tower_order(
    items: Sequence[LayoutItem], rng: np.random.Generator | None = None, blur: float = 0.1
) -> tuple[int, ...]:
    """Items from the bottom up: what carries first, the larger footprint first.

    With `rng`, sizes are blurred by about this share, so that near-equal objects come in any order.
    """

    def key(index: int) -> tuple[int, float]:
        item = items[index]
        area = float(np.prod(np.ptp(item.footprint, axis=0)))
        factor = math.exp(blur * rng.standard_normal()) if rng is not None else 1.0
        return (not item.stackable, -area * factor)

    return tuple(sorted(range(len(items)), key=key))


def _draft_tower(items: Sequence[LayoutItem], spec: StructureSpec, heading: float, rng: np.random.Generator) -> _Draft:
    if len(items) < 2:
        raise LayoutError(f"a tower needs 2 or more objects, got {len(items)}")
    order = tower_order(items, rng)
    if not all(items[i].stackable for i in order[:-1]):
        raise LayoutError("a tower needs objects that others can stand on; only the top one may be round or pointed")
    if not all(items[i].flat_bottom for i in order[1:]):
        raise LayoutError("a tower needs objects with a level bottom above its lowest")
    heights = np.concatenate(([0.0], np.cumsum([items[i].height + _LIFT for i in order[:-1]])))
    turns = np.zeros(len(items))
    # A tower faces nowhere: its frame is the world's.
    return _Draft(order, np.zeros((len(items), 2)), heights, turns, 0.0)


def setting_base(items: Sequence[LayoutItem]) -> int:
    """The item that a table setting is laid around: a plate, else a bowl; with neither, the broadest thing."""
    bases = [i for noun in BASES for i, item in enumerate(items) if item.category == noun]
    return bases[0] if bases else max(range(len(items)), key=lambda i: np.ptp(items[i].footprint, axis=0).min())


def _draft_table_setting(
    items: Sequence[LayoutItem], spec: StructureSpec, heading: float, rng: np.random.Generator
) -> _Draft:
    """In the diner's view: +x of the structure frame is toward the diner, so away is -x and left is -y."""
    base = setting_base(items)
    if items[base].category not in BASES or len(items) < 2:
        raise LayoutError("a table setting needs a plate or bowl and at least one thing beside it")
    away, left = -np.array([math.cos(heading), math.sin(heading)]), np.array([math.sin(heading), -math.cos(heading)])
    turns, offsets = np.zeros(len(items)), np.zeros((len(items), 2))
    placed = [items[base].footprint]

    def put(index: int, position: np.ndarray, push: np.ndarray) -> None:
        """Place an item, pushed on in 5 mm steps until it clears what is there."""
        outline = turned(items[index].footprint, turns[index])
        while any(clear_gap(outline + position, other) < CLEARANCE for other in placed):
            position = position + 0.005 * push
        offsets[index] = position
        placed.append(outline + position)

    reach = {1: float((items[base].footprint @ left).max()), -1: -float((items[base].footprint @ left).min())}
    for noun in CUTLERY:
        side = 1 if noun == "fork" else -1
        for index in (i for i, item in enumerate(items) if item.category == noun):
            turns[index] = wrap_angle(math.atan2(away[1], away[0]) - items[index].front_yaw)
            width = np.ptp(turned(items[index].footprint, turns[index]) @ left)
            distance = reach[side] + rng.uniform(0.012, 0.022) + width / 2
            put(index, side * distance * left + rng.uniform(-0.01, 0.01) * away, side * left)
            reach[side] = abs(float(offsets[index] @ left)) + width / 2
    back = float((items[base].footprint @ away).max())
    for index, item in enumerate(items):
        if index == base or item.category in CUTLERY:
            continue
        if item.category not in DRINKWARE + BASES:
            raise LayoutError(
                f"a table setting takes plate, bowl, fork, knife, spoon, cup and mug, not a {item.category}"
            )
        side = -1 if item.category in DRINKWARE else 1
        radius = 0.5 * float(np.ptp(item.footprint, axis=0).max())
        start = 0.75 * (back + radius) * away + side * 0.75 * (back + radius) * left
        put(index, start, away)
    order = [base] + [i for i in range(len(items)) if i != base]
    return _Draft(tuple(order), offsets[order], np.zeros(len(items)), turns[order], heading)


def _place_centre(
    outlines: Sequence[np.ndarray], spec: StructureSpec, table: Table, rng: np.random.Generator
) -> np.ndarray:
    """A centre (2,) in the thirds asked for, with everything on the table.

    Raises:
        LayoutError: when the structure is too large for the table.
    """
    inner = Table(
        table.x_min + _EDGE_MARGIN, table.x_max - _EDGE_MARGIN, table.y_min + _EDGE_MARGIN, table.y_max - _EDGE_MARGIN
    )
    centre = np.zeros(2)
    for axis, value, names in (
        (0, spec.y_position, ("bottom", "middle", "top")),
        (1, spec.x_position, ("right", "center", "left")),
    ):
        low, high = centre_range(outlines, np.zeros(2), inner)[axis]
        if high <= low:
            side = "deep" if axis == 0 else "wide"
            extent = np.ptp(np.concatenate(outlines)[:, axis])
            room = (table.x_max - table.x_min, table.y_max - table.y_min)[axis]
            raise LayoutError(
                f"a {spec.size + ' ' if spec.size else ''}{spec.shape} of these objects is {extent:.2f} m {side}, "
                f"and the table only {room:.2f} m"
            )
        if value is None:
            centre[axis] = rng.uniform(low, high)
            continue
        third = (high - low) / 3
        if third < _NARROWEST_THIRD:
            raise LayoutError(
                f"a {spec.size + ' ' if spec.size else ''}{spec.shape} of these objects fills the table so far that "
                f"{value!r} means nothing: its centre can move by {high - low:.3f} m only"
            )
        start = low + names.index(value) * third
        centre[axis] = rng.uniform(start + _THIRD_MARGIN * third, start + (1 - _THIRD_MARGIN) * third)
    return centre


_DRAFTS = {
    "circle": _draft_circle,
    "line": _draft_line,
    "tower": _draft_tower,
    "table setting": _draft_table_setting,
}

"""The upright figure: objects that stand on each other as its blocks do, in a wall across its heading.

Places are those of `Figure.blocks_of`: level by level from the bottom, from the reader's left to the right.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from grounding.figures.figure import Figure
from grounding.figures.growth import Blocks, levels_of, supports_of
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_FIGURE_OFF_DEGREES, MAX_OFF_LINE, ORDER_TIE
from structdiffusion.figures.blocks import places_along
from structdiffusion.footprints import turned
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, ObjectTraits, PlacedBody
from structdiffusion.structures.checks import HEADING_MEASURE, Check, position_checks
from structdiffusion.structures.flat_figure import count_check, require_legal
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.pyramid import carries_in_walls, flush_turn
from structdiffusion.structures.sequences import measure
from structdiffusion.structures.structure import (
    LIFT,
    STANDING,
    TALLEST,
    Draft,
    LayoutError,
    Structure,
    Traits,
    a_structure,
)

# Degrees by which an object may lean that lies on several of different heights, as in a pyramid.
_LEAN = math.tan(math.radians(3.0))
_NARROWEST_OF = 4  # drawn objects for what carries, so that something can bridge it
_BROADER = 1.15  # times the radius of the rest, that what bridges has where there is such an object
_TRIES = 24  # ways to share the objects out that are tried


class UprightFigure(Structure):
    """Blocks on blocks.

    Args:
        figure: that they show.
    """

    stacks = True
    exact_count = False
    requirement = f"{STANDING}, able to carry, not slender, and neither cutlery nor a plate or bowl"

    def __init__(self, figure: Figure) -> None:
        self.figure, self.name, self.least = figure, figure.name, figure.legal[0]
        few = [count for count in figure.legal if count <= max(figure.legal[0], 7)]
        self.usual_counts = (few[0], few[-1])

    def suits(self, thing: ObjectTraits) -> bool:
        """Return whether an object stands, carries and is low, as in a pyramid."""
        return super().suits(thing) and carries_in_walls(thing)

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose objects of about one size, and the broadest of about that height for what bridges.

        Raises:
            LayoutError: if there are too few.
        """
        counts = [count for count in self.figure.legal if count <= max(wanted, self.least)]
        wanted = counts[-1]
        if len(candidates) < wanted:
            raise LayoutError(
                f"{a_structure(self.name)} needs {wanted} objects, but only {len(candidates)} can be used"
            )
        bridges = sum(block.width > 1 for block in self.figure.blocks_of(wanted)[0])
        nouns = Counter(one.category for one in candidates)
        enough = [one for one in candidates if nouns[one.category] >= wanted] or list(candidates)
        first = min(enough[: _NARROWEST_OF if bridges else 1], key=lambda one: one.radius)
        alike = sorted(candidates, key=lambda one: abs(one.height - first.height) + abs(one.radius - first.radius))
        usual, others = alike[: wanted - bridges], alike[wanted - bridges :]
        broad = [one for one in others if one.radius >= _BROADER * max(each.radius for each in usual)]
        broad.sort(key=lambda one: -one.radius)
        return [*usual, *[*broad, *(one for one in others if one not in broad)][:bridges]]

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw the figure; without a rotation its reader is on the robot's side.

        Raises:
            LayoutError: for a number of objects that cannot show it, or objects that cannot carry each other so.
        """
        require_legal(self.figure, len(items))
        facing = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else math.pi
        right = facing + math.pi / 2  # the reader looks against the heading
        reason: LayoutError | None = None
        for number in range(_TRIES):
            for blocks in self.figure.blocks_of(len(items)):
                try:
                    return self._drafted(items, blocks, right, facing, number, rng)
                except LayoutError as error:
                    reason = reason or error
        assert reason is not None
        raise reason

    def _drafted(
        self,
        items: Sequence[LayoutItem],
        blocks: Blocks,
        right: float,
        facing: float,
        number: int,
        rng: np.random.Generator,
    ) -> Draft:
        """Draw one way of sharing the objects out among the blocks."""
        order = _shared_out(items, blocks, number, rng)
        if order is None:
            raise LayoutError(
                f"{a_structure(self.name)} needs objects of one height side by side below what bridges them; these are "
                f"{', '.join(f'{item.category} {item.height:.3f} m' for item in items)}"
            )
        direction = np.array([math.cos(right), math.sin(right)])
        turns = np.array([flush_turn(items[i].footprint, right) for i in order])
        outlines = [turned(items[i].footprint, turn) for i, turn in zip(order, turns)]
        low = np.array([float((outline @ direction).min()) for outline in outlines])
        high = np.array([float((outline @ direction).max()) for outline in outlines])
        middles = places_along(blocks, (high - low).tolist())
        if middles is None:
            raise LayoutError(f"what bridges {a_structure(self.name)} is too short or too wide to lie on its supports")
        heights: list[float] = []
        for own in supports_of(blocks):
            tops = [heights[k] + items[order[k]].height + LIFT for k in own]
            if tops and max(tops) - min(tops) > _LEAN * abs(np.ptp(middles[list(own)])):
                raise LayoutError(f"what carries an object of {a_structure(self.name)} is not level")
            heights.append(max(tops, default=0.0))
        if max(heights) > TALLEST:
            raise LayoutError(
                f"{a_structure(self.name)} of these objects would be built up to {max(heights):.2f} m, and the arm "
                f"reaches {TALLEST} m"
            )
        along = middles - (low + high) / 2
        base = [k for k, block in enumerate(blocks) if not block.level]
        offsets = (along - along[base].mean())[:, None] * direction
        return Draft(tuple(order), offsets, np.array(heights), turns, facing)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check who rests on whom, that the wall is straight, what bridges, heading and place."""
        checks = [count_check(self.figure, len(bodies))]
        if not checks[0].passed:
            return checks
        points = np.array([body.centroid for body in bodies])
        direction, across = _axis(points, bodies)
        facing = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else math.pi
        right = facing + math.pi / 2
        if direction @ (math.cos(right), math.sin(right)) < 0:
            direction = -direction
        signs = (1,) if spec.rotation is not None else (1, -1)
        wrong, order, blocks = min(
            (
                _differing(bodies, blocks, sign * points @ direction)
                for blocks in self.figure.blocks_of(len(bodies))
                for sign in signs
            ),
            key=lambda found: found[0],
        )
        checks.append(Check("objects that rest on others than drawn", wrong == 0, wrong, "0"))
        worst = float(np.abs(across).max())
        checks.append(Check("distance to the wall's line (m)", worst <= MAX_OFF_LINE, worst, f"<= {MAX_OFF_LINE:.3f}"))
        if not wrong:
            checks += _bridge_checks(bodies, order, blocks)
        if spec.rotation is not None:
            degrees = abs(math.degrees(wrap_angle(math.atan2(direction[1], direction[0]) - right)))
            limit = MAX_FIGURE_OFF_DEGREES
            checks.append(Check(f"{HEADING_MEASURE} (deg off)", degrees <= limit, degrees, f"<= {limit:g}"))
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the mean (2,) of what stands on the table."""
        low = [body.centroid for body in bodies if not body.rests_on] or [body.centroid for body in bodies]
        return np.array(low).mean(axis=0)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether so many objects can show it."""
        return len(bodies) in self.figure.legal

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices from the bottom."""
        return sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)


def _axis(points: np.ndarray, bodies: Sequence[PlacedBody]) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction (2,) of the wall, and how far (N,) each object is off its line, metres."""
    middle = points.mean(axis=0)
    _, lengths, axes = np.linalg.svd(points - middle)
    if lengths[0] < MAX_OFF_LINE:  # a single column: along the broadest object
        outline = max((body.footprint for body in bodies), key=lambda one: float(np.ptp(one, axis=0).max()))
        axes = np.linalg.svd(outline - outline.mean(axis=0))[2]
    return axes[0], (points - middle) @ np.array([-axes[0][1], axes[0][0]])


def _differing(bodies: Sequence[PlacedBody], blocks: Blocks, along: np.ndarray) -> tuple[int, list[int], Blocks]:
    """Return how many objects rest on others than their blocks do, the object of each block, and the blocks.

    Args:
        bodies: as many as blocks.
        blocks: the drawing.
        along: (N,) where the objects are along the wall.
    """
    level: dict[int, int] = {}
    for i in sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom):
        level[i] = 1 + max((level.get(j, 0) for j in bodies[i].rests_on), default=-1)
    order: list[int] = []
    for number, row in enumerate(levels_of(blocks)):
        own = sorted((i for i in level if level[i] == number), key=lambda i: along[i])
        if len(own) != len(row):
            return len(bodies), [], blocks
        order += own
    carriers = supports_of(blocks)
    wrong = sum({order[k] for k in own} != set(bodies[i].rests_on) for i, own in zip(order, carriers))
    return wrong, order, blocks


def _bridge_checks(bodies: Sequence[PlacedBody], order: Sequence[int], blocks: Blocks) -> list[Check]:
    """Check that what bridges is the longest."""
    lengths = [measure(bodies[i], "width") for i in order]
    bridging = [length for length, block in zip(lengths, blocks) if block.width > 1]
    others = [length for length, block in zip(lengths, blocks) if block.width <= 1]
    if not bridging or not others:
        return []
    short = max(others) - min(bridging)
    return [Check("what bridges shorter than the rest (m)", short <= ORDER_TIE, short, f"<= {ORDER_TIE:g}")]


def _shared_out(items: Sequence[LayoutItem], blocks: Blocks, number: int, rng: np.random.Generator) -> list[int] | None:
    """Return the item on each block: the longest bridge, and what stands below one bridge is level; `None` if none is.

    Args:
        items: as many as blocks.
        blocks: the drawing.
        number: of the try; the first takes the lowest level of the broadest objects, later ones draw.
        rng: of later tries.
    """
    lengths = np.array([measure(item, "width") for item in items])
    bridging = [k for k, block in enumerate(blocks) if block.width > 1]
    given: dict[int, int] = dict(zip(bridging, np.argsort(-lengths, kind="stable").tolist()))
    left = [i for i in range(len(items)) if i not in given.values()]
    for group in sorted(_level_groups(blocks, bridging), key=lambda own: (blocks[own[0]].level, -len(own))):
        carrying = any(set(group) & set(own) for own in supports_of(blocks))
        able = [i for i in left if items[i].stackable or not carrying]
        able.sort(key=lambda i: items[i].height)
        starts = range(len(able) - len(group) + 1)
        windows = [able[start : start + len(group)] for start in starts]
        if not windows:
            return None
        rises = [items[own[-1]].height - items[own[0]].height for own in windows]
        allowed = max(min(rises) + 1e-6, 0.002)
        level = [own for own, rise in zip(windows, rises) if rise <= allowed]
        broadest = sorted(level, key=lambda own: -float(lengths[own].sum()))
        chosen = broadest[0] if number == 0 else broadest[int(rng.integers(len(broadest)))]
        chosen = [chosen[i] for i in rng.permutation(len(chosen))] if number else chosen
        given |= dict(zip(group, chosen))
        left = [i for i in left if i not in chosen]
    return [given[k] for k in range(len(blocks))]


def _level_groups(blocks: Blocks, bridging: Sequence[int]) -> list[list[int]]:
    """Return the blocks, without those that bridge, in groups that should be level:
    each level of each standing part.
    """
    carriers = supports_of(blocks)
    part = list(range(len(blocks)))
    for k, own in enumerate(carriers):
        for one in own:
            joined = {part[k], part[one]}
            part = [min(joined) if each in joined else each for each in part]
    groups: dict[tuple[int, int], list[int]] = {}
    for k, block in enumerate(blocks):
        if k not in bridging:
            groups.setdefault((block.level, part[k]), []).append(k)
    return list(groups.values())

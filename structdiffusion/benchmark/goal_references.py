"""Find a reference arrangement of a goal: evidence that the goal can be met with these objects on this table.

It is a search by rejection on the true models, apart from the planners: structures are drafted by their own modules,
everything else is drawn beside what stands already. The evaluation protocol judges what is found
(`structdiffusion.benchmark.goals`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, PartReference, RelationPart, StructurePart
from structdiffusion.benchmark.goal_families import color_of, measure
from structdiffusion.data.scene_sampling import layout_item
from structdiffusion.evaluation_protocol import (
    CLEARANCE,
    MAX_ALONG_DISTANCE,
    MIN_GROUP_GAP,
    X_POSITION_THIRDS,
    Y_POSITION_THIRDS,
)
from structdiffusion.footprints import centre_range, clear_gap, outline_centroid, separation_along, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.keys import StructureKeys
from structdiffusion.structures.structure import LIFT, Draft, LayoutError

_TRIES = 60  # places, or drafts, before a part counts as one that cannot be placed here
_MARGIN = 0.15  # of a third of the table that positions keep clear of
_EDGE = 0.005  # m, to the table's edge
_DIRECTIONS: Mapping[str, float] = {
    "left of": math.pi / 2, "right of": -math.pi / 2, "behind": 0.0, "in front of": math.pi,
    "left": math.pi / 2, "right": -math.pi / 2, "away": 0.0, "closer": math.pi,
}  # fmt: skip
_OFF_DIRECTION = math.radians(30)  # where the evaluation protocol allows 45
_SIDE_GAPS, _NEAR_GAPS = (0.015, 0.10), (0.012, 0.06)  # m, where the protocol allows 25 and 8 cm
_DEEPER = 0.004  # m: step of the search for the floor of a hollow object


class NoReferenceError(ValueError):
    """Raised if no reference arrangement is found; the message says for which part."""


class ReferenceSearch:
    """Search a reference arrangement.

    Args:
        models: the N objects.
        world_from_initial: (N, 4, 4) their poses.
        goal: with indices into them.
        table: the table top.
        rng: of everything that is drawn.
    """

    def __init__(
        self,
        models: Sequence[ObjectModel],
        world_from_initial: np.ndarray,
        goal: Goal,
        table: Table,
        rng: np.random.Generator,
    ) -> None:
        self._models, self._initial, self._table, self._rng = models, world_from_initial, table, rng
        self._goal = goal.resolved(len(models))
        self._yaws = [math.atan2(pose[1, 0], pose[0, 0]) for pose in world_from_initial]
        self._poses: dict[int, np.ndarray] = {}  # of what has been placed
        self._outlines: dict[
            int, np.ndarray
        ] = {}  # (K, 2), world frame, of what stands: what stays, and what is placed

    def motions(self) -> np.ndarray:
        """Return the motions (N, 4, 4) of a reference arrangement; the identity for what stays.

        Raises:
            NoReferenceError: if none is found.
        """
        moved = {index for part in self._goal.parts for index in self._members(part.objects)}
        for index in set(range(len(self._models))) - moved:
            self._outlines[index] = self._outline(index, self._initial[index])
        for number, part in enumerate(self._goal.parts):
            if isinstance(part, StructurePart):
                self._place_structure(number, part)
        waiting = [part for part in self._goal.relations if not isinstance(part.objects, PartReference)]
        while waiting:
            ready = [part for part in waiting if set(self._members(part.reference)) <= self._outlines.keys()]
            if not ready:
                raise NoReferenceError("relations in a circle")
            self._place_related(ready[0])
            waiting.remove(ready[0])
        still = np.eye(4)
        return np.array([
            self._poses[i] @ np.linalg.inv(self._initial[i]) if i in self._poses else still
            for i in range(len(self._models))
        ])  # fmt: skip

    # --- structures -------------------------------------------------------------------------------

    def _place_structure(self, number: int, part: StructurePart) -> None:
        if part.group_by is not None:
            groups: dict[str, list[int]] = {}
            for index in self._members(part.objects):
                model = self._models[index]
                groups.setdefault(color_of(model) if part.group_by == "colour" else model.category, []).append(index)
            placed: list[int] = []
            for members in groups.values():
                one = replace(part, group_by=None, objects=tuple(members))
                self._try(lambda one=one, apart=tuple(placed): self._draft_somewhere(one, None, apart), "a group")
                placed += members
            return
        bound = next(
            (r for r in self._goal.relations if isinstance(r.objects, PartReference) and r.objects.part == number), None
        )
        self._try(lambda: self._draft_somewhere(part, bound, ()), f"the {part.shape}")

    def _draft_somewhere(self, part: StructurePart, bound: RelationPart | None, apart: Sequence[int]) -> bool:
        """Draft a structure and put it somewhere; tell whether it fits there.

        Args:
            part: the structure.
            bound: a relation that it must stand in as a whole.
            apart: objects of other groups, from which it keeps their distance.
        """
        members, order = list(self._members(part.objects)), part.order
        if order is not None and order.by != "listed":
            members.sort(key=lambda i: measure(self._models[i], order.by), reverse=order.direction == "descending")
        if order is not None and order.start in ("right", "far", "top"):
            members.reverse()
        items = [layout_item(self._models[i], self._yaws[i]) for i in members]
        try:
            draft = self._draft(items, part)
        except LayoutError:
            return False
        outlines = [
            turned(items[i].footprint, turn) + at for i, turn, at in zip(draft.order, draft.turns, draft.offsets)
        ]
        centre = self._centre(outlines, part)
        if centre is None:
            return False
        placed = {members[item]: outline + centre for item, outline in zip(draft.order, outlines)}
        if bound is not None and not self._stands_as(bound, np.concatenate(list(placed.values()))):
            return False
        if not all(self._is_free(outline, apart) for outline in placed.values()):
            return False
        for place, item in enumerate(draft.order):
            index = members[item]
            x, y = centre + draft.offsets[place]
            self._put(
                index, pose_from_xyz_yaw(x, y, draft.heights[place] + LIFT, self._yaws[index] + draft.turns[place])
            )
        return True

    def _draft(self, items: Sequence[LayoutItem], part: StructurePart) -> Draft:
        if part.order is not None and part.shape == "tower":
            if not (all(item.stackable for item in items[:-1]) and all(item.flat_bottom for item in items[1:])):
                raise LayoutError("these objects cannot stand on one another in this order")
            heights = np.concatenate(([0.0], np.cumsum([item.height + LIFT for item in items[:-1]])))
            return Draft(tuple(range(len(items))), np.zeros((len(items), 2)), heights, np.zeros(len(items)), 0.0)
        spec = part.spec
        heading = HEADING_OF_ROTATION[spec.rotation] if spec.rotation else float(self._rng.uniform(-math.pi, math.pi))
        # The first place of a line is on the left of its heading.
        if part.along in ("near", "far") or (part.order is not None and part.order.start in ("left", "right")):
            heading = 0.0
        elif part.along is not None or (part.order is not None and part.order.start in ("near", "far")):
            heading = math.pi / 2
        keys = StructureKeys(None, part.gap, part.radius, part.length, part.rows, part.columns)
        return structure_named(part.shape or "").draft(items, spec, heading, self._rng, keys)

    def _centre(self, outlines: Sequence[np.ndarray], part: StructurePart) -> np.ndarray | None:
        """Draw the centre (2,) of a structure on the table; `None` if it does not fit."""
        if part.around is not None:
            return outline_centroid(self._outlines[part.around[0]])  # type: ignore[index]
        table = self._table
        inner = Table(table.x_min + _EDGE, table.x_max - _EDGE, table.y_min + _EDGE, table.y_max - _EDGE)
        ranges = centre_range(outlines, np.zeros(2), inner)
        if (ranges[:, 1] <= ranges[:, 0]).any():
            return None
        for axis, value, names in ((0, part.y_position, Y_POSITION_THIRDS), (1, part.x_position, X_POSITION_THIRDS)):
            if value is not None:
                low, third = ranges[axis, 0], (ranges[axis, 1] - ranges[axis, 0]) / 3
                start = low + names.index(value) * third
                ranges[axis] = start + _MARGIN * third, start + (1 - _MARGIN) * third
        if part.along is not None:
            axis, low_end = {"near": (0, True), "far": (0, False), "right": (1, True), "left": (1, False)}[part.along]
            strip = 0.2 * MAX_ALONG_DISTANCE
            if low_end:
                ranges[axis, 1] = min(ranges[axis, 1], ranges[axis, 0] + strip)
            else:
                ranges[axis, 0] = max(ranges[axis, 0], ranges[axis, 1] - strip)
        return self._rng.uniform(ranges[:, 0], ranges[:, 1])

    def _stands_as(self, relation: RelationPart, points: np.ndarray) -> bool:
        """Tell whether a structure's corners (P, 2) stand as a whole in a relation to what stands already."""
        outline = points[ConvexHull(points).vertices]
        reference = self._hull(self._members(relation.reference))
        gap = clear_gap(outline, reference)
        low, high = _NEAR_GAPS if relation.relation == "next to" else (_SIDE_GAPS[0], 2 * _SIDE_GAPS[1])
        away = outline_centroid(outline) - outline_centroid(reference)
        if relation.relation == "next to":
            return low <= gap <= high
        off = math.atan2(away[1], away[0]) - _DIRECTIONS[relation.relation]
        return low <= gap <= high and abs(math.remainder(off, 2 * math.pi)) <= _OFF_DIRECTION

    # --- relations --------------------------------------------------------------------------------

    def _place_related(self, part: RelationPart) -> None:
        members = self._members(part.objects)
        if part.relation == "swapped":
            one, other = members
            for index, at in ((one, self._initial[other]), (other, self._initial[one])):
                self._try(lambda index=index, at=at: self._put_free(index, at[:2, 3]), "the swap")
            return
        for index in members:
            self._try(lambda index=index: self._put_related(index, part), f"object {index} {part.relation}")

    def _put_related(self, index: int, part: RelationPart) -> bool:
        rng, shape = self._rng, turned(self._models[index].footprint, self._yaws[index])
        if part.relation == "moved":
            angle = _DIRECTIONS[part.direction or ""]
            way = np.array([math.cos(angle), math.sin(angle)]) * (part.distance or 0.0)
            return self._put_free(index, self._initial[index][:2, 3] + way)
        if part.relation == "at":
            place = StructurePart(x_position=part.x_position, y_position=part.y_position)
            centre = self._centre([shape], place)
            return centre is not None and self._put_free(index, centre)
        references = [self._hull([i]) for i in self._members(part.reference)]
        if isinstance(part.reference, PartReference):
            references = [self._hull(self._members(part.reference))]
        centroids = [outline_centroid(outline) for outline in references]
        if part.relation == "between":
            share = rng.uniform(0.42, 0.58)
            return self._put_free(
                index, centroids[0] + share * (centroids[1] - centroids[0]) + rng.uniform(-0.01, 0.01, 2)
            )
        if part.relation in ("on", "in"):
            return self._put_upon(index, self._members(part.reference)[0], inside=part.relation == "in")
        angle, gaps = float(rng.uniform(-math.pi, math.pi)), _NEAR_GAPS
        if part.relation != "next to":
            angle, gaps = _DIRECTIONS[part.relation] + float(rng.uniform(-_OFF_DIRECTION, _OFF_DIRECTION)), _SIDE_GAPS
        way = np.array([math.cos(angle), math.sin(angle)])
        gap = part.distance if part.distance is not None else float(rng.uniform(*gaps))
        reach = separation_along(references[0] - centroids[0], shape, way, gap)
        free_of = 0.0 if part.distance is not None else CLEARANCE
        return self._put_free(index, centroids[0] + reach * way, free_of, self._members(part.reference))

    def _put_upon(self, index: int, below: int, inside: bool) -> bool:
        """Put an object on another, or as deep into it as it goes."""
        at = outline_centroid(self._outlines[below])
        base, top = self._base(below)[2, 3], self._models[below].height
        pose = pose_from_xyz_yaw(at[0], at[1], base + top + LIFT, self._yaws[index])
        if inside:
            with TabletopWorld([self._models[below]], [self._base(below)], self._table) as world:
                number = world.add(self._models[index], pose)
                while pose[2, 3] > base and min([0.0, *world.clearances(number).values()]) >= 0.0:
                    pose[2, 3] -= _DEEPER
                    world.set_pose(number, pose)
            pose[2, 3] += _DEEPER
        self._put(index, pose)
        return True

    # --- places -----------------------------------------------------------------------------------

    def _try(self, place: object, what: str) -> None:
        for _ in range(_TRIES):
            if place():  # type: ignore[operator]
                return
        raise NoReferenceError(f"{what} found no place in {_TRIES} attempts")

    def _put_free(
        self, index: int, centroid: np.ndarray, clearance: float = CLEARANCE, related: Sequence[int] = ()
    ) -> bool:
        """Put an object on the table with its footprint's centroid (2,) there; tell whether it is free.

        Args:
            index: of the object.
            centroid: (2,) m.
            clearance: to `related`, m; to everything else it is the usual one.
            related: objects that it may come closer to.
        """
        pose = pose_from_xyz_yaw(centroid[0], centroid[1], LIFT, self._yaws[index])
        outline = self._outline(index, pose)
        if self._table.overhang(outline) > 0:
            return False
        for other, there in self._outlines.items():
            least = clearance if other in related else CLEARANCE
            if clear_gap(outline, there) < least * 0.9:
                return False
        self._put(index, pose)
        return True

    def _is_free(self, outline: np.ndarray, apart: Sequence[int]) -> bool:
        return all(
            clear_gap(outline, there) >= (1.2 * MIN_GROUP_GAP if other in apart else 0.9 * CLEARANCE)
            for other, there in self._outlines.items()
        )

    def _put(self, index: int, pose: np.ndarray) -> None:
        self._poses[index], self._outlines[index] = pose, self._outline(index, pose)

    def _base(self, index: int) -> np.ndarray:
        return self._poses.get(index, self._initial[index])

    def _outline(self, index: int, pose: np.ndarray) -> np.ndarray:
        return turned(self._models[index].footprint, math.atan2(pose[1, 0], pose[0, 0])) + pose[:2, 3]

    def _hull(self, members: Sequence[int]) -> np.ndarray:
        points = np.concatenate([self._outlines[i] for i in members])
        return points[ConvexHull(points).vertices]

    def _members(self, objects: Objects | None) -> tuple[int, ...]:
        if isinstance(objects, PartReference):
            objects = self._goal.parts[objects.part].objects
        return tuple(objects or ())  # type: ignore[arg-type]

"""The table setting: a plate or bowl with what belongs around it, seen by the diner toward whom it faces.

The base takes the first place, the others any.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    CLEARANCE,
    MAX_CUTLERY_OFF_DEGREES,
    MAX_NEIGHBOUR_GAP,
    MAX_SETTING_OFF_DEGREES,
    MIN_SETTING_OBJECTS,
)
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, ObjectTraits, PlacedBody
from structdiffusion.structures.checks import Check, heading_check, position_checks
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.structure import Draft, LayoutError, Structure, Traits
from structdiffusion.tableware import BASES, CUTLERY, DRINKWARE, NOUNS

_LONGEST = 0.15  # m from the middle of an object to its end: longer cutlery is for serving
_STEP = 0.005  # m by which an object is pushed on until it clears what is there
_BESIDE = (0.02, 0.035)  # m between neighbours beside the base: fingers have to come between them
_SKEW = math.radians(8.0)  # that sampled cutlery may be off; the evaluation protocol allows more
_FACING_STEP = math.radians(5)  # between the headings that are tried where no cutlery tells where the diner sits


class TableSetting(Structure):
    """A plate or bowl, and any of fork, knife, spoon, cup or mug, and bowl."""

    name = "table setting"
    least = MIN_SETTING_OBJECTS
    usual_counts = (3, 6)
    exact_count = False  # no more than two of a kind have a place
    nouns = NOUNS
    requirement = f"by their nouns: {', '.join(nouns)}"
    demonstration_share = 0.25
    crowded_share = 0.2

    def suits(self, thing: ObjectTraits) -> bool:
        """Return whether its noun has a place in the setting."""
        return thing.category in NOUNS

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose a base and one object for each role; where more are wanted, two.

        Raises:
            LayoutError: if there is no base.
        """
        bases = [thing for noun in BASES for thing in candidates if thing.category == noun]
        if not bases:
            raise LayoutError("a table setting needs a plate or a bowl as its base")
        chosen = bases[:1]
        roles = {**{noun: (noun,) for noun in CUTLERY}, "drink": DRINKWARE}
        if chosen[0].category == "plate":
            roles["bowl"] = ("bowl",)
        of_role = {
            role: [thing for thing in candidates if thing.category in nouns and thing.radius < _LONGEST]
            for role, nouns in roles.items()
        }
        for role in rng.permutation(list(roles)):
            if of_role[str(role)] and len(chosen) < wanted:
                chosen.append(of_role[str(role)][0])
        if wanted > self.usual_counts[1]:  # a second one of each, but for bowls: two have no room behind the plate
            for role in rng.permutation([role for role in roles if role != "bowl"]):
                chosen += of_role[str(role)][1:2][: wanted - len(chosen)]
        return chosen

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a setting that clears itself, cutlery beside the base and the rest behind it.

        Raises:
            LayoutError: without a base, for a single object, or for an object that has no place in a setting.
        """
        base = setting_base(items)
        if items[base].category not in BASES or len(items) < self.least:
            raise LayoutError("a table setting needs a plate or bowl and at least one thing beside it")
        setting = _Setting(items, base, heading)
        setting.place_cutlery(rng)
        setting.place_behind()
        order = [base] + [i for i in range(len(items)) if i != base]
        return Draft(tuple(order), setting.offsets[order], np.zeros(len(items)), setting.turns[order], heading)

    def order_places(
        self, items: Sequence[LayoutItem], random: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray | None:
        """Order objects (K, N) at random, but for the base, which comes first."""
        first = np.argsort(random != setting_base(items), axis=1, kind="stable")
        return np.take_along_axis(random, first, axis=1)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check the base, the side that everything is on, its directions, gaps and heading."""
        bases = _bases(bodies)
        checks = [
            Check("plates or bowls as a base", bool(bases), len(bases), ">= 1"),
            Check("objects in the setting", len(bodies) >= self.least, len(bodies), f">= {self.least}"),
        ]
        if not bases or len(bodies) < self.least:
            return checks
        base = bases[0]
        facing = _facing(bodies, base, spec)
        checks += _diner_checks(bodies, base, facing)
        on_plate = [body for body in bodies if base in body.rests_on and body.category != "bowl"]
        checks.append(Check("things on the plate other than a bowl", not on_plate, len(on_plate), "0"))
        loneliest, limit = (
            max(
                min(clear_gap(a.footprint, b.footprint) for j, b in enumerate(bodies) if j != i)
                for i, a in enumerate(bodies)
            ),
            MAX_NEIGHBOUR_GAP,
        )
        checks.append(Check("clear gap to the nearest neighbour (m)", loneliest <= limit, loneliest, f"<= {limit:.3f}"))
        if spec.rotation is not None:
            checks.append(heading_check("setting's heading (deg off)", facing, spec.rotation, MAX_SETTING_OFF_DEGREES))
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centroid (2,) of the base; without one, the mean of all."""
        bases = _bases(bodies)
        return bodies[bases[0]].centroid if bases else super().centre(bodies)

    def turns(self, bodies: Sequence[PlacedBody], heading: float) -> np.ndarray:
        """Return how far (N,), radians, cutlery turns to point away from a diner who sits toward `heading`.

        Which end of a fork is its front shows in the outline of its cloud, where the network may have mistaken it.
        """
        away, turns = heading + math.pi, np.zeros(len(bodies))
        for index, body in enumerate(bodies):
            if body.category in CUTLERY:
                off = wrap_angle(body.front_yaw - away)
                turns[index] = float(np.clip(off, -_SKEW, _SKEW) - off)
        return turns


class _Setting:
    """A setting about its base while it is laid, in the diner's view: left and away are unit vectors (2,)."""

    def __init__(self, items: Sequence[LayoutItem], base: int, heading: float) -> None:
        self.items, self.base = items, base
        # +x of the structure frame is toward the diner, so away is -x and left is -y.
        self.away = -np.array([math.cos(heading), math.sin(heading)])
        self.left = np.array([math.sin(heading), -math.cos(heading)])
        self.turns, self.offsets = np.zeros(len(items)), np.zeros((len(items), 2))
        self._placed = [items[base].footprint]

    def place_cutlery(self, rng: np.random.Generator) -> None:
        """Place forks left of the base, and knives, then spoons, right of it."""
        plate, left, away = self.items[self.base].footprint, self.left, self.away
        reach = {1: float((plate @ left).max()), -1: -float((plate @ left).min())}
        for noun in CUTLERY:
            side = 1 if noun == "fork" else -1
            for index in (i for i, item in enumerate(self.items) if item.category == noun):
                self.turns[index] = wrap_angle(math.atan2(away[1], away[0]) - self.items[index].front_yaw)
                width = np.ptp(turned(self.items[index].footprint, self.turns[index]) @ left)
                distance = reach[side] + rng.uniform(*_BESIDE) + width / 2
                self._put(index, side * distance * left + rng.uniform(-0.01, 0.01) * away, side * left)
                reach[side] = abs(float(self.offsets[index] @ left)) + width / 2

    def place_behind(self) -> None:
        """Place drinkware behind the base and right, bowls behind it and left.

        Raises:
            LayoutError: for an object that has no place in a setting.
        """
        back = float((self.items[self.base].footprint @ self.away).max())
        for index, item in enumerate(self.items):
            if index == self.base or item.category in CUTLERY:
                continue
            if item.category not in DRINKWARE + BASES:
                raise LayoutError(
                    f"a table setting takes plate, bowl, fork, knife, spoon, cup and mug, not a {item.category}"
                )
            side = -1 if item.category in DRINKWARE else 1
            radius = 0.5 * float(np.ptp(item.footprint, axis=0).max())
            start = 0.75 * (back + radius) * self.away + side * 0.75 * (back + radius) * self.left
            self._put(index, start, self.away)

    def _put(self, index: int, position: np.ndarray, push: np.ndarray) -> None:
        """Place an item, moved outward step by step until it clears the placed ones."""
        outline = turned(self.items[index].footprint, self.turns[index])
        while any(clear_gap(outline + position, other) < CLEARANCE for other in self._placed):
            position = position + _STEP * push
        self.offsets[index] = position
        self._placed.append(outline + position)


def setting_base(items: Sequence[LayoutItem]) -> int:
    """Return the item that a setting is laid around: a plate, else a bowl; with neither, the broadest object."""
    bases = _bases(items)
    return bases[0] if bases else max(range(len(items)), key=lambda i: np.ptp(items[i].footprint, axis=0).min())


def _bases(things: Sequence[LayoutItem | PlacedBody]) -> list[int]:
    """Return which of some objects can be the base, plates first."""
    return [i for noun in BASES for i, thing in enumerate(things) if thing.category == noun]


def _facing(bodies: Sequence[PlacedBody], base: int, spec: StructureSpec) -> float:
    """Return the heading (rad) toward the diner.

    Cutlery points away from the diner, so the diner is where it points from. Without any, it is the heading with which
    most checks hold, the one asked for before others.
    """
    fronts = [body.front_yaw for body in bodies if body.category in CUTLERY]
    if fronts:
        return math.atan2(-sum(map(math.sin, fronts)), -sum(map(math.cos, fronts)))
    candidates = np.arange(-math.pi, math.pi, _FACING_STEP)
    if spec.rotation is not None:
        off = np.abs(wrap_angle(candidates - HEADING_OF_ROTATION[spec.rotation]))
        candidates = candidates[np.argsort(off)]
    return max(candidates, key=lambda yaw: sum(check.passed for check in _diner_checks(bodies, base, yaw)))


def _diner_checks(bodies: Sequence[PlacedBody], base: int, facing: float) -> list[Check]:
    """Check which side everything is on, for a diner who sits toward the heading `facing` and looks at the plate."""
    away = -np.array([math.cos(facing), math.sin(facing)])
    left = np.array([-away[1], away[0]])
    plate = bodies[base].footprint - bodies[base].centroid
    left_edge, right_edge = float((plate @ left).max()), float((plate @ left).min())
    knife_sides = [float((body.centroid - bodies[base].centroid) @ left) for body in bodies if body.category == "knife"]
    checks = []
    for i, body in enumerate(bodies):
        if i == base:
            continue
        offset, name = body.centroid - bodies[base].centroid, body.name
        side, behind = float(offset @ left), float(offset @ away)
        if body.category == "fork":
            checks.append(Check(f"{name}: left of the plate (m)", side > left_edge, side, f"> {left_edge:.3f}"))
        elif body.category == "knife":
            checks.append(Check(f"{name}: right of the plate (m)", side < right_edge, side, f"< {right_edge:.3f}"))
        elif body.category == "spoon":
            edge = min([right_edge, *knife_sides])
            checks.append(Check(f"{name}: right of knife and plate (m)", side < edge, side, f"< {edge:.3f}"))
        elif body.category in DRINKWARE:
            checks.append(Check(f"{name}: right of the centre (m)", side < 0, side, "< 0"))
            checks.append(Check(f"{name}: behind the centre (m)", behind > 0, behind, "> 0"))
        elif body.category == "bowl" and base not in body.rests_on:
            checks.append(Check(f"{name}: left of the centre (m)", side > 0, side, "> 0"))
            checks.append(Check(f"{name}: behind the centre (m)", behind > 0, behind, "> 0"))
        if body.category in CUTLERY:
            off, limit = (
                abs(math.degrees(wrap_angle(body.front_yaw - math.atan2(away[1], away[0])))),
                MAX_CUTLERY_OFF_DEGREES,
            )
            checks.append(Check(f"{name}: points away from the diner (deg off)", off <= limit, off, f"<= {limit:g}"))
    return checks

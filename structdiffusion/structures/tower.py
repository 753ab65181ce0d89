"""The tower: one object on another. It faces nowhere.

Object i takes place i, from the bottom up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from grounding.goals.parts import Order
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MIN_TOWER_OBJECTS
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, ObjectTraits, PlacedBody
from structdiffusion.structures.checks import Check, count_check, position_checks
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.sequences import sequence_by
from structdiffusion.structures.structure import LIFT, STANDING, TALLEST, Draft, LayoutError, Structure, Traits
from structdiffusion.tableware import CUTLERY

_TALLEST_OBJECT = 0.16  # m
_LOWEST_OF = 2  # a tower of more objects than usual takes the lowest of so many times as many
# Towers are sampled in the order of the demonstrations, by sizes blurred a little; after so many samples every second
# has its sizes blurred much, so that there is a choice where the usual order cannot stand.
_BLURS, _USUAL = (0.1, 0.8), 16


class Tower(Structure):
    """Two or more objects, each on the next lower one."""

    name = "tower"
    least = MIN_TOWER_OBJECTS
    usual_counts = (2, 4)
    exact_count = False  # it would become too high for the arm
    requirement = f"{STANDING}, lower than {_TALLEST_OBJECT} m, and no cutlery"
    stacks = True
    demonstration_share = 0.28  # more often than others, since some fall and are dropped
    crowded_share = 0.05

    def suits(self, thing: ObjectTraits) -> bool:
        """Return whether an object stands, is low and is no cutlery."""
        return super().suits(thing) and thing.height < _TALLEST_OBJECT and thing.category not in CUTLERY

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose objects of which at most one, the top one, cannot carry another.

        Raises:
            LayoutError: if too few of them can carry another.
        """
        least, most = self.usual_counts
        chosen = super().choose(candidates, wanted, rng, named)
        if wanted > most:
            chosen = _low_enough(candidates, wanted)
        if not any(thing.stackable for thing in chosen):
            raise LayoutError("none of the objects can carry another")
        carriers = [thing for thing in chosen if thing.stackable]
        chosen = carriers + [thing for thing in chosen if not thing.stackable][:1]
        if len(chosen) < least:
            raise LayoutError("too few of the objects can carry another")
        return chosen

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a tower on one axis, broad objects below.

        Raises:
            LayoutError: for fewer than two objects, or objects that cannot carry or stand on one another, as ordered.
        """
        self.require_enough(items)
        order = tower_order(items, rng) if keys.order is None else _by_key(items, keys.order, rng)
        if not all(items[i].stackable for i in order[:-1]):
            raise LayoutError(
                "a tower needs objects that others can stand on; only the top one may be round or pointed"
            )
        if not all(items[i].flat_bottom for i in order[1:]):
            raise LayoutError("a tower needs objects with a level bottom above its lowest")
        heights = np.concatenate(([0.0], np.cumsum([items[i].height + LIFT for i in order[:-1]])))
        # Its frame is the world's.
        return Draft(order, np.zeros((len(items), 2)), heights, np.zeros(len(items)), 0.0)

    def order_places(
        self, items: Sequence[LayoutItem], random: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray | None:
        """Order objects (K, N) from the bottom up; in every second of many samples less strictly."""
        blurs = [_BLURS[k >= _USUAL and k % 2] for k in range(len(random))]
        return np.array([tower_order(items, rng, blur) for blur in blurs])

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check that every object rests on the next lower one alone, with its centroid above it."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        order = sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)
        chained = sum(tuple(bodies[upper].rests_on) == (lower,) for lower, upper in zip(order, order[1:]))
        chained += bodies[order[0]].rests_on == ()
        centred = sum(
            shapely.Polygon(bodies[lower].footprint).contains(shapely.Point(bodies[upper].centroid))
            for lower, upper in zip(order, order[1:])
        )
        for name, held, count in (
            ("objects that rest on the next one below only", chained, len(bodies)),
            ("objects whose centroid lies over the one below", centred, len(bodies) - 1),
        ):
            checks.append(Check(name, held == count, held, f"{count}"))
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices from the bottom up."""
        return sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centroid (2,) of the lowest object."""
        return bodies[min(range(len(bodies)), key=lambda i: bodies[i].z_bottom)].centroid


def _by_key(items: Sequence[LayoutItem], order: Order, rng: np.random.Generator) -> tuple[int, ...]:
    """Return items from the bottom up in a requested order; if either end may be first, the more stable direction."""
    ways = [sequence_by(items, order, rng)]
    if order.start == "top":
        ways = [ways[0][::-1]]
    if order.start is None or (order.direction is None and order.by != "listed"):
        ways.append(ways[0][::-1])
    usual = {item: place for place, item in enumerate(tower_order(items))}

    def misfit(way: tuple[int, ...]) -> tuple[bool, int]:
        stands = all(items[i].stackable for i in way[:-1]) and all(items[i].flat_bottom for i in way[1:])
        return not stands, sum(usual[a] > usual[b] for a, b in zip(way, way[1:]))

    return min(ways, key=misfit)


def tower_order(
    items: Sequence[LayoutItem], rng: np.random.Generator | None = None, blur: float = 0.1
) -> tuple[int, ...]:
    """Order items from the bottom up: what carries first, the larger footprint first.

    With `rng`, sizes are blurred by about this share, so that near-equal objects come in any order.
    """

    def key(index: int) -> tuple[int, float]:
        item = items[index]
        area = float(np.prod(np.ptp(item.footprint, axis=0)))
        factor = math.exp(blur * rng.standard_normal()) if rng is not None else 1.0
        return (not item.stackable, -area * factor)

    return tuple(sorted(range(len(items)), key=key))


def _low_enough(candidates: Sequence[Traits], wanted: int) -> list[Traits]:
    """Return the lowest of some objects, as many as the arm can pile up."""
    low = sorted(candidates[: _LOWEST_OF * wanted], key=lambda thing: thing.height)[:wanted]
    below = np.cumsum([0.0, *(thing.height for thing in low[:-1])])
    return [thing for thing, height in zip(low, below) if height < TALLEST]

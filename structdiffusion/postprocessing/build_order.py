"""Find an order of building in which what is built so far stands after every object: by physics, with rollback.

Supports come first, the lowest and farthest before others. Where an object brings down what stands, the search goes
back to what stood before it, and tries another one there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from grounding.figures.figure import ON_TABLE
from structdiffusion.evaluation_protocol import MAX_COPY_OFF, SETTLE_SECONDS
from structdiffusion.footprints import stands_above
from structdiffusion.geometry import tilt_between, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.protocol.physical_stability import executable_order
from structdiffusion.simulation.world import TabletopWorld

MOST_TRIED = 200  # objects that are set down: twelve of them in an order that stands at once take twelve
_MOST_TILT = math.radians(3.0)  # an object that leans by more has begun to fall
_BEGINS = 0.25  # s of physics before rest is looked for: what is about to tip begins slowly


class NoOrderError(ValueError):
    """Raised if no order stands; the message says how far the best one came, and what fell then."""


@dataclass
class BuildOrder:
    """A search for an order of building.

    Args:
        models: of the N objects.
        goals: world_from_goal (N, 4, 4), each at or a little above contact.
        moved: the objects that are placed.
        names: of the N objects.
        others: what stands there all the time, with its poses (4, 4).
        table: the table top.
    """

    models: Sequence[ObjectModel]
    goals: np.ndarray
    moved: Sequence[int]
    names: Sequence[str]
    others: Sequence[tuple[ObjectModel, np.ndarray]] = ()
    table: Table = Table()
    _tried: int = 0
    _stood: dict[frozenset[int], tuple[dict[int, np.ndarray], str]] = field(default_factory=dict)
    _dead: set[frozenset[int]] = field(default_factory=set)  # what is placed, from where nothing leads on
    _best: tuple[int, str] = (-1, "")

    def find(self) -> list[tuple[int, ...]]:
        """Return orders that stand: from far away, so that the arm reaches over less, from the left, from the right.

        Raises:
            NoOrderError: if there is none.
        """
        ranks = executable_order([self.models[i] for i in self.moved], self.goals[list(self.moved)], far_first=True)
        far_first = [self.moved[k] for k in ranks]
        low = {i: round(self._bottom(i) / ON_TABLE) for i in far_first}
        across = [sorted(far_first, key=lambda i: (low[i], side * self.goals[i][1, 3])) for side in (-1.0, 1.0)]
        below = self._supports()
        found = [self._after({}, ranked, below) for ranked in (far_first, *across)]
        if found[0] is None:
            count, fallen = self._best
            raise NoOrderError(
                "it cannot be built one object after another: in every order that was tried something falls, "
                f"at best when {count} of {len(self.moved)} objects stand: {fallen}"
            )
        return list(dict.fromkeys(order for order in found if order is not None))

    def _after(
        self, standing: Mapping[int, np.ndarray], ranked: Sequence[int], below: Mapping[int, set[int]]
    ) -> tuple[int, ...] | None:
        """Return the whole order that begins with what stands; `None` if there is none.

        Args:
            standing: object -> its pose (4, 4), in the order of placement.
            ranked: the objects in the order in which they are tried.
            below: object -> those that are under it in the end.
        """
        if len(standing) == len(ranked):
            return tuple(standing)
        for number in ranked:
            there = frozenset((*standing, number))
            if number in standing or not below[number] <= standing.keys() or there in self._dead:
                continue
            if self._tried >= MOST_TRIED:
                return None
            poses, fallen = self._stood.get(there) or self._with({**standing, number: self.goals[number]})
            if fallen and len(standing) > self._best[0]:
                self._best = len(standing), fallen
            found = None if fallen else self._after(poses, ranked, below)
            if found is not None:
                return found
            self._dead.add(there)
        return None

    def _with(self, placed: Mapping[int, np.ndarray]) -> tuple[dict[int, np.ndarray], str]:
        """Return where objects come to rest, and which falls where the last one is put in its place, or ""."""
        self._tried += 1
        there = [*self.others, *((self.models[i], pose) for i, pose in placed.items())]
        with TabletopWorld([model for model, _ in there], [pose for _, pose in there], self.table) as world:
            world.step(_BEGINS)
            world.settle(SETTLE_SECONDS)
            poses = dict(zip(placed, world.poses()[len(self.others) :], strict=True))
        last = [*placed][-1]
        for number, pose in poses.items():
            off = float(np.linalg.norm(pose[:2, 3] - self.goals[number][:2, 3]))
            if off > MAX_COPY_OFF or tilt_between(pose, self.goals[number]) > _MOST_TILT:
                said = "it is" if number == last else f"the {self.names[last]} is"
                return poses, f"the {self.names[number]} falls when {said} put in its place"
        return poses, ""

    def _supports(self) -> dict[int, set[int]]:
        """Return for each object those under it in the end."""
        outlines = {i: shapely.MultiPoint(self._points(i)[:, :2]).convex_hull for i in self.moved}
        bottoms = {i: self._bottom(i) for i in self.moved}
        return {
            i: {j for j in self.moved if j != i and stands_above(i, j, outlines, bottoms)}  # type: ignore[arg-type]
            for i in self.moved
        }

    def _points(self, index: int) -> np.ndarray:
        return transform_points(self.goals[index], np.concatenate(self.models[index].hulls))

    def _bottom(self, index: int) -> float:
        return float(self._points(index)[:, 2].min())

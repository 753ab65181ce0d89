"""Place the blocks of a goal in order, each at a free place where all relations hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from grounding.goals.parts import StructurePart
from structdiffusion.composition.blocks import Block
from structdiffusion.composition.constraints import (
    Situation,
    asks_for_a_place,
    bond_margins,
    bond_said,
    origin_range,
    structure_margins,
    structure_places,
)
from structdiffusion.composition.items import TableState
from structdiffusion.relations.bonds import Bond
from structdiffusion.structures.bodies import PlacedBody

_PER_BOND, _PER_PLACE, _ANYWHERE = 20, 32, 24  # candidates that are drawn for a block
_CLEAR = 0.01  # m of clear gap to everything that is not part of a block
_COMFORTABLE = 0.03  # m of clear gap, from where on more is no better
_WEIGHT_CLEAR, _WEIGHT_HIT = 0.5, 3.0  # of the clear gap, and of each thing in the way that would be set aside
_BLOCKS_TRIED = 3  # blocks of one unit that are tried in one trial
_REACHED = 0.8  # of the smallest radius of what carries several objects: within it their places are drawn
_LEVELS = 0.004  # m by which heights may overlap where one thing is on another


@dataclass
class Unit:
    """Objects that are placed as a whole, in one of several ways.

    Attributes:
        members: their indices.
        blocks: the ways, best first.
        part: the structure that they form, if they form one.
        said: its description in messages.
        vessel: the object that they go into; then each block stands for poses about that one as it stands now.
        optional: whether it may stay in place; it is only moved to make room.
    """

    members: tuple[int, ...]
    blocks: Sequence[Block]
    said: str
    part: StructurePart | None = None
    vessel: int | None = None
    optional: bool = False


@dataclass
class Placement:
    """Where everything goes.

    Attributes:
        bodies: index -> placed body.
        motions: (4, 4), by index.
        in_the_way: the indices of what would have to be set aside.
        margin: the smallest margin of all relations and places, at most 1.
        quality: the product of the planners' scores of the blocks.
    """

    bodies: dict[int, PlacedBody] = field(default_factory=dict)
    motions: dict[int, np.ndarray] = field(default_factory=dict)
    in_the_way: set[int] = field(default_factory=set)
    margin: float = 1.0
    quality: float = 1.0


class NoPlaceError(Exception):
    """Raised if a unit has no place; the message gives the reason."""


@dataclass(frozen=True)
class Placer:
    """A sampler of placements of the units of one goal.

    Attributes:
        state: the table.
        units: the units in the order of their placement.
        bonds: the relations between them and to what stays.
        stays: the indices of the objects that are not moved.
        removable: the indices of objects in `stays` that may be set aside.
        fixed: the indices of objects of units that have to stay where they are.
    """

    state: TableState
    units: Sequence[Unit]
    bonds: Sequence[Bond]
    stays: frozenset[int]
    removable: frozenset[int] = frozenset()
    fixed: frozenset[int] = frozenset()

    def draw(self, number: int, rng: np.random.Generator) -> Placement:
        """Draw one placement; `number` decides which blocks are tried first.

        Raises:
            NoPlaceError: if a unit has no place.
        """
        placement = Placement()
        for unit in self.units:
            self.place(unit, placement, number, rng)
        return placement

    def place(self, unit: Unit, placement: Placement, number: int, rng: np.random.Generator) -> None:
        """Place one unit among those that are placed already, in place.

        Raises:
            NoPlaceError: if it has no place.
        """
        reason = ""
        for attempt in range(min(_BLOCKS_TRIED, len(unit.blocks))):
            block = unit.blocks[(number + attempt) % len(unit.blocks)]
            try:
                self._place_block(unit, block, placement, rng)
                return
            except NoPlaceError as error:
                reason = reason or str(error)
        raise NoPlaceError(reason)

    def _place_block(self, unit: Unit, block: Block, placement: Placement, rng: np.random.Generator) -> None:
        situation = Situation(self.state, placement.bodies, self.stays - set(placement.bodies))
        if unit.vessel is not None:
            block = _into(self.state, unit.vessel, block, placement)
            origins = np.zeros((1, 2))
        else:
            origins = self._candidates(unit, block, situation, rng)
        carriers = self._carriers(unit)
        if carriers and unit.vessel is None:
            top = max(situation.figure([i]).bodies[0].z_top for i in carriers)
            block = block.lifted(top)
        margins = np.ones(len(origins))
        wishes: list[tuple[str, np.ndarray]] = []
        on_table = np.ones(len(origins), bool)
        if unit.vessel is None:
            low, high = origin_range(block, self.state.table)
            on_table = np.all(np.minimum(origins - low, high - origins) >= -1e-9, axis=1)
        if unit.part is not None:
            wishes.append((unit.said, structure_margins(situation, unit.part, block, origins)))
        names = [item.name for item in self.state.items]
        for bond in self.bonds:
            # What was found in physics to lie inside does.
            if unit.vessel is not None and bond.relation.carried and set(bond.members) <= set(unit.members):
                continue
            found = bond_margins(situation, bond, block, origins)
            if found is not None:
                wishes.append((bond_said(bond, names), found))
        for _, found in wishes:
            margins = np.minimum(margins, found)
        clear, hits = self._clearances(unit, block, origins, placement, carriers)
        free = clear >= _CLEAR if unit.vessel is None else np.ones(len(origins), bool)
        able = (margins > 0) & free & on_table
        if not able.any():
            missed = [said for said, found in wishes if not (found > 0).any()]
            if missed and self.fixed & set(block.members):
                raise NoPlaceError(f"{unit.said} cannot be taken and stays where it is, and there {missed[0]} fails")
            where = " and ".join(self.state.items[i].name for i in sorted(carriers))
            raise NoPlaceError(_why_not(unit, wishes, on_table, f"the {where}" if where else "the table"))
        score = np.minimum(margins, 1.0) + _WEIGHT_CLEAR * np.minimum(clear / _COMFORTABLE, 1.0)
        score -= _WEIGHT_HIT * np.array([len(hit) for hit in hits])
        if self._shared(unit):  # the middle of a plate is best for one object, and leaves no room for a second
            score += rng.uniform(0.0, 1.0, len(score))
        best = int(np.where(able, score, -np.inf).argmax())
        placement.bodies.update(block.bodies_at(origins[best]))
        placement.motions.update(block.motions_at(origins[best]))
        for index in self.fixed & set(block.members):
            placement.bodies[index], placement.motions[index] = self.state.standing().bodies[index], np.eye(4)
        placement.in_the_way |= hits[best]
        placement.margin = min(placement.margin, float(margins[best]))
        placement.quality *= block.quality

    def _carriers(self, unit: Unit) -> set[int]:
        """Return what carries a unit: "on" something, or in a vessel."""
        carriers = {unit.vessel} if unit.vessel is not None else set()
        for bond in self.bonds:
            if bond.relation.carried and set(bond.members) <= set(unit.members):
                carriers.update(bond.related)
        return carriers

    def _shared(self, unit: Unit) -> bool:
        """Return whether what carries a unit, other than a vessel, carries others of the goal's objects too."""
        carriers = self._carriers(unit) if unit.vessel is None else set()
        return any(
            bond.relation.carried and set(bond.related) & carriers and not set(bond.members) <= set(unit.members)
            for bond in self.bonds
        )

    def _candidates(self, unit: Unit, block: Block, situation: Situation, rng: np.random.Generator) -> np.ndarray:
        """Draw candidate origins (C, 2): places that relations imply, places of the structure's thirds, and any other
        places.
        """
        drawn: list[np.ndarray] = []
        here = block.bodies_at(np.zeros(2))
        for index in self.fixed & set(block.members):  # the only place at which it stays
            return (self.state.standing().bodies[index].centroid - here[index].centroid)[None]
        exact = False
        for bond in self.bonds:
            if not set(bond.members) <= set(unit.members) or set(bond.related) & set(unit.members):
                continue
            if not bond.relation.exact and not situation.known(bond.related):
                continue
            figure = situation.figure(bond.members, here)
            references = [situation.figure(members) for members in bond.references]
            centroids = bond.relation.sample(figure, references, bond.part, _PER_BOND, rng)
            drawn.append(centroids - figure.centroid)
            if bond.relation.carried and self._shared(unit):
                (reference,) = references
                radius = _REACHED * np.linalg.norm(reference.outline - reference.centroid, axis=1).min()
                angles, share = rng.uniform(0.0, 2 * np.pi, _PER_PLACE), np.sqrt(rng.uniform(size=_PER_PLACE))
                around = (radius * share)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
                drawn.append(reference.centroid + around - figure.centroid)
            exact = exact or bond.relation.exact or bond.relation.carried
        if unit.part is not None and asks_for_a_place(unit.part):
            drawn.append(structure_places(situation, unit.part, block, _PER_PLACE, rng))
        if exact:
            return np.concatenate(drawn)
        low, high = origin_range(block, self.state.table)
        if (low <= high).all():
            drawn.append(rng.uniform(low, high, (_ANYWHERE if drawn else _ANYWHERE + _PER_PLACE, 2)))
        if unit.optional:
            drawn.append(self.state.standing().figure(unit.members).centroid[None])
        return np.concatenate(drawn) if drawn else np.zeros((1, 2))

    def _clearances(
        self, unit: Unit, block: Block, origins: np.ndarray, placement: Placement, carriers: set[int]
    ) -> tuple[np.ndarray, list[set[int]]]:
        """Return the clear gap (C,) of a block to everything at its height, and what would have to be set aside."""
        bodies = self.state.standing(placement.bodies).bodies
        within = set(carriers) | self._beside_in_the_vessel(unit)
        present = (set(placement.bodies) | self.stays) - set(unit.members) - within
        clear, hits = np.full(len(origins), 1.0), [set[int]() for _ in origins]
        for body in block.bodies.values():
            near = [
                i
                for i in present
                if bodies[i].z_top > body.z_bottom + _LEVELS and bodies[i].z_bottom < body.z_top - _LEVELS
            ]
            firm = [i for i in near if i not in self.removable]
            polygons = shapely.polygons(origins[:, None] + body.footprint)
            if firm:
                obstacles = shapely.union_all([shapely.Polygon(bodies[i].footprint) for i in firm])
                clear = np.minimum(clear, shapely.distance(obstacles, polygons))
            for i in near:
                if i in self.removable:
                    for k in np.nonzero(shapely.distance(shapely.Polygon(bodies[i].footprint), polygons) < _CLEAR)[0]:
                        hits[k].add(i)
        return clear, hits

    def _beside_in_the_vessel(self, unit: Unit) -> set[int]:
        if unit.vessel is None:
            return set()
        return {
            i for bond in self.bonds if bond.relation.carried and unit.vessel in bond.related for i in bond.members
        } | set(self.state.carried_by(unit.vessel))


def _into(state: TableState, vessel: int, block: Block, placement: Placement) -> Block:
    """Return a block of poses about a vessel as it stands now, moved along with the vessel."""
    along = placement.motions.get(vessel)
    if along is None:
        return block
    motions = {i: along @ motion for i, motion in block.motions.items()}
    turn = along[:2, :2]
    bodies: Mapping[int, PlacedBody] = {
        i: PlacedBody(
            body.name, body.category, body.footprint @ turn.T + along[:2, 3], turn @ body.centroid + along[:2, 3],
            body.z_bottom + float(along[2, 3]), body.z_top + float(along[2, 3]), body.front_yaw,
        )
        for i, body in block.bodies.items()
    }  # fmt: skip
    return Block(bodies, motions, block.centre, block.quality)


def _why_not(unit: Unit, wishes: Sequence[tuple[str, np.ndarray]], on_table: np.ndarray, where: str) -> str:
    """Return why a unit has no place: conditions that hold nowhere or not together, the table's edge, or no room."""
    said = " and ".join(said for said, _ in wishes if said != unit.said) or unit.said
    held = [margins > 0 for _, margins in wishes]
    never = [said for (said, _), each in zip(wishes, held, strict=True) if not each.any()]
    together = np.all(held, axis=0) if held else np.ones(len(on_table), bool)
    if never:
        return f"there is no place on the table for {unit.said} where {never[0]} holds"
    if not together.any():
        return f"there is no place on the table for {unit.said} where {said} hold together"
    if not (together & on_table).any():
        return f"{said} would put {unit.said if said != unit.said else 'it'} beyond the edge of the table"
    return f"there is no free place on {where} for {unit.said}: something is in the way everywhere"

"""Compute margins by which the parts of a goal hold at candidate places of one block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grounding.goals.description import describe_part
from grounding.goals.parts import StructurePart
from structdiffusion.composition.blocks import Block
from structdiffusion.composition.items import TableState
from structdiffusion.evaluation_protocol import (
    MAX_ALONG_DISTANCE,
    MAX_AROUND_OFF,
    X_POSITION_THIRDS,
    Y_POSITION_THIRDS,
)
from structdiffusion.footprints import centre_range
from structdiffusion.protocol.goal_keys import edge_distance
from structdiffusion.relations.bonds import Bond
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import within
from structdiffusion.structures.bodies import PlacedBody

_SURE_SHARE = 0.06  # share of the range inside a third, from where on more is no better
_SURE_ALONG = 0.02  # m from the farthest that a line may be from its edge
_DRAWN = 0.2  # share of a third that is kept from its borders where places are drawn
_EDGE = 0.005  # m from the table's edge to everything


@dataclass(frozen=True)
class Situation:
    """Where everything is that is not being placed.

    Attributes:
        state: the table.
        bodies: what has been placed already, by index.
        stays: the indices of the objects that are not moved.
    """

    state: TableState
    bodies: Mapping[int, PlacedBody]
    stays: frozenset[int]

    def known(self, members: Sequence[int]) -> bool:
        """Return whether it is certain where these objects are."""
        return all(i in self.bodies or i in self.stays for i in members)

    def figure(self, members: Sequence[int], more: Mapping[int, PlacedBody] | None = None) -> Figure:
        """Return some objects as one figure, with some more of them placed."""
        return self.state.standing({**self.bodies, **(more or {})}).figure(members)


def bond_margins(situation: Situation, bond: Bond, block: Block, origins: np.ndarray) -> np.ndarray | None:
    """Return the margin of a relation with a block's origin at each of C places (C, 2); `None` if it is still open.

    It is open until all other objects are placed.
    """
    own, others = set(block.members), [i for i in (*bond.members, *bond.related) if i not in block.members]
    if not own & {*bond.members, *bond.related}:
        return None
    if bond.relation.exact and not own & set(bond.members):
        return None  # it depends on where the reference stood, not on where it goes
    if not bond.relation.exact and not situation.known(others):
        return None
    if set(bond.members) <= own and (bond.relation.exact or not own & set(bond.related)):
        figure = situation.figure(bond.members, block.bodies_at(np.zeros(2)))
        references = [situation.figure(members) for members in bond.references]
        before = situation.state.standing().figure(bond.members).centroid
        candidates = Candidates(figure.outline - figure.centroid, origins + figure.centroid, before)
        return bond.relation.margins(candidates, references, bond.part, situation.state.table)
    margins = np.empty(len(origins))
    for k, origin in enumerate(origins):
        here = block.bodies_at(origin)
        figure = situation.figure(bond.members, here)
        references = [situation.figure(members, here) for members in bond.references]
        before = situation.state.standing().figure(bond.members).centroid
        candidates = Candidates(figure.outline - figure.centroid, figure.centroid[None], before)
        margins[k] = bond.relation.margins(candidates, references, bond.part, situation.state.table)[0]
    return margins


def structure_margins(situation: Situation, part: StructurePart, block: Block, origins: np.ndarray) -> np.ndarray:
    """Return the margin of a structure's place with its block's origin at each of C places (C, 2)."""
    state, margins = situation.state, np.ones(len(origins))
    centres = origins + block.centre
    ranges = centre_range([block.points], block.centre, state.table)
    for axis, value, names in _thirds(part):
        if value is not None:
            low, high = ranges[axis]
            share = (centres[:, axis] - low) / max(1e-6, high - low)
            third = names.index(value)
            margins = np.minimum(margins, within(share, third / 3, (third + 1) / 3, _SURE_SHARE))
    if part.around is not None:
        off = np.linalg.norm(centres - situation.figure(part.around).centroid, axis=1)  # type: ignore[arg-type]
        margins = np.minimum(margins, within(off, -np.inf, MAX_AROUND_OFF, MAX_AROUND_OFF))
    if part.along is not None:
        middles = np.array([body.centroid for body in block.bodies.values()])
        far = edge_distance(origins[:, None] + middles, part.along, state.table).max(axis=1)
        margins = np.minimum(margins, within(far, -np.inf, MAX_ALONG_DISTANCE, _SURE_ALONG))
    return margins


def structure_places(
    situation: Situation, part: StructurePart, block: Block, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Draw origins (count, 2) for a structure's block at which its place on the table is as requested."""
    table = situation.state.table
    low, high = origin_range(block, table)
    if part.around is not None:
        middle = situation.figure(part.around).centroid - block.centre  # type: ignore[arg-type]
        spread = 0.3 * MAX_AROUND_OFF * rng.uniform(-1, 1, (count, 2))
        spread[:1] = 0.0
        return middle + spread
    ranges = centre_range([block.points], block.centre, table)
    for axis, value, names in _thirds(part):
        if value is not None:
            start, end = ranges[axis]
            third = (end - start) / 3
            first = start + names.index(value) * third
            low[axis] = max(low[axis], first + _DRAWN * third - block.centre[axis])
            high[axis] = min(high[axis], first + (1 - _DRAWN) * third - block.centre[axis])
    places = rng.uniform(np.minimum(low, high), np.maximum(low, high), (count, 2))
    if part.along is not None:
        middles = np.array([body.centroid for body in block.bodies.values()])
        far = edge_distance(places[:, None] + middles, part.along, table).max(axis=1)
        near = edge_distance(places[:, None] + block.points, part.along, table).min(axis=1)
        wanted = rng.uniform(0.3, 1.0, count) * np.maximum(0.0, MAX_ALONG_DISTANCE - _SURE_ALONG - (far - near) - _EDGE)
        toward = -edge_direction(part.along)
        places = places + ((near - _EDGE - wanted * 0.5)[:, None]) * -toward
    return places


def edge_direction(edge: str) -> np.ndarray:
    """Return the unit vector (2,) toward an edge of the table."""
    return {"near": np.array([-1.0, 0.0]), "far": np.array([1.0, 0.0]), "left": np.array([0.0, 1.0])}.get(
        edge, np.array([0.0, -1.0])
    )


def origin_range(block: Block, table) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest origin (2,) of a block with everything on the table."""
    low = np.array([table.x_min, table.y_min]) + _EDGE - block.points.min(axis=0)
    high = np.array([table.x_max, table.y_max]) - _EDGE - block.points.max(axis=0)
    return low, high


def asks_for_a_place(part: StructurePart) -> bool:
    """Return whether a structure says where on the table it is."""
    return bool(part.x_position or part.y_position or part.around or part.along)


def bond_said(bond: Bond, names: Sequence[str]) -> str:
    """Return a relation in words, with the number of its part."""
    return f"part {bond.number + 1} ({describe_part(bond.part, names)})"


def _thirds(part: StructurePart) -> tuple[tuple[int, str | None, tuple[str, ...]], ...]:
    return (0, part.y_position, Y_POSITION_THIRDS), (1, part.x_position, X_POSITION_THIRDS)

"""Make the units of a goal: the objects that move, their possible motions, and the order of placement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from structdiffusion.composition.blocks import Block
from structdiffusion.composition.inside import body_at, rest_inside
from structdiffusion.composition.items import TableState
from structdiffusion.composition.placement import Unit
from structdiffusion.composition.structure_blocks import StructureBlocks
from structdiffusion.relations.bonds import Bond
from structdiffusion.structures.structure import LayoutError

_TURNS = (
    0.0,
    math.pi / 2,
    math.pi / 4,
    -math.pi / 4,
)  # in which a single object is placed, where it does not fit as it stands
_WAYS_INSIDE = 3  # in which objects come to rest in a vessel
_TOP_SHARE = 0.35  # of an object's outline that has to be over what carries it


@dataclass(frozen=True)
class Units:
    """The units of a resolved goal.

    Attributes:
        goal: the goal.
        bonds: its relations.
        state: the table.
    """

    goal: Goal
    bonds: Sequence[Bond]
    state: TableState

    def make(self, blocks: StructureBlocks, count: int, generator: torch.Generator) -> list[Unit]:
        """Make the units that the goal moves, in the order in which they are placed.

        Raises:
            LayoutError: for what these objects cannot do; the message says why.
        """
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        units = self._structures(blocks, count, generator)
        taken = {i for unit in units for i in unit.members}
        vessels: dict[int, list[int]] = {}
        for bond in self.bonds:
            if bond.relation.hollow:
                vessels.setdefault(bond.related[0], []).extend(i for i in bond.members if i not in taken)
            elif bond.relation.carried:
                self._require_top(bond)
        inside = {i for things in vessels.values() for i in things}
        for bond in self.bonds:
            for index in bond.members:
                if index not in taken | inside:
                    units.append(self.single(index))
                    taken.add(index)
        for vessel, things in vessels.items():
            if things:
                units.append(self._inside(vessel, things, rng))
        return self.ordered(units)

    def single(self, index: int, optional: bool = False) -> Unit:
        """Make the unit of one object, as it stands or turned."""
        item = self.state.items[index]
        blocks = [Block.of({index: item}, {index: item.motion_to((0.0, 0.0), turn, 0.0)}) for turn in _TURNS]
        return Unit((index,), blocks, f"the {item.name}", optional=optional)

    def ordered(self, units: Sequence[Unit]) -> list[Unit]:
        """Return the units ordered so that references precede the objects placed by them, and supports precede their
        load.

        Where places refer to each other in a circle, the unit with the fewest open references comes first.
        """
        left, result = list(units), []
        while left:

            def open_references(unit: Unit) -> tuple[int, int]:
                others = {i for other in left if other is not unit for i in other.members}
                bonds = [bond for bond in self.bonds if set(bond.members) & set(unit.members)]
                carried = sum(bool(set(bond.related) & others) for bond in bonds if bond.relation.carried)
                around = set(unit.part.around or ()) & others if unit.part is not None else set()
                ties = sum(len(set(bond.related) & others) for bond in bonds if not bond.relation.mutual)
                return carried + len(around), ties

            first = min(left, key=open_references)
            result.append(first)
            left.remove(first)
        return result

    def _structures(self, blocks: StructureBlocks, count: int, generator: torch.Generator) -> list[Unit]:
        names = [item.name for item in self.state.items]
        units = []
        for number, part in enumerate(self.goal.parts):
            if isinstance(part, StructurePart):
                said = f"part {number + 1} ({describe_part(part, names)})"
                try:
                    ways = blocks.propose(part, count, generator)
                except LayoutError as error:
                    raise LayoutError(str(error) if len(self.goal.parts) == 1 else f"{said}: {error}") from error
                units.append(Unit(tuple(part.objects or ()), ways, said, part))  # type: ignore[arg-type]
        return units

    def _require_top(self, bond: Bond) -> None:
        """Raise a `LayoutError` if nothing can stand on an object that has to carry another."""
        (thing,) = (self.state.items[i] for i in bond.members)
        carrier = max((self.state.items[i] for i in bond.related), key=lambda item: item.seen.stackable)
        if carrier.seen.rounded:
            raise LayoutError(f"the {thing.name} cannot stand on the {carrier.name}: its top is round")
        if not carrier.seen.stackable and not carrier.seen.hollow:
            raise LayoutError(
                f"the {thing.name} cannot stand on the {carrier.name}: its top is not level and wide enough"
            )
        own, below = (item.model.footprint for item in (thing, carrier))
        if not carrier.seen.hollow and _area(below) < _TOP_SHARE * _area(own):
            raise LayoutError(f"the {thing.name} cannot stand on the {carrier.name}: it is too wide for its top")

    def _inside(self, vessel: int, things: Sequence[int], rng: np.random.Generator) -> Unit:
        # The largest goes in first: it has the least choice.
        items = sorted((self.state.items[i] for i in things), key=lambda item: -item.model.radius)
        ways = rest_inside(self.state.items[vessel], items, _WAYS_INSIDE, rng)
        blocks = []
        for way in ways:
            motions = {item.index: motion for item, motion in zip(items, way, strict=True)}
            bodies = {
                i: body_at(self.state.items[i], motion @ self.state.items[i].pose) for i, motion in motions.items()
            }
            blocks.append(Block(bodies, motions, np.zeros(2)))
        said = " and ".join(f"the {item.name}" for item in items)
        return Unit(tuple(item.index for item in items), blocks, said, vessel=vessel)


def _area(outline: np.ndarray) -> float:
    low, high = outline.min(axis=0), outline.max(axis=0)
    return float(np.prod(high - low))

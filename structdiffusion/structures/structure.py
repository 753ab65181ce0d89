"""The protocol of a structure, which the rest of the package uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from grounding.figures.drawings import without_drawings
from grounding.figures.names import LIKE
from grounding.spec import ROTATIONS, SIZES, StructureSpec, slots_of
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, ObjectTraits, PlacedBody
from structdiffusion.structures.checks import Check
from structdiffusion.structures.keys import NO_KEYS, StructureKeys

Traits = TypeVar("Traits", bound=ObjectTraits)
# m, across a footprint: wider objects leave no room for company.
WIDEST = 0.22
STANDING = f"level below and less than {WIDEST} m across"
TALLEST = 0.40  # m: the highest place onto which the arm can release an object
LIFT = 0.0005  # m between surfaces that touch in a layout, so that they do not start inside each other


def a_structure(name: str) -> str:
    """Return a structure's name with its article; "like FILE" is a structure like that."""
    name = without_drawings(name)
    if name.startswith(LIKE):
        return f"a structure {name}"
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


class LayoutError(ValueError):
    """Raised if these objects cannot make this structure on this table; the message says why."""


@dataclass(frozen=True)
class Draft:
    """A structure about its own centre, heading included, not yet put on the table.

    Attributes:
        order: (N,) item indices, place by place.
        offsets: (N, 2) of the footprints' centroids from the centre, by place, metres.
        heights: (N,) z of the bottoms, by place, metres.
        turns: (N,) about z from how each item stands now, by place, radians.
        heading: of the structure frame, radians.
    """

    order: tuple[int, ...]
    offsets: np.ndarray
    heights: np.ndarray
    turns: np.ndarray
    heading: float


class Structure(Protocol):
    """One shape: the objects that it needs, its layout, checks, places, corrections and centre.

    A structure has no state. Methods implemented here are defaults for a flat structure of any objects.

    Attributes:
        name: its name in `grounding.spec.SHAPES`, or that of a figure.
        least: the fewest objects that make one.
        usual_counts: the fewest and the most objects of a drawn scene, unless another number is asked for.
        exact_count: whether a drawn scene has exactly the number of objects that was asked for. `False` where some
            numbers cannot be had, such as a setting of ten cups.
        nouns: the only nouns that have a place in it; `None` for any.
        requirement: which objects suit it (`suits`), in words, for messages.
        stacks: whether objects stand on one another. Such a structure stands or falls by contact, so that its
            demonstrations are built in physics first.
        exact: whether each object has a place to the millimetre. Then the order of building is sought in physics.
        rotation_alters_layout: whether a rotation changes the structure itself and does not only turn it, as the
            opening of a ring. Demonstrations leave it out at times, and no training example hides it.
        rotations: the rotations that a measurement can distinguish.
        sizes: the sizes that objects of a usual width can have.
        smaller_to_fit: whether a smaller size is drawn where an open one was drawn too large for the table.
        often_one_noun: whether the objects share a noun in half of the drawn scenes.
        demonstration_share, crowded_share: how often it is tried for training data, and for data with 8 to 10 objects;
            relative to the other structures. 0 leaves the data of the others as they are.
    """

    name: str
    least: int
    usual_counts: tuple[int, int]
    exact_count: bool = True
    nouns: tuple[str, ...] | None = None
    requirement: str = STANDING
    stacks: bool = False
    exact: bool = False
    rotation_alters_layout: bool = False
    rotations: tuple[str, ...] = ROTATIONS
    sizes: tuple[str, ...] = SIZES
    smaller_to_fit: bool = False
    often_one_noun: bool = False
    demonstration_share: float = 0.0
    crowded_share: float = 0.0

    @property
    def slots(self) -> tuple[str, ...]:
        """Return its legal slots besides the shape."""
        return slots_of(self.name)

    def can_carry(self, spec: StructureSpec) -> bool:
        """Return whether it has every slot that a spec specifies; the spec's own shape, if any, does not matter."""
        return all(slot in ("shape", *self.slots) for slot, _ in spec.tokens())

    # --- objects ----------------------------------------------------------------------------------

    def suits(self, thing: ObjectTraits) -> bool:
        """Return whether an object can take part."""
        return thing.flat_bottom and thing.radius < WIDEST / 2

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose the objects of a drawn scene.

        Args:
            candidates: objects that suit the structure, in random order.
            wanted: how many.
            rng: of any further choice.
            named: whether the nouns were given, so that there is nothing to choose but their number.

        Raises:
            LayoutError: if they cannot make the structure.
        """
        if self.often_one_noun:
            candidates = choose_alike(candidates, wanted, rng, named)
        return choose_first(candidates, wanted, self.name, self.usual_counts[0])

    # --- layout -----------------------------------------------------------------------------------

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw an exact structure that faces `heading` (rad).

        Args:
            items: the objects; the order "listed" is theirs.
            spec: the requested structure.
            heading: that it faces where neither the spec nor a key says otherwise, radians.
            rng: of everything that is open.
            keys: the requested keys.

        Raises:
            LayoutError: if the objects do not suit it, or a key cannot be kept with them.
        """
        ...

    def require_enough(self, items: Sequence[LayoutItem]) -> None:
        """Raise a `LayoutError` for fewer objects than the structure needs."""
        if len(items) < self.least:
            raise LayoutError(f"{a_structure(self.name)} needs {self.least} or more objects, got {len(items)}")

    def order_places(
        self, items: Sequence[LayoutItem], random: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray | None:
        """Order the objects of K samples as in demonstrations: (K, N) item indices, place by place.

        Args:
            items: the N objects.
            random: (K, N) random orders.
            rng: of any further choice.

        Returns:
            `None` if any order will do, so that the random one stands.
        """
        return None

    # --- finished structures ----------------------------------------------------------------------

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check every condition of the evaluation protocol that the spec asks for, but for physics."""
        ...

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the point (2,) to which the position slots refer, metres, world frame."""
        return np.array([body.centroid for body in bodies]).mean(axis=0)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether these bodies face anywhere, so that a rotation can be measured."""
        return True

    # --- keys (evaluation protocol, part two) ------------------------------------------------------

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices along the structure, from one end to the other; of a stack, from the bottom."""
        return list(range(len(bodies)))

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return the pairs of bodies that a requested gap concerns; here each and the next of the sequence."""
        sequence = self.sequence(bodies)
        return list(zip(sequence, sequence[1:]))

    def radius(self, bodies: Sequence[PlacedBody]) -> float:
        """Return its radius, metres, to the centroids; not a number if it has none."""
        return math.nan

    def length(self, bodies: Sequence[PlacedBody]) -> float:
        """Return its length, metres, between the centroids at its ends; not a number if it has none."""
        return math.nan

    def rows_and_columns(self, bodies: Sequence[PlacedBody]) -> tuple[int, int]:
        """Return its numbers of rows and columns; (0, 0) if it has none."""
        return 0, 0

    # --- corrections of what a network sampled ----------------------------------------------------

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves to keep the checks that it misses by little."""
        return np.zeros((len(bodies), 2))

    def turns(self, bodies: Sequence[PlacedBody], heading: float) -> np.ndarray:
        """Return the rotations (N,), radians, of the bodies for a structure that faces `heading` (rad)."""
        return np.zeros(len(bodies))


def choose_first(candidates: Sequence[Traits], wanted: int, name: str, least: int) -> list[Traits]:
    """Return the first candidates.

    Raises:
        LayoutError: if there are fewer than `least` of them.
    """
    if len(candidates) < least:
        raise LayoutError(f"{a_structure(name)} needs {least} or more objects, but only {len(candidates)} can be used")
    return list(candidates[:wanted])


def choose_alike(candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> Sequence[Traits]:
    """Return candidates with a common noun in half of the cases, if there are enough and no nouns were given."""
    if named or rng.random() >= 0.5:
        return candidates
    same = [one for one in candidates if one.category == candidates[0].category]
    return same if len(same) >= wanted else candidates

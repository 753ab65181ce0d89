"""Draw the goals that are built while somebody interferes: those of the goal benchmark with enough to disturb.

Every scene has at least three objects to move, so that two wait while one is in the hand, and one of them is tall, so
that it can be laid on its side, if the library has tall ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from grounding.goals.parts import Part, StructurePart
from structdiffusion.benchmark.goal_families import FAMILIES, Cast, Family, Rng
from structdiffusion.data.scene_sampling import SceneError

LEAST_MOVED = 3


def _structure(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    """Draw one plain structure of three or four objects."""
    return [StructurePart(kind, objects=cast.structure(kind, int(rng.integers(*_SIZES.get(kind, (3, 5))))))]


def _order_or_lengths(cast: Cast, kind: str, rng: Rng) -> list[Part]:
    family = "order" if " by " in kind else "metric"
    return FAMILIES[family][0](cast, kind, rng)


def moved_by(parts: Sequence[Part]) -> set[Any]:
    """Return the indices of the objects that the parts place."""
    return {index for part in parts if isinstance(part.objects, tuple) for index in part.objects}


def _with_enough(family: Family) -> Family:
    """Return a family without the goals that move too few objects."""
    draw, kinds = family

    def checked(cast: Cast, kind: str, rng: Rng) -> list[Part]:
        parts = draw(cast, kind, rng)
        moved = moved_by(parts)
        if len(moved) < LEAST_MOVED:
            raise SceneError(f"only {len(moved)} objects are moved")
        tall = [cast.chosen[index].tall for index in moved]
        if not any(tall) and any(model.tall for model in (*cast.chosen, *cast.free(None))):
            raise SceneError("none of the objects that are moved is tall")
        return parts

    return checked, kinds


# Fewest objects of a structure, and one more than the most, where they are not 3 and 4.
_SIZES: Mapping[str, tuple[int, int]] = {"rectangle": (4, 6), "grid": (4, 6), "tower": (3, 4), "triangle": (3, 4)}
LOOP_FAMILIES: Mapping[str, Family] = {
    name: _with_enough(family)
    for name, family in {
        "flat-structure": (_structure, ("line", "circle", "rectangle", "triangle", "arc", "grid")),
        "tower": (_structure, ("tower",)),
        "two-parts": FAMILIES["two-structures"],
        "related": (FAMILIES["relations"][0], ("3 relations", "4 relations")),
        "order-or-lengths": (
            _order_or_lengths,
            ("line by height", "gap", "tower by height", "length", "line by volume", "radius circle", "arc by height"),
        ),
    }.items()
}

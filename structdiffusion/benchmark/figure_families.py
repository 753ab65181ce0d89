"""Draw the scenes of the benchmark of figures: five ways in which what is asked for differs from the example."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from grounding.figures.names import figure_named, shipped_names
from grounding.goals.parts import Part, StructurePart
from structdiffusion.benchmark.goal_families import Cast, Family, Rng
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.structures import structure_named
from structdiffusion.structures.structure import LayoutError

TRANSFERS = ("same objects", "other objects", "two thirds", "up to twice", "distractors")
BLOCKS = "blocks"  # the library of upright figures: rows of equal objects stand in it
_MORE = 2  # legal numbers beyond the fewest, at which a figure is plain
_NARROW = 0.06  # m of radius of a distractor


@dataclass(frozen=True)
class Counts:
    """Numbers of objects of the example, and of the structure that is asked for.

    Attributes:
        usual: of both, where the number stays.
        fewer: of the example, and about two thirds of it.
        more: of the example, and one and a half to two times as many.
    """

    usual: int
    fewer: tuple[int, int]
    more: tuple[int, int]

    def of(self, transfer: str) -> tuple[int, int]:
        """Return the numbers of the example and of the structure for one of `TRANSFERS`."""
        return {"two thirds": self.fewer, "up to twice": self.more}.get(transfer, (self.usual, self.usual))


# Of legal numbers, those nearest to two thirds, and to one and a half times or more.
COUNTS: Mapping[str, Counts] = {
    "letter T": Counts(6, (6, 4), (6, 9)),
    "letter L": Counts(6, (6, 4), (6, 9)),
    "letter V": Counts(7, (8, 5), (5, 9)),
    "heart": Counts(10, (12, 8), (8, 12)),
    "star": Counts(10, (15, 10), (10, 15)),
    "spiral": Counts(10, (12, 8), (8, 12)),
    "zigzag": Counts(7, (8, 5), (5, 9)),
    "chessboard": Counts(8, (8, 5), (8, 12)),
    "smiley": Counts(7, (9, 6), (6, 9)),
    "gate": Counts(5, (5, 3), (5, 9)),
    "stairs": Counts(6, (10, 6), (6, 10)),
    "brick wall": Counts(5, (9, 6), (5, 9)),
}


def counts_of(name: str) -> Counts:
    """Return the numbers of objects of a figure; of one that is not of the 12 families, the fewest plain ones."""
    if name in COUNTS:
        return COUNTS[name]
    legal = figure_named(name).legal
    usual = legal[min(_MORE, len(legal) - 1)]
    more = next((count for count in legal if count >= 1.5 * usual), legal[-1])
    return Counts(usual, (more, usual), (usual, more))


def _figure(name: str, cast: Cast, kind: str, rng: Rng) -> list[Part]:
    """Draw the objects of a figure, and two more for "distractors"."""
    structure, wanted = structure_named(name), counts_of(name).of(kind)[1]
    pool = [model for model in cast.free(name) if (model.source == BLOCKS) == structure.stacks]
    try:
        models = structure.choose(pool, wanted, rng, named=False)
    except LayoutError as error:
        raise SceneError(str(error)) from error
    if len(models) != wanted:
        raise SceneError(f"only {len(models)} of the objects suit a {name} of {wanted}")
    members = cast.add(models)
    if kind == "distractors":
        for _ in range(2):
            cast.single(lambda model: model.radius < _NARROW)
    return [StructurePart(name, objects=members)]


# The 12 families first, then the other figures of the library: their order counts in every seed.
FIGURE_FAMILIES: Mapping[str, Family] = {
    name: (partial(_figure, name), TRANSFERS) for name in dict.fromkeys((*COUNTS, *shipped_names()))
}

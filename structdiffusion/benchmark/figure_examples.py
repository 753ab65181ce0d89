"""The examples of the benchmark of figures, and the figures that are made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from grounding.figures.figure import Figure
from grounding.figures.growth import FigureBlock
from grounding.figures.names import figure_named
from grounding.spec import StructureSpec
from structdiffusion.benchmark.figure_families import BLOCKS, counts_of
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.data.scene_sampling import SceneError, eligible, layout_item
from structdiffusion.figures.curves import diameter
from structdiffusion.figures.example import Example, Reading, figure_of
from structdiffusion.footprints import turned
from structdiffusion.models.strokes.model import DISTANCE, NEIGHBOURS, TREE, pair_features
from structdiffusion.models.strokes.reading import read_strokes
from structdiffusion.objects.model import ObjectModel
from structdiffusion.structures import structure_named
from structdiffusion.structures.structure import LayoutError

_TRIES = 30
_LONGEST, _BROKEN = 1.6, 2.2  # times the usual step: relative neighbours, and those in the shortest tree, are joined
_FREE = 21  # places along each side of the table at which a copy looks for room


def example_of(scene: GoalScene, library: Sequence[ObjectModel]) -> Example:
    """Return the example of a scene: an exact structure of the scene's objects, or of others of the library.

    Raises:
        SceneError: if none can be laid out.
    """
    name, structure = scene.family, structure_named(scene.family)
    count = counts_of(name).of(scene.kind)[0]
    rng = np.random.default_rng((scene.planning_seed, 1))
    reason = ""
    for _ in range(_TRIES):
        pool = [model for model in eligible(library, name) if (model.source == BLOCKS) == structure.stacks]
        try:
            models = (
                scene.models[:count]
                if scene.kind == "same objects"
                else structure.choose([pool[i] for i in rng.permutation(len(pool))], count, rng, named=False)
            )
            items = [layout_item(model, 0.0) for model in models]
            draft = structure.draft(items, StructureSpec(name), 0.0, rng)
        except LayoutError as error:
            reason = str(error)
            continue
        # The reader stands on the robot's side: right is -y, away is +x.
        outlines = [
            turned(turned(items[i].footprint, by) + at, np.pi / 2)
            for i, by, at in zip(draft.order, draft.turns, draft.offsets)
        ]
        middles = turned(draft.offsets, np.pi / 2)
        return _seen(outlines, middles, draft.heights, [items[i].height for i in draft.order])
    raise SceneError(f"no example of {name!r} with {count} objects: {reason}")


def _seen(
    outlines: Sequence[np.ndarray], middles: np.ndarray, bottoms: np.ndarray, heights: Sequence[float]
) -> Example:
    """Return an example of objects by place, with who rests on whom as it looks."""
    import shapely

    shapes = [shapely.Polygon(outline) for outline in outlines]
    tops = bottoms + np.array(heights)
    rests_on = tuple(
        tuple(
            j
            for j in range(len(shapes))
            if j != i and abs(tops[j] - bottoms[i]) < 0.008 and shapes[i].intersection(shapes[j]).area > 1e-5
        )
        if bottoms[i] > 0.005
        else ()
        for i in range(len(shapes))
    )
    return Example(tuple(outlines), middles, rests_on, bottoms)


def read_by_distance(example: Example) -> Reading:
    """Return what the places of an example show by their distances alone, the plain way that the stroke network has to
    beat.

    The shortest tree joins the objects, and so are relative neighbours, where they are not much farther apart than
    usual. Every object is a corner.
    """
    count = len(example.middles)
    features = pair_features(example.middles, np.zeros((count, count)))
    steps, near, tree = features[..., DISTANCE], features[..., NEIGHBOURS] > 0, features[..., TREE] > 0
    usual = float(np.median(steps[tree]))
    joined = (tree & (steps <= _BROKEN * usual)) | (near & (steps <= _LONGEST * usual))
    return Reading(joined, np.ones(count, bool))


def copied(example: Example, count: int) -> Figure:
    """Return a copy of an example as a template: its places, and nothing of what it shows.

    Of fewer objects each takes one of the places, spread evenly over them; more than there are stand where there is
    room next to the others.
    """
    if any(example.rests_on):
        return _copied_blocks(example, count)
    points = example.middles
    if count < len(points):
        points = points[np.unique(np.linspace(0, len(points) - 1, count).round().astype(int))]
    while len(points) < count:
        low, high = points.min(axis=0), points.max(axis=0)
        step = np.linalg.norm(points[:, None] - points, axis=-1)
        step = float((step + np.diag(np.full(len(points), np.inf))).min())
        around = np.stack(np.meshgrid(*np.linspace(low - step, high + step, _FREE).T), axis=-1).reshape(-1, 2)
        distances = np.linalg.norm(around[:, None] - points, axis=-1).min(axis=1)
        points = np.vstack((points, around[int(np.where(distances >= step, distances, np.inf).argmin())]))
    unit = diameter(points) / 2
    dots = tuple(((float(x), float(y)),) for x, y in (points - points.mean(axis=0)) / unit)
    return Figure("copy", ("copy",), strokes=dots, least=count, numbers=(count,))


def _copied_blocks(example: Example, count: int) -> Figure:
    """Return a copy without the highest blocks, or with more beside it."""
    blocks = list(figure_of(example, "copy", ("copy",), read_by_distance).blocks)
    while len(blocks) > count:
        blocks.pop()
    while len(blocks) < count:
        blocks.append(FigureBlock(0, max(block.x + block.width / 2 for block in blocks) + 0.6))
    return Figure("copy", ("copy",), blocks=tuple(sorted(blocks)), least=count)


# What makes the figure that is built: the example or the name in, the figure out.
METHODS: Mapping[str, Callable[[Example, str, int], Figure]] = {
    "template copy": lambda example, _, count: copied(example, count),
    "curve fit": lambda example, name, _: figure_of(example, name, (name,), read_by_distance),
    "stroke network": lambda example, name, _: figure_of(example, name, (name,), read_strokes),
    "name": lambda _, name, __: figure_named(name),
}

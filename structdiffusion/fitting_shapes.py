"""Say why a structure of some objects does not fit on a table, and what of the same objects does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, estimate
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.layouts import Layout, lay_out, nearest_to_fitting
from structdiffusion.observation import Scene
from structdiffusion.structures import STRUCTURES, structure_named
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.structure import LayoutError, a_structure

_DRAWS = 8  # layouts that are drawn before a structure counts as impossible: order and heading are drawn anew each time
_PLACES = 100  # layouts that all meet what stays where it is, before there counts as no place between; they take 0.1 s
_PLACE_AND_SIZE = ("x_position", "y_position", "rotation", "size")  # slots of which one may be left open instead
_OFFERED = 3  # shapes at most: more are a list that nobody reads
_LIKE = {"line": ("double line",)}  # shape -> figures that come nearest to it


def why_it_does_not_fit(scene: Scene, spec: StructureSpec, rng: np.random.Generator) -> str:
    """Return why a structure of a scene's objects cannot be laid out on its table, empty if it can.

    Of several reasons, the one of the layout that comes nearest to fitting.

    Args:
        scene: the objects, and the distractors, which stay where they are.
        spec: the structure.
        rng: draws the layouts.
    """
    return _problem(_items(scene), spec, scene, rng)


def shapes_that_fit(scene: Scene, spec: StructureSpec, rng: np.random.Generator) -> list[str]:
    """Return other flat shapes in which a scene's objects fit on its table at the same place, and figures like it.

    Args:
        scene: the objects, and the distractors, which stay where they are.
        spec: the structure that does not fit; its place and its size are kept where the other shape can have them.
        rng: draws the layouts.
    """
    items, found, kept = _items(scene), list[str](), replace(spec, rotation=None)
    for name in (*_LIKE.get(spec.shape or "", ()), *STRUCTURES):
        structure = structure_named(name)
        if name == spec.shape or structure.stacks or len(items) < structure.least or not structure.can_carry(kept):
            continue
        if not _problem(items, replace(kept, shape=name), scene, rng):
            found.append(name)
        if len(found) == _OFFERED:
            break
    return found


def values_in_the_way(scene: Scene, spec: StructureSpec, rng: np.random.Generator) -> list[str]:
    """Return the values of slots, such as "left", without any one of which the structure fits.

    Args: as for `shapes_that_fit`.
    """
    items = _items(scene)
    asked = {slot: value for slot in _PLACE_AND_SIZE if (value := getattr(spec, slot)) is not None}
    return [value for slot, value in asked.items() if not _problem(items, replace(spec, **{slot: None}), scene, rng)]


def _items(scene: Scene) -> list[LayoutItem]:
    return [estimate(cloud).layout_item() for cloud in scene.objects]


def _problem(items: Sequence[LayoutItem], spec: StructureSpec, scene: Scene, rng: np.random.Generator) -> str:
    staying = [estimate(cloud) for cloud in scene.distractors]
    reasons, met, widths = list[LayoutError](), Counter[str](), list[float]()
    while len(reasons) < _DRAWS and len(widths) < _PLACES:
        order = rng.permutation(len(items))
        drawn = [items[i] for i in order]
        try:
            layout = lay_out(drawn, spec, scene.table, rng)
        except LayoutError as error:
            reasons.append(error)
            continue
        outlines = [
            turned(item.footprint, yaw) + at for item, yaw, at in zip(drawn, layout.turns, layout.positions[:, :2])
        ]
        in_the_way = [each.name for each in staying if _meets(each, outlines, layout)]
        if not in_the_way:
            return ""
        met.update(in_the_way)
        widths.append(float(np.ptp(np.concatenate(outlines), axis=0).min()))
    if not met:
        return str(nearest_to_fitting(reasons))
    words = [word for word in (spec.size, spec.shape) if word]
    names = ", ".join(name for name, _ in met.most_common())
    return (
        f"{a_structure(' '.join(words))} of these objects is {min(widths):.2f} m wide or more, and at each of "
        f"{len(widths)} places on the table that were tried, it meets what stays where it is: {names}"
    )


def _meets(thing: ObjectEstimate, outlines: Sequence[np.ndarray], layout: Layout) -> bool:
    """Return whether a thing that stays is where an object of a layout would be; outlines (K, 2) seen from above."""
    return any(
        at[2] < thing.height and clear_gap(outline, thing.outline) <= 0.0
        for outline, at in zip(outlines, layout.positions)
    )

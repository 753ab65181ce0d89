"""Say why a structure of some objects does not fit on a table, and which shapes of the same objects do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate
from structdiffusion.layouts import lay_out, nearest_to_fitting
from structdiffusion.observation import Scene
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.structure import LayoutError

_DRAWS = 8  # layouts that are drawn before a structure counts as impossible: order and heading are drawn anew each time
_OFFERED = 3  # shapes at most: more are a list that nobody reads


def why_it_does_not_fit(scene: Scene, spec: StructureSpec, rng: np.random.Generator) -> str:
    """Return why a structure of a scene's objects cannot be laid out on its table, empty if it can.

    Of several reasons, the one of the layout that comes nearest to fitting.

    Args:
        scene: the objects; distractors do not count.
        spec: the structure.
        rng: draws the layouts.
    """
    return _problem(_items(scene), spec, scene, rng)


def shapes_that_fit(scene: Scene, spec: StructureSpec, rng: np.random.Generator) -> list[str]:
    """Return other flat shapes in which a scene's objects fit on its table at the same place.

    Args:
        scene: the objects; distractors do not count.
        spec: the structure that does not fit; its place and its size are kept where the other shape can have them.
        rng: draws the layouts.
    """
    items, found = _items(scene), list[str]()
    for name, structure in STRUCTURES.items():
        if name == spec.shape or structure.stacks:
            continue
        other = replace(spec, shape=name, rotation=None)
        if structure.can_carry(other) and len(items) >= structure.least and not _problem(items, other, scene, rng):
            found.append(name)
        if len(found) == _OFFERED:
            break
    return found


def _items(scene: Scene) -> list[LayoutItem]:
    return [estimate(cloud).layout_item() for cloud in scene.objects]


def _problem(items: Sequence[LayoutItem], spec: StructureSpec, scene: Scene, rng: np.random.Generator) -> str:
    reasons = list[LayoutError]()
    for _ in range(_DRAWS):
        try:
            lay_out([items[i] for i in rng.permutation(len(items))], spec, scene.table, rng)
        except LayoutError as error:
            reasons.append(error)
        else:
            return ""
    return str(nearest_to_fitting(reasons))

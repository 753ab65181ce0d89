"""Say where the objects of an exact copy are not as large as those of the example."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.pipeline.table_goal import TableGoal
from grounding.structure_words import words_of
from structdiffusion.completion.estimate import estimate
from structdiffusion.figures.exact import box_of, fit
from structdiffusion.footprints import outline_centroid

if TYPE_CHECKING:
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene

_SEEN = 0.008  # m: clouds of cubes seem up to 6 mm longer than the cubes are


def describe_sizes(scene: Scene, wanted: StructureSpec | TableGoal, arrangement: Arrangement) -> str:
    """Say by how much the objects of exact copies differ from those of their examples; "" where none does visibly.

    Args:
        scene: with the objects of the arrangement.
        wanted: the goal.
        arrangement: of the scene's objects.
    """
    said = []
    for part in wanted.goal.structures if isinstance(wanted, TableGoal) else ():
        places = () if part.shape is None or (figure := words_of(part.shape).figure) is None else figure.places
        if not places:
            continue
        names = {wanted.names[index] for index in part.objects or ()}  # type: ignore[union-attr, index]
        own = [number for number, cloud in enumerate(scene.objects) if cloud.name in names]
        clouds, motions = [scene.objects[i] for i in own], arrangement.goal_from_initial[own]
        seen = [estimate(cloud) for cloud in clouds]
        outlines = [one.outline_after(motion) for one, motion in zip(seen, motions)]
        middles = np.array([outline_centroid(outline) for outline in outlines])
        boxes = [box_of(outline) for outline in outlines]
        bottoms = np.array([cloud.bottom + motion[2, 3] for cloud, motion in zip(clouds, motions)])
        heights = np.array([one.height - cloud.bottom for one, cloud in zip(seen, clouds)])
        order = fit(middles, bottoms, boxes, heights, places).order
        for place, i in zip(places, order):
            off = np.array((*boxes[i][:2], heights[i])) - place.size
            worst = int(np.abs(off).argmax())
            if abs(off[worst]) > _SEEN:
                more = ("longer", "wider", "higher") if off[worst] > 0 else ("shorter", "narrower", "lower")
                said.append(f"{clouds[i].name} is {abs(off[worst]) * 1000:.0f} mm {more[worst]}")
    return f"not of the example's sizes: {', '.join(said)} than what stands in that place there" if said else ""

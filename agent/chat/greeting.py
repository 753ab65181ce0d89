"""Suggest an instruction that suits the table, so that a user's first attempt works."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from agent.arm.grasps import can_be_grasped
from agent.scenes.limits import MOST_OBJECTS
from grounding.resolve.errors import ResolveError
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import plural
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import eligible, layout_item
from structdiffusion.evaluation_protocol import CLEARANCE
from structdiffusion.footprints import clear_gap, stands_above, turned
from structdiffusion.geometry import tilt_between, yaw_of
from structdiffusion.layouts import lay_out
from structdiffusion.structures.structure import LayoutError

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from structdiffusion.observation import Scene

_FEWEST_OF_A_KIND, _PAIR = 3, 2
_DRAWS = 12  # layouts tried for one instruction
_UPRIGHT = 0.1  # rad: objects tilted by more are left alone
# The instructions to try; the first one that suits the table is suggested.
_SEVERAL = (
    ("put {these} in a small circle on the left", StructureSpec("circle", "small", "left")),
    ("put {these} in a small circle on the right", StructureSpec("circle", "small", "right")),
    ("put {these} in a circle", StructureSpec("circle")),
    ("put {these} in a line on the left", StructureSpec("line", None, "left")),
    ("put {these} in a line", StructureSpec("line")),
)
_TWO = (
    ("stack {these} on the right", StructureSpec("tower", None, "right")),
    ("stack {these} on the left", StructureSpec("tower", None, "left")),
    ("put {these} in a line", StructureSpec("line")),
)


@dataclass(frozen=True)
class Suggestion:
    """A suggested instruction that can be built.

    Attributes:
        text: the instruction.
        spec: its slots.
        objects: the names of the objects that it means.
    """

    text: str
    spec: StructureSpec
    objects: tuple[str, ...]


def suggestion(table: TableScene, scene: Scene) -> Suggestion | None:
    """Return an instruction that suits the present table; `None` if there is none.

    Three or more objects with the same noun form a circle or a line, two form a tower; if no noun is shared, all
    objects take part. The words must select exactly these objects, the hand must be able to grasp each of them,
    nothing may stand on them, and the other objects must leave room for the structure.

    Args:
        table: the objects with their true or completed bodies.
        scene: the observation of them.
    """
    for objects, these, texts in _groups(table):
        if not _free(table, scene, objects):
            continue
        for text, spec in texts:
            said = text.format(these=these)
            if _means(table, these, objects) and _fits(table, spec, objects):
                return Suggestion(said, spec, objects)
    return None


def invitation(suggested: Suggestion | None) -> str:
    """Ask for an instruction, with an example if there is one."""
    return f"Say what to build, for example “{suggested.text}”." if suggested else "Say what to build."


def _groups(table: TableScene) -> Iterator[tuple[tuple[str, ...], str, tuple[tuple[str, StructureSpec], ...]]]:
    """Yield (object names, the words for all of them, the instructions to try), the most promising group first."""
    gone = {*table.fallen, *table.out_of_reach}
    there = [(name, model.category) for name, model in zip(table.names, table.models, strict=True) if name not in gone]
    number = Counter(noun for _, noun in there)
    for noun, count in number.most_common():
        if count >= _PAIR and count < len(there):
            names = tuple(name for name, its in there if its == noun)
            if count <= MOST_OBJECTS:
                yield names, f"the {plural(noun)}", _SEVERAL if count >= _FEWEST_OF_A_KIND else _TWO
    if _PAIR <= len(there) <= MOST_OBJECTS:
        yield tuple(name for name, _ in there), "everything", _SEVERAL if len(there) >= _FEWEST_OF_A_KIND else _TWO


def _means(table: TableScene, words: str, objects: tuple[str, ...]) -> bool:
    gone = {*table.fallen, *table.out_of_reach}
    there = [(name, called) for name, called in zip(table.names, table.display_names, strict=True) if name not in gone]
    try:
        found = resolve_phrase(words, Referents([called for _, called in there])).indices
    except ResolveError:
        return False
    return {there[index][0] for index in found} == set(objects)


def _free(table: TableScene, scene: Scene, objects: tuple[str, ...]) -> bool:
    """Return whether the hand can grasp every object and nothing stands on any of them."""
    clouds = (*scene.objects, *scene.distractors)
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    bottoms = [cloud.bottom for cloud in clouds]
    seen = {cloud.name: index for index, cloud in enumerate(clouds)}
    models, poses = dict(zip(table.names, table.models, strict=True)), table.poses()
    suited = {id(model) for model in eligible(table.models, "circle")}
    return all(
        name in seen
        and id(models[name]) in suited
        and tilt_between(poses[name], np.eye(4)) < _UPRIGHT
        and can_be_grasped(clouds[seen[name]].points, table.arm.hand, bottoms[seen[name]])
        and not any(stands_above(upper, seen[name], outlines, bottoms) for upper in range(len(clouds)))
        for name in objects
    )


def _fits(table: TableScene, spec: StructureSpec, objects: tuple[str, ...]) -> bool:
    """Return whether some layout of the structure stays clear of all other objects."""
    poses = table.poses()
    models = dict(zip(table.names, table.models, strict=True))
    items = [layout_item(models[name], yaw_of(poses[name])) for name in objects]
    others = [
        turned(models[name].footprint, yaw_of(pose)) + pose[:2, 3]
        for name, pose in poses.items()
        if name not in objects
    ]
    rng = np.random.default_rng(0)
    for _ in range(_DRAWS):
        try:
            layout = lay_out(items, spec, table.world.table, rng)
        except LayoutError:
            continue
        places = zip(items, layout.turns, layout.positions, strict=True)
        goals = [turned(item.footprint, turn) + at[:2] for item, turn, at in places]
        if all(clear_gap(goal, other) > CLEARANCE for goal in goals for other in others):
            return True
    return False

"""Find out which objects have to stay where they are because no grasp fits them, before anything is planned."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from agent.arm.grasps import TABLE_LEVEL, can_be_grasped
from agent.arm.hand import Hand
from structdiffusion.completion.surface import completed_scene
from structdiffusion.observation import Scene


def with_fixed(scene: Scene, hand: Hand, hold: str) -> Scene:
    """Return the scene with the objects for which the hand has no grasp as fixed ones, beside those that are.

    What stands on something is left as it is: a structure is laid around what stands on the table.

    Args:
        scene: what was seen.
        hand: what will take them.
        hold: how it holds objects, one of `agent.arm.simulated_arm.HOLDS`.
    """
    held = (
        index
        for index, points in enumerate(cloud.points for cloud in completed_scene(scene).objects)
        if scene.objects[index].bottom < TABLE_LEVEL and not can_be_grasped(points, hand, friction=hold == "friction")
    )
    return replace(scene, fixed=tuple(sorted({*scene.fixed, *held})))


def describe_fixed(scene: Scene, taking: Iterable[int] | None = None) -> str:
    """Say which of the objects that take part stay because no grasp fits them; empty if none does.

    Args:
        scene: the scene `with_fixed` ones.
        taking: the indices of the objects that take part; by default all.
    """
    part = range(len(scene.objects)) if taking is None else set(taking)
    names = [f"the {scene.objects[index].name}" for index in scene.fixed if index in part]
    if not names:
        return ""
    said = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    verb, them = ("stays", "it") if len(names) == 1 else ("stay", "them")
    return f"no grasp fits {said}, so {said} {verb}, and the rest is laid out around {them}"

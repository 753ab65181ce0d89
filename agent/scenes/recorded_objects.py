"""Make bodies of the objects that were found in a recording: completed, named,
and with what the arm can do with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.grasps import can_be_grasped
from agent.errors import UsageError
from agent.perception.segments import Segment, Segments
from agent.recordings.recording import RecordedOptions
from grounding.resolve.attributes import COLOR_WORDS, ObjectAttributes
from grounding.resolve.object_names import read_name
from structdiffusion.completion.bodies import bodies_of
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import ObjectCloud, Table

UNKNOWN = "object"  # the noun of an object that nobody named


@dataclass(frozen=True)
class RecordedObject:
    """One object of a recording and its body in the twin.

    Attributes:
        name: "object 3", or "mug 3" if the user named it.
        display_name: what an instruction can call it: "mug 3, red, tall", if the user or the picture named it.
        attributes: its colour and size, as far as they were seen.
        cloud: its observed cloud.
        model: its completed body.
        world_from_object: (4, 4) where that stands.
        trouble: why the arm cannot grasp it, or empty.
    """

    name: str
    display_name: str
    attributes: ObjectAttributes
    cloud: ObjectCloud
    model: ObjectModel
    world_from_object: np.ndarray
    trouble: str


def recorded_objects(segments: Segments, options: RecordedOptions) -> tuple[RecordedObject, ...]:
    """Return the found objects as bodies that stand on the table without overlap.

    Raises:
        UsageError: for a noun of an object that does not exist.
    """
    names = [found.name for found in segments.objects]
    if unknown := sorted(set(options.nouns) - set(names)):
        raise UsageError(f"--call names {unknown[0]!r}, which was not found; there are: {', '.join(names)}")
    clouds, display_names = [], []
    for found in segments.objects:
        taken = found.noun or UNKNOWN
        said = options.nouns.get(found.name, taken)
        noun = read_name(said).head or said
        name = found.name.replace(UNKNOWN, options.nouns.get(found.name, UNKNOWN), 1)
        clouds.append(ObjectCloud(name, noun, found.points, found.colors, bottom=found.bottom))
        display_names.append(found.display_name.replace(taken, said, 1))
    bodies = bodies_of(clouds, segments.world_from_camera)
    return tuple(
        RecordedObject(cloud.name, words, _attributes(found), cloud, model, pose, _trouble(cloud, pose, segments.table))
        for found, cloud, words, (model, pose) in zip(segments.objects, clouds, display_names, bodies, strict=True)
    )


def called(each: RecordedObject, noun: str) -> RecordedObject:
    """Return an object with another noun, which keeps its number and its other words."""
    number = read_name(each.name).number
    _, comma, words = each.display_name.partition(",")
    category = read_name(noun).head or noun
    return replace(
        each,
        name=f"{noun} {number}",
        display_name=f"{noun} {number}{comma}{words}",
        cloud=replace(each.cloud, name=f"{noun} {number}", category=category),
        model=replace(each.model, category=category),
    )


def _attributes(found: Segment) -> ObjectAttributes:
    """Return the colours that perception named, and the sides of the box that it found."""
    colors = [COLOR_WORDS[each.word][0] for each in found.color_names]
    length, width, height = found.sides.tolist()
    return ObjectAttributes(tuple(colors), (length, width, height))


def _trouble(cloud: ObjectCloud, world_from_object: np.ndarray, table: Table) -> str:
    """Say why the arm cannot grasp an object; empty if it can."""
    if table.overhang(world_from_object[None, :2, 3]) > 0.0:
        return "out of the arm's reach"
    return "" if can_be_grasped(cloud.points, arm_model(DEFAULT_MODEL).hand, cloud.bottom) else "no grasp fits the hand"

"""Load scenes from sources other than arrays: drawn in simulation, from a scene file, or from a recording."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from structagent.arguments import MOST_SEED, checked_integer, checked_pose, shown, wrong_argument
from structagent.engine import computing
from structagent.errors import public_errors
from structagent.instructions import goal_of_text
from structagent.scenes import Scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from agent.recordings.recording import RecordedOptions
    from agent.scenes.table_scene import TableScene

TOPICS = ("points", "depth", "depth_info", "color", "joints")


@public_errors()
def load_scene(
    source: str | os.PathLike[str] = "simulated",
    *,
    instruction: str | None = None,
    objects: str = "ycb",
    seed: int = 0,
    viewpoint: str = "robot",
    at: float | None = None,
    topics: Mapping[str, str] | None = None,
    world_from_camera: ArrayLike | None = None,
    nouns: Mapping[str, str] | None = None,
    depth_unit: float | str | None = None,
) -> Scene:
    """Draw a scene, or load it from a file.

    Args:
        source: "simulated" for one drawn from `objects`; "example" for the recording that comes along; or the path of a
            scene file (.yaml) or of a recording (.bag, .db3, .mcap, .ply, .pcd, a ROS 2 folder, a folder of pictures).
        instruction: draw the scene that `run` draws for this sentence; by default a table to talk about.
        objects: the library to draw from: "ycb", "procedural", "random_urdfs", or a folder of meshes.
        seed: everything drawn at random follows from it, in [0, 2**63).
        viewpoint: whose left and right the instruction means: "robot", or "opposite" for a person across the table.
        at: seconds after a recording's first message; by default the first moment with everything there.
        topics: "points", "depth", "depth_info", "color" or "joints" -> the topic of a recording that has it.
        world_from_camera: (4, 4) pose of a recording's camera, z forward, x right, y down; overrides the recorded one.
        nouns: the nouns of a recording's objects, such as {"object 3": "mug"}.
        depth_unit: metres per stored unit of a recording's depths or coordinates, such as 0.001, or "m", "cm", "mm",
            "0.25mm", "0.1mm" or "tum"; by default the declared one, unless what is seen contradicts it.

    Raises:
        StructagentError: for a source, objects or options that cannot be used, and an instruction that cannot be built.
    """
    checked_source(source, objects)
    seed = checked_integer("seed", seed, 0, MOST_SEED)
    recorded = recorded_options(at, topics, world_from_camera, nouns, depth_unit)
    with computing() as cache:
        origin = cache.source(os.fspath(source), objects, recorded)
        if instruction is None:
            with origin.set_out(seed) as table:
                return _as_seen(table)
        goal = goal_of_text(cache, instruction, viewpoint, origin)
        with origin.open(goal, seed) as table:
            return _as_seen(table)


def _as_seen(table: TableScene) -> Scene:
    seen = table.look()
    clouds = (*seen.objects, *seen.distractors)
    referent = dict(zip(table.names, table.referents, strict=True))
    missing = [f"{name} is left where it is: {why}" for name, why in table.missing.items()]
    for cloud in clouds:
        for array in (cloud.points, cloud.colors):
            if array is not None:
                array.flags.writeable = False
    return Scene(
        tuple(cloud.points for cloud in clouds),
        tuple(cloud.name for cloud in clouds),
        tuple(cloud.colors for cloud in clouds),
        tuple(cloud.bottom for cloud in clouds),
        seen.table,
        seen.color,
        seen.intrinsics,
        seen.world_from_camera,
        tuple(dict.fromkeys((*table.notes, *missing))),
        tuple(cloud.category for cloud in clouds),
        tuple(referent[cloud.name] for cloud in clouds),
    )


def checked_source(source: Any, objects: Any) -> None:
    """Refuse sources and libraries that are no names or paths.

    Raises:
        StructagentError: for an invalid argument; the message names it and the legal values.
    """
    if not isinstance(source, str | os.PathLike) or not os.fspath(source):
        raise wrong_argument(f"the scene cannot be {shown(source)}; legal: simulated, example, or the path of a file")
    if not isinstance(objects, str) or not objects:
        raise wrong_argument(f"objects cannot be {shown(objects)}; legal: the name of a library, or a folder of meshes")


def recorded_options(
    at: Any, topics: Any, world_from_camera: Any, nouns: Any, depth_unit: Any = None
) -> RecordedOptions:
    """Check and return how a recording is read.

    Raises:
        StructagentError: for an invalid moment, topic, pose, noun or unit.
    """
    from agent.errors import UsageError
    from agent.recordings.depth_units import LEGAL, unit_of
    from agent.recordings.recording import ReadingOf, RecordedOptions

    if at is not None and (isinstance(at, bool) or not isinstance(at, int | float) or not 0 <= at < float("inf")):
        raise wrong_argument(f"at cannot be {shown(at)}; legal: seconds after the first message, 0 or more")
    for argument, value, example in (
        ("topics", topics, {"depth": "/camera/depth/image_raw"}),
        ("nouns", nouns, {"object 3": "mug"}),
    ):
        if value is not None and not (
            isinstance(value, Mapping)
            and all(isinstance(part, str) and part for pair in value.items() for part in pair)
        ):
            raise wrong_argument(f"{argument} cannot be {shown(value)}; legal: a dict of texts, such as {example}")
    for what in topics or ():
        if what not in TOPICS:
            raise wrong_argument(f"topics cannot have {what!r}; legal: {', '.join(TOPICS)}")
    pose = None if world_from_camera is None else checked_pose(world_from_camera)
    try:
        unit = None if depth_unit is None or isinstance(depth_unit, bool) else unit_of(depth_unit)
    except (UsageError, TypeError):
        unit = math.nan
    if isinstance(depth_unit, bool) or unit is not None and math.isnan(unit):
        raise wrong_argument(f"depth_unit cannot be {shown(depth_unit)}; legal: {LEGAL}")
    reading = ReadingOf(at, dict(topics or {}), world_from_camera=pose, depth_unit=unit)
    return RecordedOptions(reading, dict(nouns or {}))

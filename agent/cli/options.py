"""Define options that several commands share, and parse their values."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agent.errors import UsageError
from agent.runtime.settings import LIBRARIES, MOST_SEED
from grounding.parse_result import shortened
from structdiffusion.planners.registry import LEGAL_NAMES, PLANNERS, legal_instead_of

if TYPE_CHECKING:
    import numpy as np

    from agent.recordings.recording import ReadingOf, RecordedOptions


class Parsers(StrEnum):
    """The parsers of instructions."""

    embedding = "embedding"
    llm = "llm"


class Viewpoint(StrEnum):
    """The sides of the table from which an instruction can be spoken."""

    robot = "robot"
    opposite = "opposite"


class Hold(StrEnum):
    """The ways in which the hand holds objects."""

    friction = "friction"
    weld = "weld"


def _known_model(name: str) -> str:
    """Check the name of a planner before anything is loaded.

    Raises:
        UsageError: for an unknown name.
    """
    if name not in PLANNERS:
        raise UsageError(f"--model cannot be {name!r}; {legal_instead_of(name)}")
    return name


def _known_models(names: list[str] | None) -> list[str] | None:
    for name in names or ():
        _known_model(name)
    return names


def _known_objects(source: str) -> str:
    """Check the name of an object library, or its folder, before anything is loaded.

    Raises:
        UsageError: for anything else.
    """
    if source in LIBRARIES or source and Path(source).is_dir():
        return source
    near = get_close_matches(source.lower(), LIBRARIES, n=1)
    suggestion = f"did you mean {near[0]!r}? " if near else ""
    raise UsageError(
        f"--objects cannot be {source!r}, which is neither a library nor an existing folder; {suggestion}"
        f"legal: {', '.join(LIBRARIES)}, or a folder of meshes"
    )


def _model_names() -> list[str]:
    return list(PLANNERS)


ObjectsOption = Annotated[
    str,
    typer.Option(
        callback=_known_objects,
        metavar="ycb|procedural|blocks|training|validation|random_urdfs|unseen_urdfs|DIR",
        help="Object library, or a folder of meshes.",
    ),
]
SceneOption = Annotated[
    str,
    typer.Option(
        metavar="simulated|example|FILE|DIR",
        help="Table to use: objects drawn at random (simulated); the included recording (example); a scene "
        "file (.yaml); a recording: a bag (.bag, .db3, .mcap, a ROS 2 folder), a point cloud (.ply, .pcd) or a folder "
        "of colour and depth images.",
    ),
]
ModelOption = Annotated[
    str,
    typer.Option(
        callback=_known_model, autocompletion=_model_names, metavar="NAME", help=f"Planner to use: {LEGAL_NAMES}."
    ),
]
ModelsOption = Annotated[
    list[str] | None,
    typer.Option(
        callback=_known_models,
        autocompletion=_model_names,
        metavar="NAME",
        help=f"Planner to measure: {LEGAL_NAMES}. Repeatable.  [default: diffusion]",
    ),
]
WeightsOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Folder with a checkpoint folder per network; by default the shipped ones."),
]
UnverifiedOption = Annotated[
    bool, typer.Option("--allow-unverified", help="Use networks whose files differ from their model cards.")
]
HoldOption = Annotated[
    Hold,
    typer.Option(
        help="How the hand holds objects: by the fingers' friction alone, or joined to it after contact on both sides."
    ),
]
JACO = "jaco"  # the arm that every command has by default
ArmOption = Annotated[
    str | None,
    typer.Option(
        metavar="jaco|FILE",
        help="Arm that builds: jaco, or the YAML file of another one. With `run --robot`, jaco:NAME is a Jaco whose "
        "driver (kinova-ros) uses another name than the recording or the model. [default: jaco]",
    ),
]
AcceptDrawingsOption = Annotated[
    bool,
    typer.Option(
        "--accept-drawings", help="Build without asking what the language model draws for a name that no figure has."
    ),
]
RECORD_NEEDS_ARM = "--record needs the arm, but --no-execute does not use it; leave out one of them"
RecordOption = Annotated[
    bool,
    typer.Option(
        "--record",
        help="Record the camera, the joints, the fingers and their commands ten times a second while the arm builds, "
        "to recording.npz beside the report; `structagent export` reads it.",
    ),
]
_SOURCES = ("points", "depth", "depth_info", "color", "joints")  # that a recording is read from
PoolOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Worker processes; by default one per core of this machine or the cluster."),
]
RayOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help='Ray cluster that does the work, or "local" to start one here.')
]
SeedOption = Annotated[
    int, typer.Option(metavar="SEED", min=0, max=MOST_SEED, help="Seed of everything that is drawn at random.")
]
ParserOption = Annotated[Parsers, typer.Option(metavar="|".join(Parsers), help="Parser that reads the instruction.")]
ViewpointOption = Annotated[
    Viewpoint,
    typer.Option(
        metavar="|".join(Viewpoint),
        help="Whose left and right the instruction uses: the robot's, or those of a person on the opposite side.",
    ),
]
LLMModelOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Language model: a folder or a name; with --llm-url, its name at the endpoint."),
]
LLMUrlOption = Annotated[
    str | None,
    typer.Option(metavar="URL", help="OpenAI-compatible endpoint; its key is read from STRUCTAGENT_LLM_KEY."),
]
AtOption = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Time in the recording, from its start; by default the first at which everything needed has arrived.",
    ),
]
TopicOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="WHAT=TOPIC",
        help="Topic of a recording to read WHAT from: points, depth, depth_info, color or joints. Repeatable.",
    ),
]
CameraPoseOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z,ROLL,PITCH,YAW",
        help="Pose of the recording's camera in the world: of its optical frame (z forward, x right, y down); m, rad.",
    ),
]
DepthUnitOption = Annotated[
    str | None,
    typer.Option(
        metavar="METRES|NAME",
        help="Unit of a recording's depths or coordinates: metres per stored unit, such as 0.001, or one of "
        "m, cm, mm, 0.25mm, 0.1mm and tum (5000 a metre); by default the declared one, unless what is seen contradicts "
        "it.",
    ),
]
CallOption = Annotated[
    list[str] | None,
    typer.Option(metavar="OBJECT=NOUN", help="Noun for an object of a recording, such as 'object 3=mug'. Repeatable."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else, to standard output.")]
ForceOutOption = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Write to --out even if it holds other files: files with the same names are replaced, the rest is kept.",
    ),
]


def print_error(message: str) -> None:
    """Print one sentence to standard error."""
    print(f"structagent: {message}", file=sys.stderr)


def reading_of(
    at: float | None = None,
    topics: Sequence[str] | None = None,
    camera_pose: str | None = None,
    depth_unit: str | None = None,
) -> ReadingOf:
    """Return how a recording is to be read, from the values of the options.

    Args:
        at: seconds after the first message.
        topics: each "WHAT=TOPIC".
        camera_pose: "X,Y,Z,ROLL,PITCH,YAW" of the camera's optical frame in the world, metres and radians; roll, pitch
            and yaw turn about the world's x, then y, then z, as in a URDF.
        depth_unit: metres per stored unit, or its name.

    Raises:
        UsageError: for an illegal value.
    """
    from agent.recordings.depth_units import unit_of
    from agent.recordings.recording import ReadingOf

    if at is not None and not (math.isfinite(at) and at >= 0):
        raise UsageError(f"--at cannot be {at}; legal: seconds after the first message, 0 or more")
    chosen: dict[str, str] = {}
    for text in topics or ():
        what, _, topic = text.partition("=")
        if what not in _SOURCES or not topic.strip() or what in chosen:
            again = f", and {what} only once" if what in chosen else ""
            raise UsageError(f"--topic cannot be {text!r}; legal: {'=/TOPIC, '.join(_SOURCES)}=/TOPIC{again}")
        chosen[what] = topic.strip()
    pose = None if camera_pose is None else _pose(camera_pose)
    unit = None if depth_unit is None else unit_of(depth_unit)
    return ReadingOf(at, chosen, world_from_camera=pose, depth_unit=unit)


def arm_file(arm: str | None) -> Path | None:
    """Return the file of the arm that `--arm` names, once it has been read; `None` for the Jaco.

    Raises:
        UsageError: if it is neither the Jaco nor a file.
        BadInput: if nothing can be planned for what the file describes.
    """
    if arm is None or arm.partition(":")[0] == JACO:
        return None
    if not Path(arm).is_file():
        raise UsageError(f"--arm cannot be {shortened(arm)!r}; legal: {JACO}, or the YAML file of an arm")
    from agent.arm.arm_file import load_arm

    load_arm(Path(arm))
    return Path(arm)


def recorded_options(
    at: float | None,
    topics: Sequence[str] | None,
    camera_pose: str | None,
    calls: Sequence[str] | None,
    depth_unit: str | None = None,
) -> RecordedOptions:
    """Return how a recorded scene is to be read and named, from the values of the options.

    Args:
        at, topics, camera_pose, depth_unit: as `reading_of`.
        calls: each "OBJECT=NOUN"; the object by its name, "object 3", or its number alone.

    Raises:
        UsageError: for an illegal value.
    """
    from agent.recordings.recording import RecordedOptions

    nouns: dict[str, str] = {}
    for text in calls or ():
        name, _, noun = (part.strip() for part in text.partition("="))
        name = f"object {name}" if name.isdecimal() else name.lower()
        # A number in a noun would be taken for that of an object.
        if not name or name in nouns or not any(map(str.isalpha, noun)) or any(map(str.isdigit, noun)):
            again = ", and each object only once" if name in nouns else ""
            raise UsageError(
                f"--call cannot be {text!r}; legal: an object and a noun without digits, such as 'object 3=mug'{again}"
            )
        nouns[name] = noun
    return RecordedOptions(reading_of(at, topics, camera_pose, depth_unit), nouns)


def _pose(text: str) -> np.ndarray:
    """Return the pose (4, 4) that `--camera-pose` gives."""
    from structdiffusion.geometry import pose_from_xyz_rpy

    numbers = numbers_of(text, 6)
    if numbers is None:
        raise UsageError(
            f"--camera-pose cannot be {text!r}; legal: six numbers X,Y,Z,ROLL,PITCH,YAW in metres and radians, such as "
            "0.02,0,1.05,-2.753,0,-1.571"
        )
    return pose_from_xyz_rpy(numbers[:3], numbers[3:])


def numbers_of(text: str, count: int) -> list[float] | None:
    """Parse `count` finite numbers separated by commas; `None` for any other text."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == count and all(map(math.isfinite, numbers)) else None

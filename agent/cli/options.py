"""Options that several verbs share."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from enum import Enum, StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agent.errors import UsageError
from agent.runtime.settings import LIBRARIES, MOST_SEED
from structdiffusion.planners.registry import PLANNERS, legal_instead_of

if TYPE_CHECKING:
    import numpy as np

    from agent.recordings.recording import ReadingOf, RecordedOptions


class ModelKind(StrEnum):
    """Which network is trained."""

    diffusion = "diffusion"
    structure = "structure"
    collision = "collision"
    cvae = "cvae"
    structformer_circle = "structformer_circle"
    structformer_line = "structformer_line"
    structformer_tower = "structformer_tower"
    structformer_table_setting = "structformer_table_setting"


class Parsers(str, Enum):
    """Who reads the instruction."""

    embedding = "embedding"
    llm = "llm"


class Viewpoint(str, Enum):
    """From which side of the table the instruction is spoken."""

    robot = "robot"
    opposite = "opposite"


def _known_model(name: str) -> str:
    """The name of a planner, before anything is loaded that could use it.

    Raises:
        UsageError: for another name.
    """
    if name not in PLANNERS:
        raise UsageError(f"--model cannot be {name!r}; {legal_instead_of(name)}")
    return name


def _known_models(names: list[str] | None) -> list[str] | None:
    for name in names or ():
        _known_model(name)
    return names


def _known_objects(source: str) -> str:
    """A library or a folder that is there, before anything is loaded from it.

    Raises:
        UsageError: for anything else.
    """
    if source in LIBRARIES or source and Path(source).is_dir():
        return source
    near = get_close_matches(source.lower(), LIBRARIES, n=1)
    meant = f"did you mean {near[0]!r}? " if near else ""
    raise UsageError(
        f"--objects cannot be {source!r}, which is neither a library nor a folder that is there; {meant}"
        f"legal: {', '.join(LIBRARIES)}, or a folder of meshes"
    )


ObjectsOption = Annotated[
    str,
    typer.Option(
        callback=_known_objects,
        metavar="ycb|procedural|training|validation|random_urdfs|DIR",
        help="The objects: a library, or a folder of meshes.",
    ),
]
SceneOption = Annotated[
    str,
    typer.Option(
        metavar="simulated|example|FILE|DIR",
        help="Drawn from the objects; the recording that comes along; a scene file (.yaml); or a recording: a bag "
        "(.bag, .db3, .mcap, a ROS 2 folder), a cloud (.ply, .pcd) or a folder of colour and depth pictures.",
    ),
]
ModelOption = Annotated[
    str, typer.Option(callback=_known_model, metavar="|".join(PLANNERS), help="Who imagines.")
]
PlannerOption = Annotated[str, typer.Option(callback=_known_model, metavar="NAME", help="The planner.")]
PlannersOption = Annotated[
    list[str] | None,
    typer.Option(callback=_known_models, metavar="NAME", help="May be given several times.  [default: diffusion]"),
]
WeightsOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Checkpoints of the networks, one folder each; by default those shipped."),
]
UnverifiedOption = Annotated[
    bool,
    typer.Option("--allow-unverified", help="Take networks whose files are not those that their cards tell of."),
]
_WHAT = ("points", "depth", "depth_info", "color", "joints")  # that a recording is read from
PoolOption = Annotated[
    int | None, typer.Option(min=1, help="Processes; by default one per core, of this machine or the cluster.")
]
RayOption = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help='A Ray cluster that does the work, or "local" for one that is started.'),
]
SeedOption = Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Everything drawn at random follows from it.")]
ParserOption = Annotated[Parsers, typer.Option(help="Who reads the instruction.")]
ViewpointOption = Annotated[
    Viewpoint, typer.Option(help="Whose left and right is meant: the robot's, or that of somebody across the table.")
]
LLMModelOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="A model folder or name; with --llm-url, the endpoint's name for it."),
]
LLMUrlOption = Annotated[
    str | None,
    typer.Option(metavar="URL", help="An OpenAI-compatible endpoint; its key is read from STRUCTAGENT_LLM_KEY."),
]
AtOption = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="The moment of a recording; by default the first with everything there."),
]
TopicOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="WHAT=TOPIC",
        help="Which topic has a recording's points, depth, depth_info, color or joints; may be given several times.",
    ),
]
CameraPoseOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z,ROLL,PITCH,YAW",
        help="Where the recording's camera stood: its optical frame (z forward, x right, y down) in the world; m, rad.",
    ),
]
CallOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="OBJECT=NOUN",
        help="What an object of a recording is, as 'object 3=mug'; may be given several times.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON to standard output, and nothing else.")]


ForceOutOption = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Write into --out even if it holds other files: those of the same names are replaced, the rest stays.",
    ),
]


def complain(message: str) -> None:
    """One sentence on standard error."""
    print(f"structagent: {message}", file=sys.stderr)


def reading_of(
    at: float | None = None, topics: Sequence[str] | None = None, camera_pose: str | None = None
) -> ReadingOf:
    """How a recording is read, from the options that say it.

    Args:
        at: seconds after the first message.
        topics: each "WHAT=TOPIC".
        camera_pose: "X,Y,Z,ROLL,PITCH,YAW" of the camera's optical frame in the world, metres and radians; roll, pitch
            and yaw turn about the world's x, then y, then z, as in a URDF.

    Raises:
        UsageError: for a value that is not legal.
    """
    from agent.recordings.recording import ReadingOf

    if at is not None and not (math.isfinite(at) and at >= 0):
        raise UsageError(f"--at cannot be {at}; legal: seconds after the first message, 0 or more")
    chosen: dict[str, str] = {}
    for text in topics or ():
        what, _, topic = text.partition("=")
        if what not in _WHAT or not topic.strip() or what in chosen:
            again = f", and {what} only once" if what in chosen else ""
            raise UsageError(f"--topic cannot be {text!r}; legal: {'=/TOPIC, '.join(_WHAT)}=/TOPIC{again}")
        chosen[what] = topic.strip()
    return ReadingOf(at, chosen, world_from_camera=None if camera_pose is None else _pose(camera_pose))


def recorded_options(
    at: float | None, topics: Sequence[str] | None, camera_pose: str | None, calls: Sequence[str] | None
) -> RecordedOptions:
    """How a recorded scene is taken, from the options that say it.

    Args:
        at, topics, camera_pose: as `reading_of`.
        calls: each "OBJECT=NOUN"; the object by its name, "object 3", or its number alone.

    Raises:
        UsageError: for a value that is not legal.
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
    return RecordedOptions(reading_of(at, topics, camera_pose), nouns)


def _pose(text: str) -> np.ndarray:
    """The pose (4, 4) of `--camera-pose`."""
    from structdiffusion.geometry import pose_from_xyz_rpy

    numbers = numbers_of(text, 6)
    if numbers is None:
        raise UsageError(
            f"--camera-pose cannot be {text!r}; legal: six numbers X,Y,Z,ROLL,PITCH,YAW in metres and radians, such as "
            "0.02,0,1.05,-2.753,0,-1.571"
        )
    return pose_from_xyz_rpy(numbers[:3], numbers[3:])


def numbers_of(text: str, count: int) -> list[float] | None:
    """So many finite numbers, separated by commas; `None` where the text is anything else."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == count and all(map(math.isfinite, numbers)) else None

"""Options that several verbs share."""

from __future__ import annotations

import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class ModelKind(str, Enum):
    """Which network is trained."""

    diffusion = "diffusion"
    structure = "structure"
    collision = "collision"


class Parsers(str, Enum):
    """Who reads the instruction."""

    embedding = "embedding"
    llm = "llm"


class Viewpoint(str, Enum):
    """From which side of the table the instruction is spoken."""

    robot = "robot"
    opposite = "opposite"


ObjectsOption = Annotated[
    str, typer.Option(metavar="ycb|procedural|random_urdfs|DIR", help="The objects: a library, or a folder of meshes.")
]
ModelOption = Annotated[str, typer.Option(metavar="diffusion|diffusion-tokens|geometric", help="Who imagines.")]
WeightsOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Checkpoints diffusion/, structure/ and collision/; by default those shipped."),
]
MOST_SEED = 2**63 - 1  # what every generator takes
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
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON to standard output, and nothing else.")]


def complain(message: str) -> None:
    """One sentence on standard error."""
    print(f"structagent: {message}", file=sys.stderr)

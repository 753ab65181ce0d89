"""Read the interjections that people may say while the arm builds, and draw the tables on which they are said."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from agent.runtime.yaml_files import load_yaml
from agent.scenes.files import PlacedObject, write_scene
from agent.scenes.object_placement import find_mesh
from agent.scenes.several_parts import scatter
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.geometry import yaw_of

HALVES = ("seen", "unseen")  # those that were looked at while the reader was mended, and those that were not
_SEPARATOR = " | "


@dataclass(frozen=True)
class Saying:
    """Something that is said while the arm builds, and what should come of it.

    Attributes:
        number: in the file, from 0.
        half: one of `HALVES`.
        table: the name of the table.
        instruction: what is being built.
        sentence: what is said.
        outcomes: those of `agent.events.Interjected` that are right; "first" where an object is to be moved next.
        goals: the goals that are right, with "changed"; with "first" the index of the object.
    """

    number: int
    half: str
    table: str
    instruction: str
    sentence: str
    outcomes: tuple[str, ...]
    goals: tuple[str, ...]


@cache
def sayings() -> tuple[Saying, ...]:
    """Read all of them."""
    text = files("agent.evaluation.interjections").joinpath("interjections.tsv").read_text(encoding="utf-8")
    return tuple(
        Saying(
            number, row["half"], row["table"], row["instruction"], row["sentence"],
            tuple(row["outcome"].split(_SEPARATOR)), tuple(filter(None, row["goal"].split(_SEPARATOR))),
        )
        for number, row in enumerate(csv.DictReader(text.splitlines(), delimiter="\t"))
    )  # fmt: skip


@cache
def tables() -> dict[str, dict[str, str]]:
    """Read the tables: name -> the name of each object -> its mesh."""
    return load_yaml(files("agent.evaluation.interjections").joinpath("tables.yaml").read_text(encoding="utf-8"))


def write_table(name: str, rng: np.random.Generator, path: Path) -> None:
    """Draw where the objects of a table stand, and write them to a scene file.

    Raises:
        SceneError: if there is no room for them.
    """
    entries = [PlacedObject(mesh, 0.0, 0.0, name=one) for one, mesh in tables()[name].items()]
    poses = scatter([find_mesh(entry, path.parent)[0] for entry in entries], rng)
    if poses is None:
        raise SceneError(f"there is no room for the objects of {name}")
    placed = [
        replace(entry, x=float(pose[0, 3]), y=float(pose[1, 3]), yaw=math.degrees(yaw_of(pose)))
        for entry, pose in zip(entries, poses, strict=True)
    ]
    write_scene(placed, path, "structagent evaluate steering")

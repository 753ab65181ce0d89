"""Convert the lines of a scene file to objects that stand on the table, and back."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from agent.runtime.progress import report_when_slow
from agent.scenes.files import PlacedObject, Problem, SceneFileError, parse_scene, read_text, rgb
from agent.scenes.validation import StandingObject, problems_of_places
from structdiffusion.geometry import pose_from_xyz_rpy
from structdiffusion.limits import SLOW_BYTES
from structdiffusion.objects.folder import FORMATS, object_from_file
from structdiffusion.objects.libraries import LIBRARIES
from structdiffusion.objects.model import ObjectError, ObjectModel, unique_names
from structdiffusion.observation import Table
from structdiffusion.simulation.world import FALLEN

_DIGITS, _ANGLE_DIGITS = 6, 4  # of metres and degrees in files: a micrometre is far below what matters
_NUMBERED = re.compile(r"^\d+(-[a-z])?_")  # as the YCB scans are: "025_mug", "065-a_cups"


def load_scene(path: Path, table: Table = Table()) -> tuple[StandingObject, ...]:
    """Return the objects of a scene file in order, with their poses.

    Raises:
        SceneFileError: with everything that is wrong with the file: unknown keys, values, meshes that are not there,
            objects off the table, inside each other, of one name, or that would fall.
        BadInput: if there is no such file.
    """
    entries, problems = parse_scene(read_text(path))
    found: list[tuple[PlacedObject, ObjectModel, str | Path]] = []
    missing = [placed for placed in entries if "mesh" in placed.unread]
    for placed in entries:
        if "mesh" in placed.unread:
            continue
        try:
            model, source = find_mesh(placed, path.parent)
            found.append((placed, model, source))
        except ObjectError as error:
            problems.append(Problem(placed.line, str(error)))
            missing.append(placed)
    names = _names([placed.name for placed, _, _ in found], [model.category for _, model, _ in found])
    standing = tuple(
        StandingObject(placed, name, model, pose_of(placed, model), source)
        for (placed, model, source), name in zip(found, names, strict=True)
    )
    problems += problems_of_places(standing, missing, table)
    if problems:
        raise SceneFileError(path, problems)
    return standing


def find_mesh(placed: PlacedObject, folder: Path) -> tuple[ObjectModel, str | Path]:
    """Return the object that an entry of a scene file in `folder` names, and its pose.

    Raises:
        ObjectError: if there is none, or the name is ambiguous.
    """
    source: str | Path
    inside = Path(placed.mesh)
    part = inside.name if inside.parent.suffix.lower() in FORMATS else None  # FILE/NODE
    if part is not None or inside.suffix.lower() in FORMATS:
        file = (folder / (inside if part is None else inside.parent)).resolve()
        if not file.is_file():
            raise ObjectError(f"there is no mesh {placed.mesh!r}, seen from {str(folder)!r}")
        with report_when_slow(f"reading the mesh {str(file)!r}", lambda: file.stat().st_size > SLOW_BYTES):
            model = object_from_file(file, file.stem if part is None else part, placed.noun, part)
        source = file if part is None else file / part
    else:
        source, model = placed.mesh, _of_library(placed.mesh)
    color = rgb(placed.color) if placed.color else None
    return replace(model, category=placed.noun or model.category, color=color or model.color), source


def _of_library(mesh: str) -> ObjectModel:
    library, _, wanted = mesh.partition("/")
    if library not in LIBRARIES or not wanted:
        raise ObjectError(
            f"the mesh {mesh!r} is neither LIBRARY/OBJECT, such as ycb/025_mug, with one of the libraries "
            f"{', '.join(LIBRARIES)}, nor a file that ends in {', '.join(FORMATS)}"
        )
    models = _library(library)
    for said in (
        lambda model: model.name == wanted,
        lambda model: _NUMBERED.sub("", model.name) == wanted,
        lambda model: model.category == wanted,
    ):
        fitting = [model for model in models if said(model)]
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            several = ", ".join(f"{library}/{model.name}" for model in fitting[:6])
            more = f" and {len(fitting) - 6} more" if len(fitting) > 6 else ""
            raise ObjectError(f"the mesh {mesh!r} can be each of {len(fitting)} objects: {several}{more}")
    known = {_NUMBERED.sub("", model.name): model.name for model in models} | {m.name: m.name for m in models}
    near = [known[name] for name in get_close_matches(wanted, known, n=3, cutoff=0.5)] or [models[0].name]
    said_near = ", ".join(f"{library}/{name}" for name in dict.fromkeys(near))
    raise ObjectError(f"there is no mesh {mesh!r} among the {len(models)} objects of {library}; there is {said_near}")


@cache
def _library(name: str) -> tuple[ObjectModel, ...]:
    return tuple(LIBRARIES[name]())


def _names(given: Sequence[str | None], nouns: Sequence[str]) -> list[str]:
    """Name each object: the given name, or its noun, numbered if there are several of it."""
    taken, total, number = {name for name in given if name}, Counter(nouns), Counter[str]()
    names = []
    for name, noun in zip(given, nouns, strict=True):
        number[noun] += 1
        own = name or (noun if total[noun] == 1 and noun not in taken else f"{noun} {number[noun]}")
        while not name and own in taken:
            number[noun] += 1
            own = f"{noun} {number[noun]}"
        taken.add(own)
        names.append(own)
    return names


def pose_of(placed: PlacedObject, model: ObjectModel) -> np.ndarray:
    """Return world_from_object (4, 4) of an object that a file places."""
    angles = [math.radians(angle) for angle in (placed.roll, placed.pitch, placed.yaw)]
    pose = pose_from_xyz_rpy((placed.x, placed.y, placed.z), angles)
    if placed.roll or placed.pitch:  # an upright object's lowest point is its origin
        pose[2, 3] -= lowest_point(model, pose)
    return pose


def placement_of(model: ObjectModel, world_from_object: np.ndarray) -> dict[str, Any]:
    """Return the numbers of a scene file's line that puts an object there, to a micrometre and a ten-thousandth
    degree."""
    turn = world_from_object[:3, :3]
    upward = math.hypot(turn[0, 0], turn[1, 0])
    pitch = math.atan2(-turn[2, 0], upward)
    if upward > 1e-6:
        roll, yaw = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    else:  # its front points straight up or down: roll and yaw turn about the same axis
        roll, yaw = 0.0, math.atan2(-turn[0, 1], turn[1, 1])
    angles = {"yaw": yaw, "roll": roll, "pitch": pitch}
    numbers = {key: round(math.degrees(angle), _ANGLE_DIGITS) + 0.0 for key, angle in angles.items()}
    x, y, z = world_from_object[:3, 3].tolist()
    if numbers["roll"] or numbers["pitch"]:
        z += lowest_point(model, world_from_object)
    # + 0.0 makes -0.0 a zero
    return numbers | {key: round(length, _DIGITS) + 0.0 for key, length in {"x": x, "y": y, "z": z}.items()}


def drawn_objects(
    models: Sequence[ObjectModel], poses: Sequence[np.ndarray], objects: str, names: Sequence[str] | None = None
) -> list[StandingObject]:
    """Convert objects drawn from those of `load_objects(objects)` to objects of a scene file.

    Args:
        models: the objects.
        poses: (4, 4) where each stands.
        objects: their library.
        names: their names; by default their nouns, numbered.
    """
    names = unique_names(models) if names is None else names
    standing = []
    for model, name, pose in zip(models, names, poses, strict=True):
        source = _source_of(model, objects)
        placed = PlacedObject(str(source), name=name, **placement_of(model, pose))
        standing.append(StandingObject(placed, name, model, pose, source))
    return standing


def saved_objects(
    standing: Sequence[StandingObject], world_from_objects: Sequence[np.ndarray], folder: Path
) -> list[PlacedObject]:
    """Return the lines of a scene file in `folder` for objects as they stand now; what fell off the table is left out.

    Args:
        standing: the objects.
        world_from_objects: the pose (4, 4) of each now.
        folder: meshes are named as they are found from there.
    """
    lines = []
    for entry, pose in zip(standing, world_from_objects, strict=True):
        if pose[2, 3] + lowest_point(entry.model, pose) < FALLEN:
            continue
        mesh = entry.source
        if isinstance(mesh, Path):
            mesh = Path(os.path.relpath(mesh, folder.resolve())).as_posix()
        numbers = placement_of(entry.model, pose)
        lines.append(replace(entry.placed, mesh=mesh, name=entry.name, line=0, **numbers))
    return lines


def _source_of(model: ObjectModel, objects: str) -> str | Path:
    """Return the source of an object from `load_objects(objects)`."""
    if objects in LIBRARIES:  # not `model.source`: some libraries consist of objects of others and more
        return f"{objects}/{model.name}"
    assert model.file is not None
    return model.file.resolve()


def lowest_point(model: ObjectModel, pose: np.ndarray) -> float:
    """Return the height of the lowest point of a turned object, metres above its origin."""
    return float((np.concatenate(model.hulls) @ pose[2, :3]).min())

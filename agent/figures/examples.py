"""Read examples of figures: scene files, recordings, reports and sessions of runs, and files of figures themselves."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from agent.errors import BadInput
from agent.reporting.replay import records_of
from agent.reporting.session_reader import read_session
from agent.scenes.files import SUFFIXES
from agent.scenes.object_placement import load_scene
from agent.scenes.sources import RECORDINGS, scene_source
from grounding.figures.figure import Figure, FigureError
from grounding.figures.files import read_figure
from grounding.figures.names import figure_named, is_figure
from structdiffusion.completion.estimate import estimate
from structdiffusion.figures.example import Example, figure_of
from structdiffusion.footprints import outline_centroid, turned
from structdiffusion.geometry import transform_points
from structdiffusion.limits import SESSION_BYTES, read_at_most
from structdiffusion.observation import ObjectCloud

_LYING = 0.01  # m: what is lower lies on the table
_OVER = 1e-5  # m2: outlines that share less stand beside each other
_ALIKE = 0.015  # m: carriers whose tops differ by less carry together


def read_example(path: Path, name: str, nouns: Sequence[str] = ()) -> Figure:
    """Return the figure that a file shows.

    Args:
        path: a figure's file (.toml), a scene file, a recording, or the folder, the report.json or the session.jsonl of
            a run.
        name: of the figure.
        nouns: by which people name it; by default the name.

    Raises:
        BadInput: for a file that is none of these, and a run that did not end with a structure that stands as asked.
        FigureError: for what stands there in no figure.
    """
    nouns = tuple(nouns) or (name,)
    if path.suffix.lower() == ".toml":
        figure = read_figure(path)
        return replace(figure, name=name, nouns=nouns)
    report = _report(path)
    if report is not None and (known := _built_figure(report)) is not None:
        return replace(known, name=name, nouns=nouns)
    try:
        return figure_of(_example(path) if report is None else _of_report(report), name, nouns)
    except FigureError as error:
        raise FigureError(f"{str(path)!r} shows no figure: {error}") from error


def _report(path: Path) -> Mapping[str, Any] | None:
    """Return the report of a run: in its folder, alone, or of the last turn of a session that stood; `None` of another
    file.

    Raises:
        BadInput: for a run that did not end with a structure that stands as asked.
    """
    report = path / "report.json" if path.is_dir() else path
    if path.suffix.lower() == ".jsonl":
        records = [one.report for one in records_of(read_session(path))]
        found: Mapping[str, Any] = (
            [one for one in records if (one["verdict"] or {}).get("success")] or records or [{}]
        )[-1]
    elif report.suffix == ".json" and report.is_file():
        found = _read_json(report)
    else:
        return None
    verdict = found.get("verdict")
    if not verdict or not verdict["success"] or not found.get("chosen") or not found.get("scene"):
        why = f": {verdict['detail']}" if verdict and verdict.get("detail") else ""
        raise BadInput(f"the run in {str(path)!r} did not end with a structure that stands as asked{why}")
    return found


def _built_figure(report: Mapping[str, Any]) -> Figure | None:
    """Return the figure that a run built, where it is one that has a name."""
    parts = ((report.get("parse") or {}).get("goal") or {}).get("parts", [])
    shapes = [part.get("shape") for part in parts if part.get("kind") == "structure"]
    return figure_named(shapes[0]) if len(shapes) == 1 and shapes[0] is not None and is_figure(shapes[0]) else None


def _example(path: Path) -> Example:
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        hulls = [transform_points(one.world_from_object, np.concatenate(one.model.hulls)) for one in load_scene(path)]
        return example_of_points(hulls)
    if path.is_dir() or suffix in RECORDINGS:
        with_table = scene_source(str(path), "ycb").set_out(0)
        try:
            scene = with_table.look()
        finally:
            with_table.world.close()
        return example_of_clouds((*scene.objects, *scene.distractors))
    legal = ", ".join((".toml", *SUFFIXES, *RECORDINGS, "report.json", ".jsonl"))
    raise BadInput(f"{str(path)!r} is no example; legal: the folder of a run, or a file that ends in one of {legal}")


def example_of_points(points: Sequence[np.ndarray]) -> Example:
    """Return the example that objects show.

    Args:
        points: (P, 3) each, of objects where they stand, world frame.
    """
    outlines = [each[ConvexHull(each[:, :2]).vertices, :2] for each in points]
    return _seen(outlines, np.array([float(each[:, 2].min()) for each in points]))


def example_of_clouds(clouds: Sequence[ObjectCloud], motions: np.ndarray | None = None) -> Example:
    """Return the example that seen objects show.

    Args:
        clouds: of the objects.
        motions: (N, 4, 4) of each, world frame, before it is looked at; by default none.
    """
    motions = np.repeat(np.eye(4)[None], len(clouds), axis=0) if motions is None else motions
    outlines = [estimate(cloud).outline_after(motion) for cloud, motion in zip(clouds, motions, strict=True)]
    # Upright ones
    bottoms = [cloud.bottom + float(motion[2, 3]) for cloud, motion in zip(clouds, motions, strict=True)]
    return _seen(outlines, np.array(bottoms))


def _of_report(report: Mapping[str, Any]) -> Example:
    """Return the example that a run built: what it placed, at its goals."""
    outlines, bottoms = [], []
    seen = {each["name"]: each for each in report["scene"]["objects"]}
    for goal in report["chosen"]["goals"]:
        outline = np.array(seen[goal["name"]]["outline"], float).reshape(-1, 2)
        if goal.get("aside") or len(outline) < 3:
            continue
        motion = np.array(goal["goal_from_initial"], float)
        outlines.append(turned(outline, np.arctan2(motion[1, 0], motion[0, 0])) + motion[:2, 3])
        bottoms.append(float(goal["position"][2]) - float(seen[goal["name"]]["position"][2]))
    return _seen(outlines, np.array(bottoms))


def _seen(outlines: Sequence[np.ndarray], bottoms: np.ndarray) -> Example:
    """Return the example of outlines (K, 2) in the world frame, for a reader on the robot's side."""
    if len(outlines) < 2:
        raise FigureError("an example needs two objects or more")
    ours = tuple(turned(outline, np.pi / 2) for outline in outlines)  # right is -y, away is +x
    middles = np.array([outline_centroid(outline) for outline in ours])
    return Example(ours, middles, _carriers(ours, bottoms - min(0.0, float(bottoms.min()))), bottoms)


def _carriers(outlines: Sequence[np.ndarray], bottoms: np.ndarray) -> tuple[tuple[int, ...], ...]:
    """Return for each object those that carry it: the highest of the lower ones under it, by their bottoms."""
    shapes = [shapely.Polygon(outline) for outline in outlines]
    found = list[tuple[int, ...]]()
    for i, bottom in enumerate(bottoms):
        under = [
            j
            for j in range(len(bottoms))
            if bottom > _LYING and bottoms[j] < bottom - _LYING and shapes[i].intersection(shapes[j]).area > _OVER
        ]
        highest = max((bottoms[j] for j in under), default=0.0)
        found.append(tuple(j for j in under if bottoms[j] > highest - _ALIKE))
    return tuple(found)


def _read_json(path: Path) -> Mapping[str, Any]:
    try:
        found = json.loads(read_at_most(path, SESSION_BYTES))
    except (OSError, ValueError) as error:
        raise BadInput(f"{str(path)!r} cannot be read as the report of a run: {error}") from error
    if not isinstance(found, dict) or "schema_version" not in found:
        raise BadInput(f"{str(path)!r} is not the report of a run")
    return found

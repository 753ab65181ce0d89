"""Read examples of figures: scene files, recordings, reports and sessions of runs, and files of figures themselves."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from agent.errors import BadInput
from agent.reporting.replay import records_of
from agent.reporting.run_report import EXAMPLE, RunRecord
from agent.reporting.session_log import RUN_SESSION
from agent.reporting.session_reader import read_session
from agent.reporting.table_model import lengths_of
from agent.runtime.output_ownership import OwnFolder
from agent.scenes.files import SUFFIXES
from agent.scenes.object_placement import load_scene
from agent.scenes.sources import RECORDINGS, scene_source
from grounding.figures.figure import Figure, FigureError
from grounding.figures.files import figure_text, read_figure
from grounding.figures.names import LIKE, figure_named, is_figure
from structdiffusion.completion.estimate import estimate
from structdiffusion.figures.exact import copy_of
from structdiffusion.figures.example import Example, figure_of
from structdiffusion.footprints import outline_centroid, turned
from structdiffusion.geometry import transform_points
from structdiffusion.limits import SESSION_BYTES, read_at_most
from structdiffusion.models.strokes.reading import read_strokes
from structdiffusion.observation import ObjectCloud

_LYING = 0.01  # m: what is lower lies on the table
_OVER = 1e-5  # m2: outlines that share less stand beside each other
_ALIKE = 0.015  # m: carriers whose tops differ by less carry together
_LEVEL = math.radians(3.0)  # an object that leans by more stands on an edge
_EXACT = "an exact copy needs a scene file, a recording, or the folder or session of a run"


def read_example(path: Path, name: str, nouns: Sequence[str] = (), exact: bool = False) -> Figure:
    """Return the figure that a file shows.

    Args:
        path: a figure's file (.toml), a scene file, a recording, or the folder, the report.json or the session.jsonl of
            a run.
        name: of the figure.
        nouns: by which people name it; by default the name.
        exact: whether to keep the places to the millimetre.

    Raises:
        BadInput: for a file that is none of these, and a run that did not end with a structure that stands as asked.
        FigureError: for what stands there in no figure, or for a copy that cannot be exact.
    """
    nouns = tuple(nouns) or (name,)
    if path.suffix.lower() == ".toml":
        figure = read_figure(path)
        if exact and not figure.places:
            raise FigureError(f"{str(path)!r} is a drawing without poses; {_EXACT}")
        return replace(figure, name=name, nouns=nouns)
    record = _record(path)
    known = None if record is None or exact else _built_figure(record.report)
    if known is not None and not known.places:  # a copy is read anew, so that it can grow
        return replace(known, name=name, nouns=nouns)
    try:
        example = _example(path, exact) if record is None else _of_record(record)
        if exact and example.tops is None:
            raise FigureError(f"it has no poses of bodies, because its session.jsonl is not beside it; {_EXACT}")
        return copy_of(example, name, nouns) if exact else figure_of(example, name, nouns, read_strokes)
    except FigureError as error:
        what = "cannot be copied exactly" if exact else "shows no figure"
        raise FigureError(f"{str(path)!r} {what}: {error}") from error


def keep_example(path: Path, exact: bool, folder: OwnFolder) -> str:
    """Write the figure that a file shows to the folder of a run or a chat; return its name in goals, "like FILE".

    Raises:
        BadInput, FigureError: as `read_example`.
    """
    return keep_figure(read_example(path, "example", exact=exact), folder)


def keep_figure(figure: Figure, folder: OwnFolder) -> str:
    """Write a figure to the folder of a run or a chat; return its name in goals, "like FILE"."""
    return f"{LIKE}{folder.write(EXAMPLE, figure_text(figure).encode()).absolute()}"


def _record(path: Path) -> RunRecord | None:
    """Return the record of a run, alone, or of the last turn of a session that stood; `None` of another file.

    Raises:
        BadInput: for a run that did not end with a structure that stands as asked.
    """
    file = path / "report.json" if path.is_dir() else path
    if file.suffix == ".json" and (beside := file.with_name(RUN_SESSION)).is_file() and file.is_file():
        file = beside  # it has the bodies, too
    if file.suffix.lower() == ".jsonl":
        records = records_of(read_session(file))
        stood = [one for one in records if (one.report["verdict"] or {}).get("success")]
        found = (stood or records or [RunRecord()])[-1]
    elif file.suffix == ".json" and file.is_file():
        found = RunRecord()
        found.report |= _read_json(file)
    else:
        return None
    report, verdict = found.report, found.report["verdict"]
    if not verdict or not verdict["success"] or not report["chosen"] or not report["scene"]:
        why = f": {verdict['detail']}" if verdict and verdict.get("detail") else ""
        raise BadInput(f"the run in {str(path)!r} did not end with a structure that stands as asked{why}")
    return found


def _built_figure(report: Mapping[str, Any]) -> Figure | None:
    """Return the figure that a run built, where it is one that has a name."""
    parts = ((report.get("parse") or {}).get("goal") or {}).get("parts", [])
    shapes = [part.get("shape") for part in parts if part.get("kind") == "structure"]
    return figure_named(shapes[0]) if len(shapes) == 1 and shapes[0] is not None and is_figure(shapes[0]) else None


def _example(path: Path, exact: bool) -> Example:
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        placed = load_scene(path)
        if exact and (leaning := [one.name for one in placed if not _is_level(one.world_from_object)]):
            raise FigureError(f"{leaning[0]} leans, and only what stands level can be copied exactly")
        return example_of_points(
            [transform_points(one.world_from_object, np.concatenate(one.model.hulls)) for one in placed]
        )
    if path.is_dir() or suffix in RECORDINGS:
        with_table = scene_source(str(path), "ycb").set_out(0)
        try:
            scene = with_table.look()
        finally:
            with_table.world.close()
        return example_of_clouds((*scene.objects, *scene.distractors))
    legal = ", ".join((".toml", *SUFFIXES, *RECORDINGS, "report.json", ".jsonl"))
    raise BadInput(
        f"{str(path)!r} is not an example; legal: the folder of a run, or a file that ends in one of {legal}"
    )


def example_of_points(points: Sequence[np.ndarray]) -> Example:
    """Return the example that objects show.

    Args:
        points: (P, 3) each, of objects where they stand, world frame.
    """
    outlines = [each[ConvexHull(each[:, :2]).vertices, :2] for each in points]
    bottoms, tops = (np.array([float(pick(each[:, 2])) for each in points]) for pick in (np.min, np.max))
    return _seen(outlines, bottoms, tops)


def example_of_clouds(clouds: Sequence[ObjectCloud], motions: np.ndarray | None = None) -> Example:
    """Return the example that seen objects show.

    Args:
        clouds: of the objects.
        motions: (N, 4, 4) of each, world frame, before it is looked at; by default none.
    """
    motions = np.repeat(np.eye(4)[None], len(clouds), axis=0) if motions is None else motions
    seen = [estimate(cloud) for cloud in clouds]
    outlines = [one.outline_after(motion) for one, motion in zip(seen, motions, strict=True)]
    # Upright ones
    bottoms = np.array([cloud.bottom + float(motion[2, 3]) for cloud, motion in zip(clouds, motions, strict=True)])
    heights = [one.height - cloud.bottom for one, cloud in zip(seen, clouds, strict=True)]
    return _seen(outlines, bottoms, bottoms + heights)


def _of_record(record: RunRecord) -> Example:
    """Return the example that a run built: what it placed, where its bodies came to rest, or else at its goals."""
    report = record.report
    goals = [goal for goal in report["chosen"]["goals"] if not goal.get("aside")]
    bodies = _bodies_at_rest(record)
    if all(goal["name"] in bodies for goal in goals):
        return example_of_points([bodies[goal["name"]] for goal in goals])
    outlines, bottoms = [], []
    seen = {each["name"]: each for each in report["scene"]["objects"]}
    for goal in goals:
        outline = np.array(seen[goal["name"]]["outline"], float).reshape(-1, 2)
        if len(outline) < 3:
            continue
        motion = np.array(goal["goal_from_initial"], float)
        outlines.append(turned(outline, np.arctan2(motion[1, 0], motion[0, 0])) + motion[:2, 3])
        bottoms.append(float(goal["position"][2]) - float(seen[goal["name"]]["position"][2]))
    return _seen(outlines, np.array(bottoms))


def _bodies_at_rest(record: RunRecord) -> dict[str, np.ndarray]:
    """Return the corners (P, 3) of the bodies of a run in its last frame, by name; {} where they are not known."""
    model = record.turn.model
    last = next((view for view in (model or {}).get("views", ()) if view["name"] in ("build", "released")), None)
    if model is None or last is None:
        return {}
    found = {}
    for each, motion in zip(model["objects"], last["frames"][-1]["motions"], strict=True):
        if "vertices" in each:
            rest = np.eye(4) if motion is None else np.vstack((np.reshape(motion, (3, 4)), [0.0, 0.0, 0.0, 1.0]))
            found[each["name"]] = transform_points(rest, lengths_of(each["vertices"]))
    return found


def _seen(outlines: Sequence[np.ndarray], bottoms: np.ndarray, tops: np.ndarray | None = None) -> Example:
    """Return the example of outlines (K, 2) in the world frame, for a reader on the robot's side."""
    if len(outlines) < 2:
        raise FigureError("an example needs two objects or more")
    ours = tuple(turned(outline, np.pi / 2) for outline in outlines)  # right is -y, away is +x
    middles = np.array([outline_centroid(outline) for outline in ours])
    return Example(ours, middles, _carriers(ours, bottoms - min(0.0, float(bottoms.min()))), bottoms, tops=tops)


def _is_level(world_from_object: np.ndarray) -> bool:
    """Return whether an axis of an object is upright: it stands, or lies on a side."""
    return float(np.abs(world_from_object[2, :3]).max()) > math.cos(_LEVEL)


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

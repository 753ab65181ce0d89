"""Every planner of a list on the same scenes: what is missing in the folder is computed, by many workers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from agent import __version__
from agent.errors import UsageError
from agent.evaluation.common import SCHEMA_VERSION, SPOKEN_TO, Place, spoken_scenes
from agent.evaluation.result_store import kept_folder
from agent.evaluation.success.config import Asked
from agent.evaluation.success.failure_images import failure_picture, pictured
from agent.evaluation.success.results_folder import EvaluationFolder
from agent.event_base import json_value
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.runtime.atomic_files import write_whole
from agent.runtime.progress import progress
from agent.runtime.worker_pool import Workforce, workforce
from grounding.spec import SHAPES
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.benchmark.success import Evaluation, Row, lost_row, solve
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import WORKER_DIED, Lost
from structdiffusion.planners.registry import PLANNERS


def measure_success(
    asked: Asked,
    models: Sequence[str],
    structures: Sequence[str],
    scenes: int,
    *,
    workers: int | None = None,
    ray: str | None = None,
    out: Path | None = None,
    pictures: int = 5,
) -> dict[str, Any]:
    """Success, failure classes and success@k of each planner on the same scenes, JSON-ready.

    Args:
        asked: the options that every row depends on.
        models: names of planners.
        structures: which of the four.
        scenes: how many per structure.
        workers: processes; `None` for one per core.
        ray: the address of a Ray cluster whose workers do it, or `None` for processes of this machine.
        out: a folder that keeps what is found out, in which the same command goes on where it was stopped, and another
            one may add models and scenes; the report is then of all that it holds. `None` keeps nothing.
        pictures: the most pictures of failures per model and failure class.

    Raises:
        UsageError: for an unknown model or structure, more arrangements to be tried than candidates, a folder that was
            made with other options, or a cluster that does not answer.
        BadInput: for a folder that cannot be written to.
        SceneError: when there is no scene to be drawn of these objects.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that are not what their cards say, unless that is allowed.
    """
    if asked.top_k > asked.candidates:
        raise UsageError(
            f"--top-k cannot be {asked.top_k} with --candidates {asked.candidates}; legal: 1 to {asked.candidates}"
        )
    models, structures = list(dict.fromkeys(models)), [shape for shape in SHAPES if shape in structures]
    for name in models:  # an unknown name or a broken checkpoint is known before any scene is drawn
        checked_planner(name, asked.weights, asked.allow_unverified)
    conditions, library = asked.conditions, load_objects(asked.objects)
    places = [(shape, number) for number in range(scenes) for shape in structures]
    started = time.perf_counter()
    with (
        kept_folder(out) as path,
        EvaluationFolder(path, asked.fingerprint(library, models)) as kept,
        workforce(workers, ray) as force,
    ):
        missing = [(name, place) for place in places for name in models if not kept.has(name, place)]
        draw = partial(_drawn, asked.seed, conditions)
        drawn, undrawn = _draw_scenes(kept, force, draw, library, list(dict.fromkeys(p for _, p in missing)))
        spoken = spoken_scenes(list(drawn.values()), heard=True) if drawn else []
        told = {(scene.structure, scene.number): scene for scene in spoken}
        jobs = [(name, told[place]) for name, place in missing if place in told]
        # A worker's current folder may be another one.
        there = replace(asked, weights=asked.weights and asked.weights.absolute())
        with progress("rows", len(jobs)) as tell:
            for row in force.do(partial(_row, there), ResourceCache, (), jobs):
                if isinstance(row, Lost):
                    name, scene = row.job
                    row = _lost(asked, name, (scene.structure, scene.number), row.reason)
                kept.add_row(row)
                tell(row["failure"] != WORKER_DIED)
        for name, place in missing:
            if place in undrawn:
                kept.add_row(_lost(asked, name, place, undrawn[place]))
        seconds = round(time.perf_counter() - started, 1)
        resources = {"workers": force.count, "ray": ray is not None, "rows": len(jobs), "seconds": seconds}
        if out is not None:
            wanted = {name: row for name, row in pictured(kept.rows.values(), pictures) if not (path / name).exists()}
            lacking = {(row["structure"], row["number"]) for row in wanted.values()} - drawn.keys()
            drawn |= _draw_scenes(kept, force, draw, library, sorted(lacking))[0]
            _draw_pictures(path, force, drawn, wanted)
        return _report(asked, kept, resources)


def _draw_scenes(
    kept: EvaluationFolder,
    force: Workforce,
    draw: Callable[[Sequence[ObjectModel], tuple[Place, int | None]], EvaluationScene],
    library: Sequence[ObjectModel],
    places: Sequence[Place],
) -> tuple[dict[Place, EvaluationScene], dict[Place, str]]:
    """The scenes of these places, in their order; and of those where a worker died, why."""
    jobs = [(place, kept.draws.get(place)) for place in places]
    scenes, undrawn = {}, {}
    with progress("scenes drawn", len(jobs)) as tell:
        for scene in force.do(draw, tuple, (tuple(library),), jobs):
            if isinstance(scene, Lost):
                undrawn[scene.job[0]] = scene.reason
                tell(False)
                continue
            kept.add_scene(scene)
            scenes[scene.structure, scene.number] = scene
            tell()
    return {place: scenes[place] for place in places if place in scenes}, undrawn


def _lost(asked: Asked, name: str, place: Place, reason: str) -> Row:
    return {"model": name, **lost_row(*place, asked.seed, reason)}


def _drawn(
    seed: int, conditions: Any, library: Sequence[ObjectModel], job: tuple[Place, int | None]
) -> EvaluationScene:
    (shape, number), accepted = job
    return draw_evaluation_scene(library, shape, number, seed=seed, conditions=conditions, accepted=accepted)


def _row(asked: Asked, loaded: ResourceCache, job: tuple[str, EvaluationScene]) -> Row:
    """A planner on a scene. One that is not spoken to is told the true slots."""
    name, scene = job
    scene = scene if name in SPOKEN_TO else replace(scene, heard=None)
    planner = loaded.planner(name, asked.weights, asked.allow_unverified)
    result = solve(planner, scene, candidates=asked.candidates_of(name), top_k=asked.top_k)
    return json_value({"model": name, **result.to_dict()})


def _draw_pictures(
    folder: Path,
    force: Workforce,
    scenes: dict[Place, EvaluationScene],
    wanted: dict[str, Row],
) -> None:
    places = {name: (row["structure"], row["number"]) for name, row in wanted.items()}
    jobs = [(name, row, scenes[places[name]]) for name, row in wanted.items() if places[name] in scenes]
    with progress("pictures", len(jobs)) as tell:
        for picture in force.do(_picture, tuple, (), jobs):
            if isinstance(picture, Lost):  # the same command again draws it
                tell(False)
                continue
            name, content = picture
            write_whole(folder / name, content)
            tell()


def _picture(_: object, job: tuple[str, Row, EvaluationScene]) -> tuple[str, bytes]:
    name, row, scene = job
    return name, failure_picture(scene, row)


def _report(asked: Asked, kept: EvaluationFolder, resources: dict[str, Any]) -> dict[str, Any]:
    """All that the folder holds, each model's rows in the order of the scenes."""
    models = [name for name in PLANNERS if any(name == row["model"] for row in kept.rows.values())]
    structures = [shape for shape in SHAPES if any(shape == row["structure"] for row in kept.rows.values())]
    scenes = 1 + max((row["number"] for row in kept.rows.values()), default=0)
    evaluations = []
    for name in models:
        rows = [row for row in kept.rows.values() if row["model"] == name]
        rows.sort(key=lambda row: (SHAPES.index(row["structure"]), row["number"]))
        about = {"model": name, "objects": asked.objects, "seed": asked.seed, "candidates": asked.candidates_of(name)}
        evaluations.append(Evaluation(tuple(rows), asked.top_k, about).to_dict())
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": asked.command(models, structures, scenes),
        "resources": resources,
        "evaluations": evaluations,
    }


def checked_structures(names: Sequence[str] | None) -> tuple[str, ...]:
    """The structures of these names; all four where there is none.

    Raises:
        UsageError: for an unknown one.
    """
    for name in names or ():
        if name not in SHAPES:
            raise UsageError(f"--structure cannot be {name!r}; legal values: {', '.join(SHAPES)}")
    return tuple(names or SHAPES)

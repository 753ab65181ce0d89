"""Measure the success of planners on the same scenes: rows that are missing in the folder are computed by workers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from agent.errors import UsageError
from agent.evaluation.report import report_frame
from agent.evaluation.result_store import store_folder
from agent.evaluation.rows import Place, add_rows
from agent.evaluation.scenes import SENTENCE_PLANNERS, with_sentences
from agent.evaluation.success.config import SuccessConfig
from agent.evaluation.success.failure_images import failure_picture, pictured
from agent.evaluation.success.results_folder import EvaluationFolder
from agent.event_base import json_value
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.runtime.progress import progress
from agent.runtime.worker_pool import Workforce, workforce
from grounding.atomic_files import write_whole
from grounding.spec import FIRST_SHAPES, SHAPES
from structdiffusion.benchmark.scenes import Conditions, EvaluationScene, draw_evaluation_scene
from structdiffusion.benchmark.success import Evaluation, Row, lost_row, solve
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.planners.registry import PLANNERS


def measure_success(
    config: SuccessConfig,
    models: Sequence[str],
    structures: Sequence[str],
    scenes: int,
    *,
    workers: int | None = None,
    ray: str | None = None,
    out: Path | None = None,
    pictures: int = 5,
) -> dict[str, Any]:
    """Measure success, failure classes and success@k of each planner on the same scenes; return a JSON-ready report.

    Args:
        config: the options on which every row depends.
        models: names of planners.
        structures: which of the four.
        scenes: number per structure.
        workers: processes; `None` for one per core.
        ray: address of a Ray cluster that does the work; `None` for processes of this machine.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add planners and scenes; the report is of all rows in it. `None` stores nothing.
        pictures: the largest number of failure pictures per planner and failure class.

    Raises:
        UsageError: for an unknown planner or structure, more tries than candidates, a folder of another evaluation, or
            a cluster that does not answer.
        BadInput: for a folder that cannot be written to.
        SceneError: if no scene can be drawn from these objects.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    if config.top_k > config.candidates:
        raise UsageError(
            f"--top-k cannot be {config.top_k} with --candidates {config.candidates}; legal: 1 to {config.candidates}"
        )
    models, structures = list(dict.fromkeys(models)), [shape for shape in SHAPES if shape in structures]
    for name in models:  # an unknown name or a broken checkpoint is reported before any scene is drawn
        checked_planner(name, config.weights, config.allow_unverified)
    conditions, library = config.conditions, load_objects(config.objects)
    places = [(shape, number) for number in range(scenes) for shape in structures]
    started = time.perf_counter()
    with (
        store_folder(out) as path,
        EvaluationFolder(path, config.fingerprint(library, models)) as store,
        workforce(workers, ray) as force,
    ):
        work = _Work(config, store, force, library, conditions)
        missing = [(name, place) for place in places for name in models if not store.has(name, place)]
        count, drawn = _add_missing_rows(work, missing)
        seconds = round(time.perf_counter() - started, 1)
        resources = {"workers": force.count, "ray": ray is not None, "rows": count, "seconds": seconds}
        if out is not None:
            _add_pictures(work, drawn, pictures)
        return _report(config, store, resources)


@dataclass(frozen=True)
class _Work:
    """What all steps of an evaluation need."""

    config: SuccessConfig
    store: EvaluationFolder
    force: Workforce
    models: Sequence[ObjectModel]
    conditions: Conditions


def _add_missing_rows(work: _Work, missing: Sequence[tuple[str, Place]]) -> tuple[int, dict[Place, EvaluationScene]]:
    """Draw the scenes of the missing rows, solve them and store the rows.

    Returns:
        The number of rows that were computed, and the scenes.
    """
    config = work.config
    drawn, undrawn = _draw_scenes(work, list(dict.fromkeys(place for _, place in missing)))
    scenes = {(scene.structure, scene.number): scene for scene in with_sentences(list(drawn.values()), parsed=True)}
    jobs = [(name, scenes[place]) for name, place in missing if place in scenes]
    # A worker's current folder may be another one.
    absolute = replace(config, weights=config.weights and config.weights.absolute())
    results = work.force.do(partial(_solve_scene, absolute), ResourceCache, (), jobs)
    add_rows(work.store.add_row, results, partial(_lost_job_row, config), "rows", len(jobs))
    for name, place in missing:
        if place in undrawn:
            work.store.add_row(_lost_row(config, name, place, undrawn[place]))
    return len(jobs), drawn


def _draw_scenes(work: _Work, places: Sequence[Place]) -> tuple[dict[Place, EvaluationScene], dict[Place, str]]:
    """Draw the scenes of these places.

    Returns:
        The scenes in the order of the places, and the reason for each place whose worker died.
    """
    jobs = [(place, work.store.draws.get(place)) for place in places]
    draw = partial(_draw_scene, work.config.seed, work.conditions)
    scenes, undrawn = {}, {}
    with progress("scenes drawn", len(jobs)) as advance:
        for scene in work.force.do(draw, tuple, (tuple(work.models),), jobs):
            if isinstance(scene, Lost):
                undrawn[scene.job[0]] = scene.reason
            else:
                work.store.add_scene(scene)
                scenes[scene.structure, scene.number] = scene
            advance(not isinstance(scene, Lost))
    return {place: scenes[place] for place in places if place in scenes}, undrawn


def _lost_job_row(config: SuccessConfig, lost: Lost) -> Row:
    name, scene = lost.job
    return _lost_row(config, name, (scene.structure, scene.number), lost.reason)


def _lost_row(config: SuccessConfig, name: str, place: Place, reason: str) -> Row:
    return {"model": name, **lost_row(*place, config.seed, reason)}


def _draw_scene(
    seed: int, conditions: Conditions, library: Sequence[ObjectModel], job: tuple[Place, int | None]
) -> EvaluationScene:
    (shape, number), accepted = job
    return draw_evaluation_scene(library, shape, number, seed=seed, conditions=conditions, accepted=accepted)


def _solve_scene(config: SuccessConfig, cache: ResourceCache, job: tuple[str, EvaluationScene]) -> Row:
    """Let a planner solve a scene; return its row. A planner that gets no sentence gets the true slots."""
    name, scene = job
    scene = scene if name in SENTENCE_PLANNERS else replace(scene, parsed=None)
    planner = cache.planner(name, config.weights, config.allow_unverified)
    result = solve(planner, scene, candidates=config.candidates_of(name), top_k=config.top_k)
    return json_value({"model": name, **result.to_dict()})


def _add_pictures(work: _Work, drawn: Mapping[Place, EvaluationScene], most: int) -> None:
    """Draw the pictures of failures that are missing in the folder."""
    folder = work.store.path
    wanted = {name: row for name, row in pictured(work.store.rows.values(), most) if not (folder / name).exists()}
    places = {name: (row["structure"], row["number"]) for name, row in wanted.items()}
    scenes = {**drawn, **_draw_scenes(work, sorted(set(places.values()) - drawn.keys()))[0]}
    jobs = [(name, row, scenes[places[name]]) for name, row in wanted.items() if places[name] in scenes]
    with progress("pictures", len(jobs)) as advance:
        for picture in work.force.do(_draw_picture, tuple, (), jobs):
            if not isinstance(picture, Lost):  # the same command draws a lost one again
                name, content = picture
                write_whole(folder / name, content)
            advance(not isinstance(picture, Lost))


def _draw_picture(_: object, job: tuple[str, Row, EvaluationScene]) -> tuple[str, bytes]:
    name, row, scene = job
    return name, failure_picture(scene, row)


def _report(config: SuccessConfig, store: EvaluationFolder, resources: dict[str, Any]) -> dict[str, Any]:
    """Return the report of all stored rows, each planner's in the order of the scenes."""
    rows = list(store.rows.values())
    models = [name for name in PLANNERS if any(name == row["model"] for row in rows)]
    structures = [shape for shape in SHAPES if any(shape == row["structure"] for row in rows)]
    scenes = 1 + max((row["number"] for row in rows), default=0)
    return {
        **report_frame(config.command(models, structures, scenes), len(rows), config.seed),
        "resources": resources,
        "evaluations": list(_evaluations(config, models, rows)),
    }


def _evaluations(config: SuccessConfig, models: Sequence[str], rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    for name in models:
        own = [row for row in rows if row["model"] == name]
        own.sort(key=lambda row: (SHAPES.index(row["structure"]), row["number"]))
        candidates = config.candidates_of(name)
        about = {"model": name, "objects": config.objects, "seed": config.seed, "candidates": candidates}
        yield Evaluation(tuple(own), config.top_k, about).to_dict()


def checked_structures(names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the structures of these names; the first four if there are none.

    Raises:
        UsageError: for an unknown one.
    """
    for name in names or ():
        if name not in SHAPES:
            raise UsageError(f"--structure cannot be {name!r}; legal values: {', '.join(SHAPES)}")
    return tuple(names or FIRST_SHAPES)

"""Measure which objects are found in bags of simulated scenes, and the effect on runs: `structagent evaluate
recordings`.

Each scene is simulated, recorded into a bag, and perceived from there: the masks of the objects are compared with those
of the simulation. Then the same instruction is carried out twice: in simulation, on the true objects, and on the
recording, with its digital twin. Everything on the table takes part, so that no object names are needed; only the
objects of a table setting are named for the recording, as a user would with `--call`.

Plain scenes have objects that stand apart, recorded by the simulation's own camera. Hard scenes (`hard_scenes`) have
stacks, touching and hidden objects, seen from four sides by three sensors.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

import numpy as np

import agent.arm
import agent.perception
import agent.recordings
import agent.scenes
import grounding
from agent import events
from agent.errors import exit_code_of, one_sentence
from agent.evaluation.hard_scenes import condition_of, hard_scene
from agent.evaluation.recorded_masks import RecordingJob, compare_masks, record_job
from agent.evaluation.report import (
    REPORT,
    command_line,
    interval,
    missing_note,
    print_footer,
    print_table,
    rate_of,
    report_by_structure,
    report_frame,
)
from agent.evaluation.result_store import fingerprint
from agent.evaluation.rows import LOST, Place, Row, lost_count, measured, stored_scene_rows
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, run_instruction
from agent.recordings.recording import RecordedOptions
from agent.rendering.text import number
from agent.runtime.worker_pool import Workforce
from agent.scenes.digital_twin import RecordedSource
from agent.scenes.files import SceneFileError
from grounding.corpus.grammar import sentences
from grounding.resolve.tokens import words_of
from grounding.resolve.word_forms import FORMS
from grounding.spec import FIRST_SHAPES, SHAPES
from structdiffusion.data.scene_sampling import SceneError, draw_scene, full_spec
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.worker_process import WORKER_DIED

_DRAWS = 200
_CONDITIONS = ("kind", "side", "sensor")  # keys of a row about a hard scene
_PACKAGES = (agent.arm, agent.recordings, agent.perception, agent.scenes, grounding)  # whose code decides the rows


@dataclass(frozen=True)
class _HardJob:
    """A hard scene to draw and measure; drawing it takes as long as looking at it."""

    structure: str
    number: int
    seed: int


def measure_recordings(
    objects: str,
    model: str,
    weights: Path | None,
    count: int,
    seed: int,
    execute: bool,
    *,
    hard: bool = False,
    workers: int | None = None,
    out: Path | None = None,
    allow_unverified: bool = False,
) -> Row:
    """Measure masks and verdicts over `count` scenes of each structure; return a JSON-ready report.

    Args:
        objects: as for `load_objects`.
        model: the planner.
        weights: folder of its checkpoints; `None` for the shipped ones.
        count: scenes per structure.
        seed: of scenes, sensor noise, sampling and planning.
        execute: build with the arm, or only check each goal without it.
        hard: hard scenes instead of plain ones.
        workers: processes; `None` for one per core, 0 for this process alone.
        out, allow_unverified: as for `measure_arm`.

    Raises: as `measure_arm`.
    """
    # An unknown name or a broken checkpoint is reported before any scene is drawn.
    checked_planner(model, weights, allow_unverified)
    library = load_objects(objects)
    options = {"objects": objects, "model": model, "seed": seed, "execute": execute, "hard": hard}
    config = {"evaluation": "recordings"} | fingerprint(options, library, [model], weights, _PACKAGES)
    run = RunOptions(objects=objects, model=model, weights=weights, execute=execute, allow_unverified=allow_unverified)

    def compute(force: Workforce, missing: Sequence[Place]) -> Iterable[Row | Lost]:
        if hard:
            hard_jobs = [_HardJob(*place, seed) for place in missing]
            return force.do(partial(_compare_hard_runs, run), ResourceCache, (), hard_jobs)
        jobs = [draw_job(library, objects, place, seed) for place in missing]
        return force.do(partial(_compare_runs, run), ResourceCache, (), jobs)

    places = [(shape, number) for number in range(count) for shape in FIRST_SHAPES]
    rows = stored_scene_rows(
        compute, config, places, seed, what="scenes recorded", files=(REPORT,), workers=workers, out=out
    )
    command = command_line(
        "recordings", objects=objects, scenes=count, seed=seed, model=model, weights=weights, no_execute=not execute,
        allow_unverified=allow_unverified, difficulty="hard" if hard else None,
    )  # fmt: skip
    report = report_by_structure(report_frame(command, len(rows), seed, _PACKAGES), rows, _rates)
    if hard:
        report["by_condition"] = {
            f"{key}: {value}": _rates([row for row in rows if row.get(key) == value])
            for key in _CONDITIONS for value in dict.fromkeys(row[key] for row in rows if key in row)
        }  # fmt: skip
    return report


def print_recordings(report: dict[str, Any], results: TextIO) -> None:
    """Print the table: a row per structure."""
    lost = report["aggregate"]["all"]["lost"]
    head = ["structure", "n", "exact", "mask IoU", "simulated", "recorded", "same", "95 %", "seconds to objects"]
    table = [head + ([WORKER_DIED] if lost else [])]
    for structure, rates in (report["aggregate"] | report.get("by_condition", {})).items():
        counts = [str(rates[key]["count"]) for key in ("simulated", "recorded", "same")]
        cells = [structure, str(rates["n"]), str(rates["exact"]["count"]), number(rates["iou"], 3), *counts]
        cells += [interval(rates["same"]), number(rates["seconds"], 2)]
        table.append(cells + ([str(rates["lost"])] if lost else []))
    print_table(table, results)
    print_footer(report, results, missing_note(lost, "scene"))


def draw_job(library: Sequence[ObjectModel], objects: str, place: Place, seed: int) -> RecordingJob:
    """Draw a scene in which every object takes part and is seen by the camera."""
    structure, count = place
    for draw in range(_DRAWS):
        rng = np.random.default_rng((seed, SHAPES.index(structure), count, draw))
        try:
            drawn = draw_scene(library, full_spec(structure, rng), rng, distractors=0)
            return RecordingJob(structure, count, seed, drawn)
        except SceneError:
            continue
    raise SceneError(f"no {structure} could be drawn from {objects} in {_DRAWS} attempts")


def _compare_hard_runs(options: RunOptions, cache: ResourceCache, job: _HardJob) -> Row:
    """Draw a hard scene, and do as `_compare_runs`; the row also has what makes the scene hard.

    Raises:
        SceneError: if the library has no objects for such a scene.
    """
    library, shape = load_objects(options.objects), SHAPES.index(job.structure)
    condition = condition_of(shape, job.number)
    for draw in range(_DRAWS):
        # Another stream than that of plain scenes.
        rng = np.random.default_rng((job.seed, shape, job.number, draw, 1))
        try:
            drawn = draw_scene(library, full_spec(job.structure, rng), rng, distractors=0)
            hard = hard_scene(drawn, condition, rng)
        except SceneError:
            continue
        try:
            row = _compare_runs(options, cache, RecordingJob(job.structure, job.number, job.seed, drawn, hard))
        except SceneFileError:
            continue  # its objects fall within a second: no scene file holds it
        return row | dict(zip(_CONDITIONS, (condition.kind, condition.side, condition.sensor.name), strict=True))
    raise SceneError(f"no {condition.kind} {job.structure} could be drawn from {options.objects} in {_DRAWS} attempts")


def _compare_runs(options: RunOptions, cache: ResourceCache, job: RecordingJob) -> Row:
    """Record one scene, perceive it, and build it in simulation and on the recording; return its row."""
    drawn, seed = job.drawn, job.seed * 10_000 + job.number
    options = replace(options, seed=seed)
    wordings = [words for words in sentences(drawn.spec) if FORMS.keys().isdisjoint(words_of(words))]
    words = wordings[job.number % len(wordings)]
    row: Row = {
        "structure": job.structure,
        "number": job.number,
        "seed": seed,
        "words": words,
        "objects": [each.name for each in drawn.models],
    }
    with TemporaryDirectory() as name:
        recording = record_job(job, options.objects, seed, Path(name))
        row["simulated"] = _failure(words, replace(options, scene=str(recording.scene)), cache)
        began = time.perf_counter()
        try:
            source = RecordedSource(recording.bag)
        except Exception as error:
            if exit_code_of(error) is None:
                raise
            reason = one_sentence(error)
            row |= {"found": 0, "exact": False, "iou": 0.0, "recorded": reason, "same": row["simulated"] is not None}
            return row | {"seconds": round(time.perf_counter() - began, 3)}
        row["seconds"] = round(time.perf_counter() - began, 3)
        found, nouns = compare_masks(recording, source)
        recorded = RecordedOptions(nouns=nouns if job.structure == "table setting" else {})
        options = replace(options, scene=str(recording.bag), recorded=recorded)
        row |= {**found, "recorded": _failure(words, options, cache)}
    return row | {"same": (row["simulated"] is None) == (row["recorded"] is None)}


def _failure(words: str, options: RunOptions, cache: ResourceCache) -> str | None:
    """Carry out an instruction; return why it failed, or `None` if it succeeded."""
    for event in run_instruction(words, options, cache):
        if isinstance(event, events.Failed):
            return event.message
    return None


def _rates(rows: Sequence[Row]) -> Row:
    known = measured(rows)
    return {
        "n": len(rows),
        "exact": rate_of([row.get("exact", False) for row in rows]),
        "iou": float(np.mean([row["iou"] for row in known])) if known else None,
        "simulated": rate_of([row.get("simulated", LOST) is None for row in rows]),
        "recorded": rate_of([row.get("recorded", LOST) is None for row in rows]),
        "same": rate_of([row.get("same", False) for row in rows]),
        "lost": lost_count(rows),
        "seconds": float(np.mean([row["seconds"] for row in known])) if known else None,
    }

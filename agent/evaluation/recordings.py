"""`structagent evaluate recordings`: what is found in bags of simulated scenes, and whether it changes how runs end.

Each scene is simulated, recorded into a bag, and perceived from there: the masks of the objects are compared with the
simulation's own. Then the same instruction is carried out twice: in simulation, on the true objects, and over the
recording, on the twin that is made of it. Everything on the table takes part, so that no name has to be known; only
the objects of a table setting are named for the recording, as a person would with `--call`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
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
from agent.evaluation.arm import REPORT
from agent.evaluation.common import (
    LOST,
    Place,
    Row,
    keep_as_they_end,
    lost_count,
    lost_note,
    rate_of,
    report_of,
    rows_by_place,
    told,
)
from agent.evaluation.result_store import KeptRows, fingerprint, kept_folder
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, run_instruction
from agent.recordings.recording import RecordedOptions
from agent.rendering.text import aligned, number
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from agent.scenes.digital_twin import RecordedSource
from agent.scenes.files import write_scene
from agent.scenes.object_placement import drawn_objects, saved_objects
from agent.scenes.record_bag import record_session
from agent.scenes.sources import FileSource
from grounding.corpus.grammar import sentences
from grounding.references.selection import mentioned
from grounding.spec import SHAPES
from structdiffusion.data.scene_sampling import DrawnScene, SceneError, draw_scene, full_spec
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import WORKER_DIED
from structdiffusion.simulation.world import MIN_POINTS

_MATCHED = 0.5  # of intersection over union: a mask that has less in common with an object is none of it
_DRAWS = 200
_CODE = (agent.arm, agent.recordings, agent.perception, agent.scenes, agent.recordings, grounding)  # that decides the rows


@dataclass(frozen=True)
class _Job:
    structure: str
    number: int
    seed: int
    drawn: DrawnScene


def measure_recordings(
    objects: str,
    model: str,
    weights: Path | None,
    count: int,
    seed: int,
    execute: bool,
    *,
    workers: int | None = None,
    out: Path | None = None,
    allow_unverified: bool = False,
) -> dict[str, Any]:
    """Masks and verdicts over `count` scenes of each of the four structures, JSON-ready.

    Args:
        objects: as `load_objects` takes it.
        model: the planner.
        weights: the folder of its checkpoints, or `None` for those shipped.
        count: scenes per structure.
        seed: of scenes, sensor noise, sampling and planning.
        execute: build with the arm, or only try each goal without it.
        workers: processes; `None` for one per core, 0 for this one alone.
        out, allow_unverified: as `measure_arm` has them.

    Raises: as `measure_arm`.
    """
    # An unknown name or a broken checkpoint is known before any scene is drawn.
    checked_planner(model, weights, allow_unverified)
    library = load_objects(objects)
    options = {"objects": objects, "model": model, "seed": seed, "execute": execute}
    asked = {"evaluation": "recordings"} | fingerprint(options, library, [model], weights, _CODE)
    # Structures in turn, so that what is there of an evaluation that was stopped is of all of them.
    places = [(shape, k) for k in range(count) for shape in SHAPES]
    with (
        kept_folder(out) as path,
        KeptRows(path, asked, {"structure", "number"}, (REPORT,)) as kept,
        workforce(workers, None) as force,
    ):
        rows = rows_by_place(kept.rows)
        jobs = [_job(library, objects, place, seed) for place in places if place not in rows]
        run = RunOptions(
            objects=objects, model=model, weights=weights, execute=execute, allow_unverified=allow_unverified
        )
        recorded = force.do(partial(_round_trip, run), ResourceCache, (), jobs)
        with progress("scenes recorded", len(places), len(places) - len(jobs)) as tell:
            rows |= keep_as_they_end(kept, recorded, tell, seed)
    command = f"structagent evaluate recordings --objects {objects} --scenes {count} --seed {seed} --model {model}"
    command += f" --weights {weights}" if weights else ""
    command += "" if execute else " --no-execute"
    command += " --allow-unverified" if allow_unverified else ""
    return report_of(command, [rows[shape, k] for shape in SHAPES for k in range(count)], _rates)


def tell_recordings(report: dict[str, Any], results: TextIO) -> None:
    """The table for people."""
    lost = report["aggregate"]["all"]["lost"]
    head = ["structure", "n", "exact", "mask IoU", "simulated", "recorded", "same", "95 %", "seconds to objects"]
    table = [head + ([WORKER_DIED] if lost else [])]
    for structure, rates in report["aggregate"].items():
        same = rates["same"]
        table.append(
            [
                structure,
                str(rates["n"]),
                str(rates["exact"]["count"]),
                number(rates["iou"], 3),
                str(rates["simulated"]["count"]),
                str(rates["recorded"]["count"]),
                str(same["count"]),
                f"{100 * same['low']:.0f} to {100 * same['high']:.0f}",
                number(rates["seconds"], 2),
                *([str(rates["lost"])] if lost else []),
            ]
        )
    print(aligned(table, left=1), file=results)
    if lost:
        print("\n" + lost_note(lost, "scene"), file=results)
    print(f"\n{report['command']}", file=results)


def _job(library: Sequence[ObjectModel], objects: str, place: Place, seed: int) -> _Job:
    """A scene in which everything takes part and the camera sees all of it."""
    structure, count = place
    for draw in range(_DRAWS):
        rng = np.random.default_rng((seed, SHAPES.index(structure), count, draw))
        try:
            return _Job(structure, count, seed, draw_scene(library, full_spec(structure, rng), rng, distractors=0))
        except SceneError:
            continue
    raise SceneError(f"no {structure} could be drawn from {objects} in {_DRAWS} attempts")


def _round_trip(options: RunOptions, cache: ResourceCache, job: _Job) -> dict[str, Any]:
    """One scene, recorded, perceived, and built twice; the row of the report."""
    drawn, seed = job.drawn, job.seed * 10_000 + job.number
    wordings = [words for words in sentences(drawn.spec) if not mentioned(words)]
    words = wordings[job.number % len(wordings)]
    with TemporaryDirectory() as name:
        folder = Path(name)
        scene, bag = folder / "scene.yaml", folder / "recording.bag"
        poses = list(drawn.world_from_initial)
        write_scene(saved_objects(drawn_objects(drawn.models, poses, options.objects), poses, folder), scene)
        with FileSource(scene).set_out(seed) as table:
            record_session(table, bag, np.random.default_rng(seed))
            truth = table.world.look().segmentation
            masks = {name: truth == body for name, body in zip(table.names, table.world.bodies, strict=True)}
            nouns = dict(zip(table.names, (each.category for each in table.models), strict=True))
        masks = {name: mask for name, mask in masks.items() if mask.sum() >= MIN_POINTS}
        row: dict[str, Any] = {
            "structure": job.structure,
            "number": job.number,
            "seed": seed,
            "words": words,
            "objects": [each.name for each in drawn.models],
        }
        options = replace(options, seed=seed)
        row["simulated"] = _ended(words, replace(options, scene=str(scene)), cache)
        began = time.perf_counter()
        try:
            source = RecordedSource(bag)
        except Exception as error:
            if exit_code_of(error) is None:
                raise
            ended = one_sentence(error)
            row |= {"found": 0, "exact": False, "iou": 0.0, "recorded": ended, "same": row["simulated"] is not None}
            return row | {"seconds": round(time.perf_counter() - began, 3)}
        row["seconds"] = round(time.perf_counter() - began, 3)
        overlaps = _overlaps(masks, source.segments.labels)
        best = overlaps.max(axis=1, initial=0.0)  # of each true object
        found = len(source.segments.objects)
        exact = found == len(masks) and bool((best > _MATCHED).all())
        row |= {"found": found, "exact": exact, "iou": round(float(best.mean()), 4), "ious": best.round(3).tolist()}
        names = list(masks)
        called = {
            each.name: nouns[names[int(overlaps[:, k].argmax())]] for k, each in enumerate(source.segments.objects)
        }
        recorded = RecordedOptions(nouns=called if job.structure == "table setting" else {})
        row["recorded"] = _ended(words, replace(options, scene=str(bag), recorded=recorded), cache)
    return row | {"same": (row["simulated"] is None) == (row["recorded"] is None)}


def _ended(words: str, options: RunOptions, loaded: ResourceCache) -> str | None:
    """How a run ended: `None` where it succeeded, otherwise why not."""
    for event in run_instruction(words, options, loaded):
        if isinstance(event, events.Failed):
            return event.message
    return None


def _overlaps(masks: dict[str, np.ndarray], labels: np.ndarray) -> np.ndarray:
    """(true objects, found objects) intersection over union of the masks."""
    found = [labels == k + 1 for k in range(max(0, int(labels.max())))]
    return np.array(
        [[(mask & other).sum() / max(1, (mask | other).sum()) for other in found] for mask in masks.values()]
    ).reshape(len(masks), len(found))


def _rates(rows: Sequence[Row]) -> Row:
    measured = told(rows)
    return {
        "n": len(rows),
        "exact": rate_of([row.get("exact", False) for row in rows]),
        "iou": float(np.mean([row["iou"] for row in measured])) if measured else None,
        "simulated": rate_of([row.get("simulated", LOST) is None for row in rows]),
        "recorded": rate_of([row.get("recorded", LOST) is None for row in rows]),
        "same": rate_of([row.get("same", False) for row in rows]),
        "lost": lost_count(rows),
        "seconds": float(np.mean([row["seconds"] for row in measured])) if measured else None,
    }

"""`structagent evaluate arm`: how often the arm finds a plan, and how often what it builds stands as asked."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch

import agent.arm
from agent.arm.events import PickFailed, Placed, PlaceFailed, PlanFailed, Planned
from agent.arm.executor import build_structure
from agent.arm.kinematics import JacoArm
from agent.errors import NoValidGoal
from agent.evaluation.common import (
    SPOKEN_TO,
    Row,
    drawn_scenes,
    keep_as_they_end,
    lost_count,
    lost_note,
    rate_of,
    report_of,
    rows_by_place,
    spoken_scenes,
    told,
)
from agent.evaluation.result_store import KeptRows, fingerprint, kept_folder
from agent.pipeline.candidates import checked_planner, filter_viable
from agent.pipeline.verdict import judge_built
from agent.rendering.text import aligned, number
from agent.runtime.output_paths import write_report
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from grounding.spec import SHAPES
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.objects.libraries import load_objects
from structdiffusion.observation import Goal
from structdiffusion.parallel import WORKER_DIED
from structdiffusion.planners.factory import Planner
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.structure import LayoutError

REPORT = "eval.json"  # beside the rows


def measure_arm(
    objects: str,
    name: str,
    weights: Path | None,
    count: int,
    seed: int,
    candidates: int,
    *,
    workers: int | None = None,
    out: Path | None = None,
    allow_unverified: bool = False,
) -> dict[str, Any]:
    """Plans found and structures standing, over `count` scenes of each of the four structures, JSON-ready.

    Args:
        objects: as `load_objects` takes it.
        name: the planner.
        weights: the folder of its checkpoints, or `None` for those shipped.
        count: scenes per structure.
        seed: of scenes, sensor noise, sampling and planning.
        candidates: arrangements that the planner proposes.
        workers: processes; `None` for one per core, 0 for this one alone.
        out: a folder that keeps the rows as they come, in which the same command goes on where it was stopped, and
            another one may ask for more scenes. `None` keeps nothing.
        allow_unverified: take checkpoints that are not what their cards say.

    Raises:
        UsageError: for an unknown planner, or a folder that was made with other options.
        BadInput: for a folder that cannot be written to.
        SceneError: when there is no scene to be drawn of these objects.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that are not what their cards say, unless that is allowed.
    """
    checked_planner(name, weights, allow_unverified)
    library = load_objects(objects)
    options = {"objects": objects, "model": name, "seed": seed, "candidates": candidates}
    asked = {"evaluation": "arm"} | fingerprint(options, library, [name], weights, (agent.arm,))
    # Structures in turn, so that what is there of an evaluation that was stopped is of all of them.
    places = [(shape, k) for k in range(count) for shape in SHAPES]
    with (
        kept_folder(out) as path,
        KeptRows(path, asked, {"structure", "number"}, (REPORT,)) as kept,
        workforce(workers, None) as force,
    ):
        rows = rows_by_place(kept.rows)
        missing = [place for place in places if place not in rows]
        scenes, lost = drawn_scenes(force, library, missing, seed)
        spoken = spoken_scenes(scenes, heard=name in SPOKEN_TO) if scenes else []
        load = partial(checked_planner, name, weights, allow_unverified)
        built = force.do(partial(_built, candidates), load, (), spoken)
        with progress("scenes built", len(places), len(places) - len(missing)) as tell:
            rows |= keep_as_they_end(kept, chain(lost, built), tell, seed)
    command = f"structagent evaluate arm --objects {objects} --scenes {count} --seed {seed} --model {name}"
    command += f" --weights {weights}" if weights else ""
    command += f" --candidates {candidates}" + (" --allow-unverified" if allow_unverified else "")
    return report_of(command, [rows[shape, k] for shape in SHAPES for k in range(count)], _rates)


def write_evaluation(report: dict[str, Any], folder: Path) -> list[Path]:
    """Writes the report beside the rows; its path."""
    return write_report(report, folder / REPORT)


def tell_arm(report: dict[str, Any], results: TextIO) -> None:
    """The table for people."""
    lost = report["aggregate"]["all"]["lost"]
    table = [["structure", "n", "planned", "95 %", "stands", "95 %", *([WORKER_DIED] if lost else []), "seconds"]]
    for structure, rates in report["aggregate"].items():
        cells = [structure, str(rates["n"])]
        for key in ("planned", "stands"):
            cells += [str(rates[key]["count"]), f"{100 * rates[key]['low']:.0f} to {100 * rates[key]['high']:.0f}"]
        table.append([*cells, *([str(rates["lost"])] if lost else []), number(rates["seconds"], 0)])
    print(aligned(table, left=1), file=results)
    if lost:
        print("\n" + lost_note(lost, "scene"), file=results)
    print(f"\n{report['command']}", file=results)


def _built(candidates: int, planner: Planner, scene: EvaluationScene) -> dict[str, Any]:
    """One scene from the look to the verdict; the row of the report."""
    drawn, started = scene.drawn, time.perf_counter()
    row: dict[str, Any] = {
        "structure": scene.structure,
        "number": scene.number,
        "seed": scene.seed,
        "words": scene.words,
        "objects": [model.name for model in drawn.models[: drawn.count]],
        "planned": False,
        "placed": 0,
        "stands": False,
        "trouble": [],
    }
    rng = np.random.default_rng((scene.seed, scene.number, drawn.count))
    generator = torch.Generator().manual_seed(scene.seed)
    with TabletopWorld(drawn.models, drawn.world_from_initial, drawn.table) as world:
        arm = JacoArm(world.client)
        observed = world.observe(rng, range(drawn.count), range(drawn.count, len(drawn.models)))
        initial = np.array(world.poses()[: drawn.count])
        try:
            goal = Goal(scene.heard or scene.spec, scene.words, scene.embedding)
            arrangements = filter_viable(planner.propose(observed, goal, count=candidates, generator=generator))
        except (LayoutError, NoValidGoal) as error:
            return {**row, "trouble": [str(error)], "seconds": round(time.perf_counter() - started, 1)}
        rank, placed = 0, set()  # what was pushed away may be placed twice
        for event in build_structure(world, arm, observed, arrangements, rng=rng):
            if isinstance(event, Planned):
                row["planned"], rank = True, event.arrangement
            elif isinstance(event, Placed) and not event.aside:
                placed.add(event.object)
            elif isinstance(event, (PlanFailed, PickFailed, PlaceFailed)):
                row["trouble"].append(f"{type(event).__name__}: {event.name}: {event.reason}")
        row["placed"] = len(placed)
        if len(placed) == drawn.count:
            goals = arrangements[rank].goal_from_initial @ initial
            failure, checks = judge_built(world, range(drawn.count), goals, scene.spec)
            row["stands"], row["failure"] = failure is None, failure
            row["failed_checks"] = [f"{c.name}: {c.measured:.3g}, allowed {c.limit}" for c in checks if not c.passed]
    return {**row, "rank": rank + 1, "seconds": round(time.perf_counter() - started, 1)}


def _rates(rows: Sequence[Row]) -> Row:
    seconds = [row["seconds"] for row in told(rows)]
    return {
        "n": len(rows),
        "planned": rate_of([row.get("planned", False) for row in rows]),
        "stands": rate_of([row.get("stands", False) for row in rows]),
        "lost": lost_count(rows),
        "seconds": float(np.mean(seconds)) if seconds else None,
    }

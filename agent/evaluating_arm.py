"""`structagent evaluate arm`: how often the arm finds a plan, and how often what it builds stands as asked."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch

from agent.arm.events import PickFailed, Placed, PlaceFailed, Planned, PlanFailed
from agent.arm.executor import build_structure
from agent.arm.kinematics import JacoArm
from agent.errors import NoValidGoal
from agent.evaluating import SPOKEN_TO, Row, drawn_scenes, rate_of, report_of, spoken_scenes
from agent.judging import judge_built
from agent.planning import checked_planner, worthwhile
from agent.progress import followed
from agent.telling import aligned
from structdiffusion.evaluation_scenes import EvaluationScene
from structdiffusion.layouts import LayoutError
from structdiffusion.observation import Goal
from structdiffusion.sampling import Planner
from structdiffusion.tabletop import TabletopWorld
from structdiffusion.workers import in_parallel


def measure_arm(
    objects: str, name: str, weights: Path | None, count: int, seed: int, candidates: int, workers: int
) -> dict[str, Any]:
    """Plans found and structures standing, over `count` scenes of each of the four structures, JSON-ready.

    Args: as `measure_success`.
    """
    checked_planner(name, weights)
    scenes = spoken_scenes(drawn_scenes(objects, count, seed, workers), heard=name in SPOKEN_TO)
    load = partial(checked_planner, name, weights)
    built = in_parallel(partial(_built, candidates), load, (), scenes, workers)
    rows = list(followed("scenes built", built, len(scenes)))
    command = f"structagent evaluate arm --objects {objects} --scenes {count} --seed {seed} --model {name}"
    command += f" --weights {weights}" if weights else ""
    command += f" --candidates {candidates}"
    return report_of(command, rows, _rates)


def tell_arm(report: dict[str, Any], results: TextIO) -> None:
    """The table for people."""
    table = [["structure", "n", "planned", "95 %", "stands", "95 %", "seconds"]]
    for structure, rates in report["aggregate"].items():
        cells = [structure, str(rates["n"])]
        for key in ("planned", "stands"):
            cells += [str(rates[key]["count"]), f"{100 * rates[key]['low']:.0f} to {100 * rates[key]['high']:.0f}"]
        table.append([*cells, f"{rates['seconds']:.0f}"])
    print(aligned(table, left=1), file=results)
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
            arrangements = worthwhile(planner.propose(observed, goal, count=candidates, generator=generator))
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
    return {
        "n": len(rows),
        "planned": rate_of([row["planned"] for row in rows]),
        "stands": rate_of([row["stands"] for row in rows]),
        "seconds": float(np.mean([row["seconds"] for row in rows])),
    }

"""How long sampling and ranking takes, as `structagent benchmark` measures it.

A circle of procedural objects, seen through the simulated camera; the time from the clouds to the ranked
arrangements, after one warm-up. What trying the best of them out in imagination adds is told apart.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import draw_scene
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.observation import Goal, Scene
from structdiffusion.planners.factory import Planner, load_planner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.simulation.world import TabletopWorld

Result = dict[str, Any]
_SPEC = StructureSpec("circle", size="small", rotation="south")
_CANDIDATES, _OBJECTS = (1, 4, 16, 64, 256), (3, 4, 5, 6, 7, 8, 9, 10)


def observed_scene(objects: int, seed: int) -> Scene:
    """A simulated table with this many objects for a small circle."""
    rng = np.random.default_rng(seed)
    drawn = draw_scene(procedural_objects(170), _SPEC, rng, count=objects, distractors=0)
    with TabletopWorld(drawn.models, drawn.world_from_initial) as world:
        return world.observe(rng)


def measure(model: str, objects: int, candidates: int, runs: int, weights: Path | None = None) -> Result:
    """Seconds of `runs` proposals, with what they depend on.

    "imagined_seconds" is what imagination adds to them: `None` for planners that are told a sentence, since there is
    no sentence encoder here. A stand-in takes as long to sample and to rank by, but what it asks for is nothing that
    could stand.
    """
    planner = load_planner(model, weights)
    scene = observed_scene(objects, seed=0)
    goal = Goal(_SPEC, "a sentence", np.full(384, 384**-0.5, dtype=np.float32))

    def timed(planner: Planner) -> list[float]:
        seconds = []
        for run in range(-1, runs):
            started = time.perf_counter()
            planner.propose(scene, goal, count=candidates, generator=torch.Generator().manual_seed(abs(run)))
            seconds.append(time.perf_counter() - started)
        return sorted(seconds[1:])  # without the warm-up

    middle = runs // 2
    imagined: float | None = 0.0
    seconds = timed(_without_imagination(planner))
    if PLANNERS[model].sentence:
        imagined = None
    elif PLANNERS[model].imagined:
        imagined = timed(planner)[middle] - seconds[middle]
    return {
        "model": model,
        "objects": objects,
        "candidates": candidates,
        "threads": torch.get_num_threads(),
        "runs": runs,
        "seconds_min": seconds[0],
        "seconds_median": seconds[middle],
        "seconds_max": seconds[-1],
        "imagined_seconds": imagined,
    }


def _without_imagination(planner: Planner) -> Planner:
    if isinstance(planner, GeometricPlanner):
        return GeometricPlanner()
    bare = copy(planner)
    bare.post_process = replace(planner.post_process, imagined=0)
    return bare


def sweep(model: str, runs: int, weights: Path | None = None) -> list[Result]:
    """For every number of candidates with 7 objects, and for every number of objects with 64 candidates."""
    wanted = [(7, candidates) for candidates in _CANDIDATES]
    wanted += [(objects, 64) for objects in _OBJECTS if objects != 7]
    return [measure(model, *point, runs, weights) for point in wanted]


def plot(results: Sequence[Result], path: Path) -> None:
    """Draws the cost against the number of candidates and of objects as a picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, key, fixed, held in ((panels[0], "candidates", "objects", 7), (panels[1], "objects", "candidates", 64)):
        rows = sorted((row for row in results if row[fixed] == held), key=lambda row: row[key])
        across, seconds = [row[key] for row in rows], [row["seconds_median"] for row in rows]
        panel.plot(across, seconds, "o-", label="sampled and ranked")
        if all(row["imagined_seconds"] is not None for row in rows):
            whole = [s + row["imagined_seconds"] for s, row in zip(seconds, rows)]
            panel.plot(across, whole, "o--", label="and tried out in imagination")
        panel.set(xlabel=f"{key} ({held} {fixed})", ylabel="seconds", ylim=(0, None))
        panel.grid(alpha=0.3)
        panel.legend()
    panels[0].set_xscale("log", base=2)
    panels[0].set_xticks(_CANDIDATES, [str(count) for count in _CANDIDATES])
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)

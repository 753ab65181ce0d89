"""Measure how long a planner takes to sample and rank arrangements, as `structagent benchmark` reports it.

The scene is a circle of procedural objects, seen by the simulated camera. The time runs from the clouds to the ranked
arrangements, after one warm-up run. The time of the physics rollouts of the best ones is reported separately.
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
from structdiffusion.observation import Scene, StructureGoal
from structdiffusion.planners.factory import Planner, load_planner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.simulation.world import TabletopWorld

Result = dict[str, Any]
_SPEC = StructureSpec("circle", size="small", rotation="south")
_CANDIDATES, _OBJECTS = (1, 4, 16, 64, 256), (3, 4, 5, 6, 7, 8, 9, 10)


def observed_scene(objects: int, seed: int) -> Scene:
    """Return a simulated table as the camera sees it, with `objects` objects that suit a small circle."""
    rng = np.random.default_rng(seed)
    drawn = draw_scene(procedural_objects(170), _SPEC, rng, count=objects, distractors=0)
    with TabletopWorld(drawn.models, drawn.world_from_initial) as world:
        return world.observe(rng)


def measure(model: str, objects: int, candidates: int, runs: int, weights: Path | None = None) -> Result:
    """Measure the seconds of `runs` proposals; return them with the settings that they depend on.

    "rollout_seconds" is the additional time of the physics rollouts. It is `None` for sentence-conditioned planners:
    this module has no sentence encoder, and uses a stand-in embedding. Sampling and ranking take as long with it, but
    the arrangements would not stand.
    """
    planner = load_planner(model, weights)
    scene = observed_scene(objects, seed=0)
    goal = StructureGoal(_SPEC, "a sentence", np.full(384, 384**-0.5, dtype=np.float32))

    def timed(planner: Planner) -> list[float]:
        seconds = []
        for run in range(-1, runs):
            started = time.perf_counter()
            planner.propose(scene, goal, count=candidates, generator=torch.Generator().manual_seed(abs(run)))
            seconds.append(time.perf_counter() - started)
        return sorted(seconds[1:])  # without the warm-up

    middle = runs // 2
    rollout: float | None = 0.0
    seconds = timed(_without_rollouts(planner))
    if PLANNERS[model].sentence:
        rollout = None
    elif PLANNERS[model].rollouts:
        rollout = timed(planner)[middle] - seconds[middle]
    return {
        "model": model,
        "objects": objects,
        "candidates": candidates,
        "threads": torch.get_num_threads(),
        "runs": runs,
        "seconds_min": seconds[0],
        "seconds_median": seconds[middle],
        "seconds_max": seconds[-1],
        "rollout_seconds": rollout,
    }


def _without_rollouts(planner: Planner) -> Planner:
    if isinstance(planner, GeometricPlanner):
        return GeometricPlanner()
    bare = copy(planner)
    bare.post_process = replace(planner.post_process, rollouts=0)
    return bare


def sweep(model: str, runs: int, weights: Path | None = None) -> list[Result]:
    """Measure every number of candidates with 7 objects, and every number of objects with 64 candidates."""
    wanted = [(7, candidates) for candidates in _CANDIDATES]
    wanted += [(objects, 64) for objects in _OBJECTS if objects != 7]
    return [measure(model, *point, runs, weights) for point in wanted]


def plot(results: Sequence[Result], path: Path) -> None:
    """Plot the cost against the number of candidates and the number of objects, and write the picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, key, fixed, held in ((panels[0], "candidates", "objects", 7), (panels[1], "objects", "candidates", 64)):
        rows = sorted((row for row in results if row[fixed] == held), key=lambda row: row[key])
        across, seconds = [row[key] for row in rows], [row["seconds_median"] for row in rows]
        panel.plot(across, seconds, "o-", label="sampled and ranked")
        if all(row["rollout_seconds"] is not None for row in rows):
            whole = [s + row["rollout_seconds"] for s, row in zip(seconds, rows)]
            panel.plot(across, whole, "o--", label="with physics rollouts")
        panel.set(xlabel=f"{key} ({held} {fixed})", ylabel="seconds", ylim=(0, None))
        panel.grid(alpha=0.3)
        panel.legend()
    panels[0].set_xscale("log", base=2)
    panels[0].set_xticks(_CANDIDATES, [str(count) for count in _CANDIDATES])
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)

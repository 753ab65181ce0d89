"""How long sampling and ranking takes: `python -m structdiffusion.benchmark.latency [--json] [--sweep DIR]`.

A circle of procedural objects, seen through the simulated camera; the time from the clouds to the ranked
arrangements, after one warm-up. What trying the best of them out in imagination adds is told apart.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import SceneError, draw_scene
from structdiffusion.models.checkpoint import CheckpointError
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


def told(result: Result) -> str:
    """One result in words."""
    spread = f"median of {result['runs']}; {result['seconds_min']:.2f} to {result['seconds_max']:.2f}"
    imagined = f", imagination {result['imagined_seconds']:.2f} s more" if result["imagined_seconds"] else ""
    return (
        f"{result['candidates']} candidates for {result['objects']} objects by {result['model']}: "
        f"{result['seconds_median']:.2f} s ({spread}){imagined}, {result['threads']} thread(s)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m structdiffusion.benchmark.latency", description=__doc__)
    parser.add_argument("--model", choices=PLANNERS, default="diffusion-tokens", metavar="NAME")
    parser.add_argument("--objects", type=int, default=7)
    parser.add_argument("--candidates", type=int, default=64)
    parser.add_argument("--runs", type=int, default=5)
    # The tensors are too small to share: two threads that wait for each other take several times as long as one.
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--weights", type=Path, help="a folder of checkpoints; by default those shipped")
    parser.add_argument("--sweep", type=Path, metavar="DIR", help="measure many numbers; benchmark.json, .png go there")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    for name in ("objects", "candidates", "runs", "threads"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} cannot be {getattr(options, name)}; legal: 1 or more")
    torch.set_num_threads(options.threads)
    try:
        if options.sweep is not None:
            results = sweep(options.model, options.runs, options.weights)
            plot(results, options.sweep / "benchmark.png")
            (options.sweep / "benchmark.json").write_text(json.dumps(results, indent=1) + "\n")
        else:
            results = [measure(options.model, options.objects, options.candidates, options.runs, options.weights)]
    except (SceneError, CheckpointError) as error:
        parser.error(str(error))
    if options.json:
        print(json.dumps(results if options.sweep is not None else results[0]))
    else:
        print("\n".join(map(told, results)))


if __name__ == "__main__":
    main()

"""How long sampling and ranking takes: `python -m structdiffusion.benchmark [--json]`.

A circle of seven procedural objects, seen through the simulated camera; the time from the clouds to
the ranked arrangements, after one warm-up.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import torch

from grounding.spec import StructureSpec
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.observation import Goal, Scene
from structdiffusion.planners import PLANNERS
from structdiffusion.sampling import load_planner
from structdiffusion.scenes import draw_scene
from structdiffusion.tabletop import TabletopWorld

_SPEC = StructureSpec("circle", size="small", x_position="center", y_position="middle", rotation="south")


def observed_scene(objects: int, seed: int) -> Scene:
    """A simulated table with this many objects for a small circle."""
    rng = np.random.default_rng(seed)
    drawn = draw_scene(procedural_objects(170), _SPEC, rng, count=objects, distractors=0)
    with TabletopWorld(drawn.models, drawn.world_from_initial) as world:
        return world.observe(rng)


def measure(model: str, objects: int, candidates: int, runs: int, weights: Path | None = None) -> dict[str, object]:
    """Seconds of `runs` proposals, with what they depend on."""
    planner = load_planner(model, weights)
    scene = observed_scene(objects, seed=0)
    # What the embedding holds makes no difference to the time.
    goal = Goal(_SPEC, "a sentence", np.full(384, 384**-0.5, dtype=np.float32))
    seconds = []
    for run in range(runs + 1):
        started = time.perf_counter()
        planner.propose(scene, goal, count=candidates, generator=torch.Generator().manual_seed(run))
        seconds.append(time.perf_counter() - started)
    measured = sorted(seconds[1:])
    return {
        "model": model,
        "objects": objects,
        "candidates": candidates,
        "threads": torch.get_num_threads(),
        "runs": runs,
        "seconds_min": measured[0],
        "seconds_median": measured[runs // 2],
        "seconds_max": measured[-1],
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m structdiffusion.benchmark", description=__doc__)
    parser.add_argument("--model", choices=PLANNERS, default="diffusion")
    parser.add_argument("--objects", type=int, default=7)
    parser.add_argument("--candidates", type=int, default=64)
    parser.add_argument("--runs", type=int, default=5)
    # The tensors are too small to share: two threads that wait for each other take several times as long as one.
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--weights", type=Path, help="a folder of checkpoints; by default those shipped")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    result = measure(options.model, options.objects, options.candidates, options.runs, options.weights)
    if options.json:
        print(json.dumps(result))
    else:
        print(
            f"{result['candidates']} candidates for {result['objects']} objects by {result['model']}: "
            f"{result['seconds_median']:.2f} s (median of {result['runs']}; {result['seconds_min']:.2f} to "
            f"{result['seconds_max']:.2f}), {result['threads']} thread(s)"
        )


if __name__ == "__main__":
    main()

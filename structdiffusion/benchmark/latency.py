"""Measure how long a planner takes to decide, and each step of it, as `structagent benchmark` reports it.

A decision runs from the clouds of a scene to arrangements that are ranked and tried in physics. Every run decides about
another scene of procedural objects, seen by the simulated camera, after one run that warms up.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch

from grounding.spec import SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.data.scene_sampling import SceneError, draw_scene
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.factory import Planner, load_planner
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.planners.samples import encode_scene
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.protocol.physical_stability import Verdict
from structdiffusion.simulation.visible_points import ObservationError
from structdiffusion.simulation.world import TabletopWorld

Result = dict[str, Any]
# A flat structure, a tower, and ten objects in either way; of a tower's ten objects as many as the arm can stack.
DECISIONS = (("circle", 7), ("tower", 4), ("circle", 10), ("tower", 10))
# Draws for each scene that are passed over, because an object is hidden, or the objects are too large for the table.
_MISSES = 5


class StepClock:
    """Add up the seconds and calls of the steps of a decision.

    Attributes:
        steps: name -> seconds, CPU seconds and calls, in the order of the steps.
    """

    def __init__(self) -> None:
        self.steps: dict[str, list[float]] = {}

    @contextmanager
    def __call__(self, name: str, calls: int = 1) -> Iterator[None]:
        """Count what happens in the `with` block as a step of so many calls."""
        started, worked = time.perf_counter(), time.process_time()
        yield
        step = self.steps.setdefault(name, [0.0, 0.0, 0])
        for place, more in enumerate((time.perf_counter() - started, time.process_time() - worked, calls)):
            step[place] += more

    def count(self, name: str, calls: int) -> None:
        """Count further calls of a step."""
        self.steps[name][2] += calls

    def seconds(self) -> float:
        """Return the seconds of all steps."""
        return sum(step[0] for step in self.steps.values())

    def cpu_seconds(self) -> float:
        """Return the CPU seconds of all steps, over all threads."""
        return sum(step[1] for step in self.steps.values())


class _CountedRollout(PhysicsRollout):
    """A rollout that counts its trials."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.trials = 0

    def verdict(self, *arguments: Any, **options: Any) -> Verdict:
        self.trials += 1
        return super().verdict(*arguments, **options)


@torch.no_grad()
def decide(
    planner: Planner, scene: Scene, goal: StructureGoal, count: int, generator: torch.Generator, clock: StepClock
) -> list[Arrangement]:
    """Propose exactly what the planner proposes, with each step on the clock; other planners are one step."""
    if not isinstance(planner, DiffusionPlanner):
        with clock("propose"):
            return planner.propose(scene, goal, count=count, generator=generator)
    process, count = planner.post_process, planner.candidates or count
    with clock("encode the clouds", len(scene.objects)):
        seen = encode_scene(scene, goal, planner.model, planner.sentence, generator)
    with clock("sample", len(planner.scheduler.timesteps)):
        samples = planner.sample(seen, goal, count, generator)
    if process.placed:
        with clock("refine", count):
            samples = process.place(seen, scene, goal.spec, samples)
    with clock("rank", count):
        arrangements = process.rank(seen, scene, goal.spec, samples, generator)
    if process.rollouts:
        rollout = _CountedRollout(scene)
        with clock("complete the bodies", len(scene.objects) + len(scene.distractors)):
            rollout.bodies  # noqa: B018
        with clock("try in physics", 0):
            arrangements = rerank_by_physics(rollout, arrangements, goal.spec, process.rollouts)
        clock.count("try in physics", rollout.trials)
    return arrangements


def spec_of(shape: str) -> StructureSpec:
    """Return the request that the benchmark makes of a shape."""
    wanted = {"size": "small", "rotation": "south"}
    return StructureSpec(shape, **{slot: value for slot, value in wanted.items() if slot in SLOTS_OF_SHAPE[shape]})


def observed_scenes(shape: str, objects: int, count: int, seed: int = 0) -> list[Scene]:
    """Return simulated tables as the camera sees them, each with `objects` objects that suit the shape.

    Raises:
        SceneError: if so many objects cannot form the shape.
        ObservationError: if an object is hidden in draw after draw.
    """
    scenes: list[Scene] = []
    library, misses = procedural_objects(170), 0
    while len(scenes) < count:
        rng = np.random.default_rng((seed, len(scenes), misses))
        try:
            drawn = draw_scene(library, spec_of(shape), rng, count=objects, distractors=0)
            with TabletopWorld(drawn.models, drawn.world_from_initial) as world:
                scenes.append(world.observe(rng))
        except (ObservationError, SceneError):
            misses += 1
            if misses > _MISSES * (len(scenes) + 1):
                raise
    return scenes


def loaded(model: str, weights: Path | None = None) -> Planner:
    """Load the planner to measure.

    A planner that takes a sentence tries nothing in physics: this module has no sentence encoder, and uses a stand-in
    embedding. Sampling and ranking take as long with it, but the arrangements would not stand.
    """
    planner: Any = load_planner(model, weights)
    if PLANNERS[model].sentence:
        planner.post_process = planner.post_process.without_physics()
    return planner


def measure(planner: Planner, shape: str, scenes: Sequence[Scene], candidates: int) -> Result:
    """Measure a decision about each of the scenes but the first, which warms up.

    Returns:
        The medians: "seconds" and "cpu_seconds" of the whole, and the same with "calls" for each of the "steps".
    """
    goal = StructureGoal(spec_of(shape), "a sentence", np.full(384, 384**-0.5, dtype=np.float32))
    clocks = []
    for number, scene in enumerate(scenes):
        clocks.append(StepClock())
        decide(planner, scene, goal, candidates, torch.Generator().manual_seed(number), clocks[-1])
    clocks = clocks[1:]
    seconds = sorted(clock.seconds() for clock in clocks)
    steps = []
    for name in clocks[0].steps:
        wall, cpu, calls = (statistics.median(values) for values in zip(*(clock.steps[name] for clock in clocks)))
        steps.append({"step": name, "seconds": wall, "cpu_seconds": cpu, "calls": calls})
    return {
        "structure": shape,
        "objects": sorted({len(scene.objects) for scene in scenes[1:]}),
        "candidates": candidates,
        "threads": torch.get_num_threads(),
        "runs": len(clocks),
        "seconds_min": seconds[0],
        "seconds_median": statistics.median(seconds),
        "seconds_max": seconds[-1],
        "cpu_seconds_median": statistics.median(clock.cpu_seconds() for clock in clocks),
        "steps": steps,
    }


def measure_decisions(
    model: str, decisions: Sequence[tuple[str, int]], candidates: int, runs: int, weights: Path | None = None
) -> list[Result]:
    """Measure a decision about each shape with so many objects: a row for each, with the model."""
    planner = loaded(model, weights)
    rows = []
    for shape, objects in decisions:
        scenes = observed_scenes(shape, objects, runs + 1)
        rows.append({"model": model, **measure(planner, shape, scenes, candidates)})
    return rows

"""Measure how long the arm's planning of one structure takes, and each step of it.

Every run plans another scene of procedural objects, as the simulated camera sees them, for arrangements of the
geometric planner; nothing moves. The rows have the form of `structdiffusion.benchmark.latency`.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from typing import Any

import numpy as np
import torch

from agent.arm.events import Planned
from agent.arm.grasps import Grasp
from agent.arm.motion_planner import PlanningScene
from agent.arm.plan_selection import PLANNING_CHECKS, find_plan
from agent.arm.reachability import Reach, Reachability, Standing
from agent.arm.task_planner import Search
from agent.pipeline.candidates import filter_viable
from structdiffusion.benchmark.latency import StepClock, observed_scenes, spec_of
from structdiffusion.completion.surface import completed_scene
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.factory import load_planner

MODEL = "geometric"
GRASPS, REACH, LINES, CHECKS, MOTIONS = (
    "fit grasps", "inverse kinematics", "straight lines", "check lines", "plan motions",
)  # fmt: skip
REST = "order, hulls, rest"


def measure_arm_planning(
    shape: str = "circle", objects: int = 7, runs: int = 7, candidates: int = 64, seed: int = 0
) -> dict[str, Any]:
    """Measure the search for a plan of a structure over scenes of which the first warms up.

    Args:
        shape, objects: the structure, and how many objects it has.
        runs: timed scenes.
        candidates: arrangements that are proposed for each.
        seed: of the scenes and of planning.

    Returns:
        A JSON-ready row as of `latency.measure`, with "planned", in how many runs a plan was found, and "checks", the
        median number of configurations that were checked for collisions.

    Raises:
        SceneError: if so many objects cannot form the shape.
    """
    planner = load_planner(MODEL)
    goal = StructureGoal(spec_of(shape))
    found, scenes = [], observed_scenes(shape, objects, runs + 1, seed)
    for number, scene in enumerate(scenes):
        generator = torch.Generator().manual_seed(seed + number)
        arrangements = filter_viable(planner.propose(scene, goal, count=candidates, generator=generator))
        found.append(_plan(scene, arrangements, np.random.default_rng((seed, number))))
    found = found[1:]
    seconds = sorted(clock.seconds() for clock, _, _ in found)
    return {
        "model": "arm",
        "structure": shape,
        "objects": sorted({len(scene.objects) for scene in scenes[1:]}),
        "candidates": candidates,
        "threads": torch.get_num_threads(),
        "runs": len(found),
        "planned": sum(planned for _, planned, _ in found),
        "checks": statistics.median(checks for _, _, checks in found),
        "seconds_min": seconds[0],
        "seconds_median": statistics.median(seconds),
        "seconds_max": seconds[-1],
        "cpu_seconds_median": statistics.median(clock.cpu_seconds() for clock, _, _ in found),
        "steps": [_median_step(name, [clock for clock, _, _ in found]) for name in _STEPS],
    }


_STEPS = (GRASPS, REACH, LINES, CHECKS, MOTIONS, REST)


def _median_step(name: str, clocks: Sequence[StepClock]) -> dict[str, Any]:
    wall, cpu, calls = zip(*(clock.steps.get(name, (0.0, 0.0, 0)) for clock in clocks))
    medians = map(statistics.median, (wall, cpu, calls))
    return dict(zip(("step", "seconds", "cpu_seconds", "calls"), (name, *medians)))


def _plan(scene: Scene, arrangements: Sequence[Arrangement], rng: np.random.Generator) -> tuple[StepClock, bool, int]:
    """Plan one scene; return the clock of its steps, whether a plan was found, and the configurations checked."""
    clock = OuterClock()
    started, worked = time.perf_counter(), time.process_time()
    with _TimedScene(rng.spawn(1)[0], clock) as planning:
        events = list(
            find_plan(_TimedSearch(planning, rng, scene.table), completed_scene(scene), arrangements, PLANNING_CHECKS)
        )
        checks = planning.checks
    rest = time.perf_counter() - started - clock.seconds(), time.process_time() - worked - clock.cpu_seconds()
    clock.steps[REST] = [*rest, 1]
    return clock, any(isinstance(event, Planned) for event in events), checks


class OuterClock(StepClock):
    """A clock that counts a step within another step as part of that one."""

    def __init__(self) -> None:
        super().__init__()
        self._busy = False

    @contextmanager
    def __call__(self, name: str, calls: int = 1) -> Iterator[None]:
        if self._busy:
            yield
            return
        self._busy = True
        try:
            with super().__call__(name, calls):
                yield
        finally:
            self._busy = False


class _TimedScene(PlanningScene):
    """A planning scene whose checks and motions are timed."""

    def __init__(self, rng: np.random.Generator, clock: OuterClock) -> None:
        super().__init__(rng)
        self.clock = clock

    def path_collides(self, *arguments: Any, **options: Any) -> bool:
        with self.clock(CHECKS):
            return super().path_collides(*arguments, **options)

    def plan(self, *arguments: Any, **options: Any) -> np.ndarray | None:
        with self.clock(MOTIONS):
            return super().plan(*arguments, **options)


class _TimedReachability(Reachability):
    """A finder of joint angles that is timed."""

    def __init__(self, scene: _TimedScene, rng: np.random.Generator) -> None:
        super().__init__(scene, rng)
        self._clock = scene.clock

    def block(self, *arguments: Any, **options: Any) -> Any:
        with self._clock(REACH):
            return super().block(*arguments, **options)

    def lines(self, q: np.ndarray, pose: np.ndarray) -> Reach:
        with self._clock(LINES):
            return super().lines(q, pose)


class _TimedStanding(Standing):
    """An object in one place, for which the fit of grasps is timed."""

    def __init__(self, clock: OuterClock, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._clock = clock

    @cached_property
    def grasps(self) -> list[Grasp]:
        with self._clock(GRASPS):
            return Standing.__dict__["grasps"].func(self)


class _TimedSearch(Search):
    """A search whose steps are timed."""

    finder = _TimedReachability

    def __init__(self, scene: _TimedScene, *arguments: Any, **options: Any) -> None:
        super().__init__(scene, *arguments, **options)
        self.standing = partial(_TimedStanding, scene.clock)

"""Measure how often the arm finds a plan, and how often the built structure is as asked: `structagent evaluate
arm`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch

import agent.arm
from agent.arm.arm_file import arm_checksum, load_arm
from agent.arm.build_listeners import BuildListeners
from agent.arm.events import PickFailed, Placed, PlaceFailed, PlanFailed, Planned
from agent.arm.executor import build_structure
from agent.arm.fixed_objects import with_fixed
from agent.arm.kinematics import Kinematics
from agent.arm.placement_rules import moving
from agent.arm.remainder import Remainder
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import NoValidGoal
from agent.evaluation.planner_config import BuildConfig
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
from agent.evaluation.rows import Place, Row, lost_count, measured, stored_scene_rows
from agent.evaluation.scene_conditions import conditions_of
from agent.evaluation.scenes import SENTENCE_PLANNERS, draw_scenes, with_sentences
from agent.event_base import Event
from agent.pipeline.candidates import checked_planner, filter_viable
from agent.pipeline.laying_out import StructureLayouts
from agent.pipeline.verdict import judge_built
from agent.rendering.text import number
from agent.runtime.worker_pool import Workforce
from grounding.spec import FIRST_SHAPES, StructureSpec
from structdiffusion.benchmark.scenes import Conditions, EvaluationScene
from structdiffusion.objects.libraries import load_objects
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.parallel import Lost
from structdiffusion.planners.factory import Planner
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.structure import LayoutError
from structdiffusion.worker_process import WORKER_DIED


@dataclass(frozen=True)
class ArmConfig(BuildConfig):
    """The options on which a row depends, in addition to those of `BuildConfig`.

    Attributes:
        objects_per_scene: as for `conditions_of`.
        arm: the file of the arm that builds; `None` for the Jaco.
    """

    objects_per_scene: str | None = None
    arm: str | None = None

    @property
    def kinematics(self) -> Kinematics:
        """Return the arm where it stands.

        Raises:
            BadInput: as `load_arm`.
        """
        if self.arm is None:
            return Kinematics()
        model = load_arm(Path(self.arm))
        return Kinematics(model, model.mounted)

    @property
    def conditions(self) -> Conditions:
        """Return the conditions under which scenes are drawn.

        Raises:
            UsageError: for an illegal value.
        """
        return conditions_of(self.objects_per_scene, None, "robot")


def measure_arm(
    config: ArmConfig,
    structures: Sequence[str],
    count: int,
    *,
    workers: int | None = None,
    out: Path | None = None,
) -> Row:
    """Measure found plans and standing structures over `count` scenes of each structure; return a JSON-ready report.

    Args:
        config: the options on which every row depends.
        structures: their shapes.
        count: scenes per structure.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add scenes. `None` stores nothing.

    Raises:
        UsageError: for an unknown planner, or a folder of another evaluation.
        BadInput: for a folder that cannot be written to.
        SceneError: if no scene can be drawn from these objects.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    model, conditions = config.model, config.conditions
    checked_planner(model, config.weights, config.allow_unverified)
    library = load_objects(config.objects)
    stored = {"evaluation": "arm"} | config.rows_fingerprint(library, [model], (agent.arm,))
    if config.arm is not None:
        stored["arm"] = arm_checksum(Path(config.arm))

    def compute(force: Workforce, missing: Sequence[Place]) -> Iterable[Row | Lost]:
        scenes, lost = draw_scenes(force, library, missing, config.seed, conditions)
        scenes = with_sentences(scenes, parsed=model in SENTENCE_PLANNERS)
        load = partial(checked_planner, model, config.weights, config.allow_unverified)
        build = partial(_build_scene, config.candidates, config.hold, config.kinematics)
        return chain(lost, force.do(build, load, (), scenes))

    rows = stored_scene_rows(
        compute, stored, [(shape, number) for number in range(count) for shape in structures], config.seed,
        what="scenes built", files=(REPORT,), workers=workers, out=out,
    )  # fmt: skip
    command = command_line(
        "arm", objects=config.objects, scenes=count, seed=config.seed, model=model,
        structure=None if tuple(structures) == FIRST_SHAPES else list(structures), weights=config.weights,
        candidates=config.candidates, objects_per_scene=config.objects_per_scene,
        allow_unverified=config.allow_unverified, hold=config.hold, arm=config.arm,
    )  # fmt: skip
    return report_by_structure(report_frame(command, len(rows), config.seed, (agent.arm,)), rows, _rates)


def print_arm(report: dict[str, Any], results: TextIO) -> None:
    """Print the table: a row per structure."""
    lost = report["aggregate"]["all"]["lost"]
    table = [["structure", "n", "planned", "95 %", "stands", "95 %", *([WORKER_DIED] if lost else []), "seconds"]]
    for structure, rates in report["aggregate"].items():
        cells = [structure, str(rates["n"])]
        for key in ("planned", "stands"):
            cells += [str(rates[key]["count"]), interval(rates[key])]
        table.append([*cells, *([str(rates["lost"])] if lost else []), number(rates["seconds"], 0)])
    print_table(table, results)
    print_footer(report, results, missing_note(lost, "scene"))


def _build_scene(candidates: int, hold: str, kinematics: Kinematics, planner: Planner, scene: EvaluationScene) -> Row:
    """Observe, plan, build and judge one scene; return its row."""
    drawn, started = scene.drawn, time.perf_counter()
    row: Row = {
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
    with TabletopWorld(drawn.models, drawn.world_from_initial, drawn.table) as world:
        arm = SimulatedArm(world.client, kinematics)
        arm.hold_by(hold)
        observed = world.observe(rng, range(drawn.count), range(drawn.count, len(drawn.models)))
        observed = with_fixed(observed, arm.hand, hold)
        initial = np.array(world.poses()[: drawn.count])
        try:
            goal = StructureGoal(scene.parsed or scene.spec, scene.words, scene.embedding)
            arrangements = _proposed(planner, goal, candidates, scene.seed, observed)
        except (LayoutError, NoValidGoal) as error:
            return {**row, "trouble": [str(error)], "seconds": round(time.perf_counter() - started, 1)}
        anew = _Anew(scene.spec, partial(_proposed, planner, goal, candidates, scene.seed), arrangements)
        listeners = BuildListeners(replanner=anew)
        rank, placed = record_build(
            build_structure(world, arm, observed, arrangements, rng=rng, listeners=listeners), row
        )
        arrangements = anew.arrangements
        row["placed"] = len(placed)
        if row["planned"] and placed.issuperset(moving(arrangements[rank].goal_from_initial)):
            row |= _verdict(world, scene, arrangements[rank], initial)
    return {**row, "rank": rank + 1, "seconds": round(time.perf_counter() - started, 1)}


def _proposed(planner: Planner, goal: StructureGoal, count: int, seed: int, scene: Scene) -> list[Arrangement]:
    return filter_viable(planner.propose(scene, goal, count=count, generator=torch.Generator().manual_seed(seed)))


class _Anew(StructureLayouts):
    """The layouts of what is left, as the product asks for them, kept after the arrangements that there were."""

    def __init__(
        self, spec: StructureSpec, propose: Callable[[Scene], list[Arrangement]], arrangements: Sequence[Arrangement]
    ) -> None:
        super().__init__(spec, propose)
        self.arrangements = list(arrangements)

    def lay_out(self, remainder: Remainder, members: Collection[int] | None = None) -> list[Arrangement]:
        try:
            found = super().lay_out(remainder, members)
        except LayoutError:
            found = []
        self.arrangements += found
        return found


def _verdict(world: TabletopWorld, scene: EvaluationScene, arrangement: Arrangement, initial: np.ndarray) -> Row:
    """Check the arm's result against the arrangement that it built; takes initial poses (N, 4, 4)."""
    failure, checks = judge_built(world, range(len(initial)), arrangement.goal_from_initial @ initial, scene.spec)
    failed = [c.sentence for c in checks if not c.passed]
    return {"stands": failure is None, "failure": failure, "failed_checks": failed}


def _rates(rows: Sequence[Row]) -> Row:
    seconds = [row["seconds"] for row in measured(rows)]
    return {
        "n": len(rows),
        "planned": rate_of([row.get("planned", False) for row in rows]),
        "stands": rate_of([row.get("stands", False) for row in rows]),
        "lost": lost_count(rows),
        "seconds": float(np.mean(seconds)) if seconds else None,
    }


def record_build(work: Iterable[Event], row: Row) -> tuple[int, set[int]]:
    """Let the arm build, and record in a row whether it found a plan, and its troubles.

    Args:
        work: the events of the arm.
        row: has "planned" and the list "trouble".

    Returns:
        The index of the arrangement that it followed last, and the objects that it placed.
    """
    rank, placed = 0, set()  # what was pushed away may be placed twice
    for event in work:
        if isinstance(event, Planned):
            row["planned"], rank = True, event.arrangement
        elif isinstance(event, Placed) and not event.aside:
            placed.add(event.object)
        elif isinstance(event, (PlanFailed, PickFailed, PlaceFailed)):
            row["trouble"].append(f"{type(event).__name__}: {event.name}: {event.reason}")
    return rank, placed

"""Measure builds with and without disturbances on the same scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from agent.arm.disturbances import DISTURBANCES
from agent.evaluation.goal_rows import LoadedPlanners, RowsWanted, goal_rows, goals_report
from agent.evaluation.loop.build import KINDS, UNDISTURBED, LoopBuild
from agent.evaluation.loop.config import LoopConfig
from agent.evaluation.loop.rates import rates_of
from agent.evaluation.planner_config import checked_names
from agent.evaluation.rows import Row
from agent.pipeline.candidates import checked_planner, is_viable
from agent.pipeline.laying_out import GoalLayouts
from agent.pipeline.proposing import propose_goal
from grounding.spec import SpecError
from structdiffusion.benchmark.goal_names import LOOP_FAMILIES
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.objects.libraries import load_objects
from structdiffusion.observation import Scene
from structdiffusion.planners.goal_planner import GoalArrangement
from structdiffusion.structures.structure import LayoutError


def measure_loop(
    config: LoopConfig,
    disturbances: Sequence[str] | None,
    families: Sequence[str] | None,
    scenes: int,
    *,
    workers: int | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """Build every scene without a disturbance and once with each; return a JSON report.

    Args:
        config: the options on which every row depends.
        disturbances: their kinds; `None` for all.
        families: of goals; `None` for all.
        scenes: number per family.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add disturbances, families and scenes; the report is of all rows in it. `None` stores
            nothing.

    Raises:
        UsageError: for an unknown disturbance, family or planner, or a folder of another evaluation.
        BadInput: for a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    kinds = (UNDISTURBED, *checked_names("disturb", disturbances, DISTURBANCES))
    chosen = checked_names("family", families, LOOP_FAMILIES)
    checked_planner(config.model, config.weights, config.allow_unverified)
    library = tuple(load_objects(config.objects))
    wanted = RowsWanted("disturbance", kinds, chosen, scenes, config.seed)
    solve = partial(_rows, replace(config, weights=config.weights and config.weights.absolute()))
    rows = goal_rows(
        wanted, solve, library, config.fingerprint(library), "scenes of the loop", workers=workers, out=out
    )  # fmt: skip

    def command(kinds: Sequence[str], families: Sequence[str], scenes: int) -> str:
        return config.command(kinds[1:], families, scenes)

    return goals_report(rows, wanted.key, (KINDS, LOOP_FAMILIES), command, rates_of, config.seed)


def _rows(config: LoopConfig, loaded: LoadedPlanners, scene: GoalScene, kinds: Sequence[str]) -> list[Row]:
    """Plan a scene, and build it once for each disturbance; return the rows."""
    planner = loaded.planner(config.model, config)
    build = LoopBuild(scene, *_proposed(config, loaded, scene), config.hold, loaded.objects)
    build.replanner = GoalLayouts(
        build.wanted, lambda now, rest: propose_goal(planner, config.model, now, rest, scene.planning_seed)
    )
    return [build.row(kind) for kind in kinds]


def _proposed(config: LoopConfig, loaded: LoadedPlanners, scene: GoalScene) -> tuple[Scene, list[GoalArrangement]]:
    """Observe a scene, and return the observation and the arrangements that are worth a try, best first."""
    observed = scene.observed()
    generator = torch.Generator().manual_seed(scene.planning_seed)
    try:
        found = loaded.planner(config.model, config).propose(
            observed, scene.goal, count=config.candidates, generator=generator, colors=scene.colors
        )
    except (LayoutError, SpecError):
        found = []
    return observed, [arrangement for arrangement in found if is_viable(arrangement)]

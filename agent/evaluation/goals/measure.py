"""Measure planners on the same scenes of the benchmark of goals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from agent.evaluation.goal_rows import LoadedPlanners, RowsWanted, goal_rows, goals_report
from agent.evaluation.goals.arm import build_goal_scene
from agent.evaluation.goals.config import GoalsConfig, checked_families
from agent.evaluation.goals.rates import rates_of
from agent.evaluation.goals.solve import DISTURBED, judge_disturbed, liftable_proposals, solve_goal_scene
from agent.evaluation.rows import Row
from agent.pipeline.candidates import checked_planner
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.objects.libraries import load_objects


def measure_goals(
    config: GoalsConfig,
    models: Sequence[str],
    families: Sequence[str] | None,
    scenes: int,
    *,
    disturbed: bool = False,
    workers: int | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """Measure how often goals are met, which checks fail, and the verdicts of the rivals' checks; return a JSON report.

    Args:
        config: the options on which every row depends.
        models: names of planners.
        families: of goals; `None` for all.
        scenes: number per family.
        disturbed: judge the disturbed reference arrangements too (`judge_disturbed`), as if they came from a planner.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add planners, families and scenes; the report is of all rows in it. `None` stores nothing.

    Raises:
        UsageError: for an unknown planner or family, or a folder of another evaluation.
        BadInput: for a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    models, chosen = tuple(dict.fromkeys(models)), checked_families(families)
    for name in models:  # an unknown name or a broken checkpoint is reported before any scene is drawn
        checked_planner(name, config.weights, config.allow_unverified)
    library = tuple(load_objects(config.objects))
    wanted = RowsWanted("model", (*models, DISTURBED) if disturbed else models, chosen, scenes, config.seed)
    solve = partial(_rows, replace(config, weights=config.weights and config.weights.absolute()))
    fingerprint = config.fingerprint(library, models)
    rows = goal_rows(wanted, solve, library, fingerprint, "scenes of goals", workers=workers, out=out)
    return report_of(config, rows)


def report_of(config: GoalsConfig, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the report of rows, by planner and family."""
    order = tuple(dict.fromkeys(row["model"] for row in rows)), checked_families(None)
    return goals_report(rows, "model", order, config.command, _rates, config.seed)


def _rows(config: GoalsConfig, loaded: LoadedPlanners, scene: GoalScene, models: Sequence[str]) -> list[Row]:
    """Let each planner solve a scene; return their rows."""
    rows = []
    for name in models:
        if name == DISTURBED:
            rows.append({"model": name, **judge_disturbed(scene)})
            continue
        planner = loaded.planner(name, config)
        row, observed, arrangements = solve_goal_scene(planner, scene, config.candidates)
        if config.arm:
            arrangements = liftable_proposals(planner, scene, observed, arrangements, config.candidates, config.hold)
            row["arm"] = build_goal_scene(scene, observed, arrangements, config.hold)
        rows.append({"model": name, **row})
    return rows


def _rates(rows: Sequence[Row], model: str) -> dict[str, Any]:
    return rates_of([row for row in rows if row["model"] == model])

"""Measure methods of building a figure from an example on the same scenes."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from agent.evaluation.figures.config import FiguresConfig
from agent.evaluation.figures.rates import rates_of
from agent.evaluation.goal_rows import LoadedPlanners, RowsWanted, goal_rows, goals_report
from agent.evaluation.goals.arm import build_goal_scene
from agent.evaluation.goals.solve import liftable_proposals, proposals_of
from agent.evaluation.planner_config import checked_names
from agent.evaluation.rows import Row
from agent.event_base import json_value
from agent.pipeline.candidates import checked_planner
from grounding.figures.figure import FigureError
from grounding.figures.files import write_figure
from grounding.figures.names import LIKE
from grounding.goals.goal import Goal
from structdiffusion.benchmark.figure_classifier import named
from structdiffusion.benchmark.figure_examples import METHODS, example_of
from structdiffusion.benchmark.figure_families import BLOCKS, COUNTS, FIGURE_FAMILIES
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.evaluation_protocol import SEMANTIC
from structdiffusion.objects.libraries import load_objects
from structdiffusion.observation import Scene
from structdiffusion.planners.goal_planner import GoalArrangement

_TRIED = 5  # arrangements of the success at 5


def measure_figures(
    config: FiguresConfig,
    methods: Sequence[str] | None,
    families: Sequence[str] | None,
    scenes: int,
    *,
    workers: int | None = None,
    lot: int = 0,
    out: Path | None = None,
) -> dict[str, Any]:
    """Measure how often what is built from an example, or from a name, shows the figure; return a JSON report.

    Args:
        config: the options on which every row depends.
        methods: of `METHODS`; `None` for all.
        families: of `FIGURE_FAMILIES`; `None` for the 12 of the evaluation protocol.
        lot: how many families are drawn by lot from the library instead; 0 for none.
        scenes: number per family; transfers take turns.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped.

    Raises:
        UsageError: for an unknown method, family or planner, or a folder of another evaluation.
        BadInput: for a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    if lot:
        drawn = np.random.default_rng(config.seed).permutation(list(FIGURE_FAMILIES))[:lot]
        families = [str(name) for name in drawn]
    legal = tuple(FIGURE_FAMILIES)
    chosen = checked_names("method", methods, tuple(METHODS)), checked_names("family", families or list(COUNTS), legal)
    checked_planner(config.model, config.weights, config.allow_unverified)
    blocks = () if config.objects == BLOCKS else load_objects(BLOCKS)
    library = (*load_objects(config.objects), *blocks)
    wanted = RowsWanted("method", *chosen, scenes, config.seed)
    solve = partial(_rows, replace(config, weights=config.weights and config.weights.absolute()))
    rows = goal_rows(wanted, solve, library, config.fingerprint(library), "scenes of figures", workers=workers, out=out)
    order = tuple(METHODS), tuple(FIGURE_FAMILIES)
    return goals_report(rows, "method", order, config.command, _rates, config.seed)


def _rates(rows: Sequence[Row], method: str) -> dict[str, Any]:
    return rates_of([row for row in rows if row["method"] == method])


def _rows(config: FiguresConfig, loaded: LoadedPlanners, scene: GoalScene, methods: Sequence[str]) -> list[Row]:
    """Let each method solve a scene; return their rows."""
    observed = scene.observed()
    return [{"method": method, **_row(config, loaded, scene, observed, method)} for method in methods]


def _row(config: FiguresConfig, loaded: LoadedPlanners, scene: GoalScene, observed: Scene, method: str) -> Row:
    """Return the row of one method, JSON-ready."""
    started = time.perf_counter()
    members = scene.goal.structures[0].indices
    verdicts, problem, family = [], None, None
    liftable: list[GoalArrangement] = []
    try:
        figure = METHODS[method](example_of(scene, loaded.objects), scene.family, len(members))
        with tempfile.TemporaryDirectory(prefix="structagent-figure-") as folder:
            path = Path(folder) / "figure.toml"
            write_figure(figure, path)
            part = replace(scene.goal.structures[0], shape=f"{LIKE}{path}")
            asked = replace(scene, goal=Goal((part, *scene.goal.parts[1:])))
            planner = loaded.planner(config.model, config)
            arrangements, problem = proposals_of(planner, asked, observed, config.candidates)
            if config.arm:
                liftable = liftable_proposals(planner, asked, observed, arrangements, config.candidates, config.hold)
        for arrangement in arrangements[:_TRIED]:
            verdicts.append(scene.verdict(arrangement.goal_from_initial, arrangement.aside))
            if verdicts[-1].success:
                break
    except (FigureError, SceneError) as error:
        problem = str(error)
    first = verdicts[0] if verdicts else None
    if first is not None and first.failure in (None, SEMANTIC):
        bodies = scene.bodies_at(np.asarray(first.world_from_final))
        family = named([bodies[i] for i in members], scene.table)
    row = {
        "family": scene.family,
        "kind": scene.kind,
        "number": scene.number,
        "seed": scene.seed,
        "draw": scene.draw,
        "count": len(members),
        "objects": [model.name for model in scene.models],
        "success": first is not None and first.success,
        "success_at_5": any(verdict.success for verdict in verdicts),
        "failure": NO_ARRANGEMENT if first is None else first.failure,
        "failed_checks": [] if first is None else [check.name for check in first.checks if not check.passed],
        "detail": problem if first is None else first.detail,
        "named": family,
        "seconds": round(time.perf_counter() - started, 2),
    }
    if config.arm:
        row["arm"] = build_goal_scene(scene, observed, liftable, config.hold)
    return json_value(row)

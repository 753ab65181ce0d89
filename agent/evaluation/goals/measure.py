"""Measure planners on the same scenes of the benchmark of goals: rows that are missing are computed by workers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from agent.arm.fixed_objects import with_fixed
from agent.evaluation.goals.arm import build_goal_scene
from agent.evaluation.goals.config import GoalsConfig, checked_families
from agent.evaluation.goals.rates import rates_of
from agent.evaluation.goals.solve import DISTURBED, judge_disturbed, lost_rows, proposals_of, solve_goal_scene
from agent.evaluation.report import REPORT, report_frame
from agent.evaluation.result_store import ResultStore, store_folder
from agent.evaluation.rows import LOST, Row, measured
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from structdiffusion.benchmark.goals import draw_goal_scene
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.planners.goal_planner import GoalPlanner

NO_SCENE = "no_scene"  # key of the reason in a row for which no scene can be drawn from these objects
Library = tuple[ObjectModel, ...]


@dataclass(frozen=True)
class _Job:
    """The missing rows of one scene.

    Attributes:
        family, number: of the scene.
        draw: that an earlier command accepted, or `None`.
        models: planners whose rows are missing.
    """

    family: str
    number: int
    draw: int | None
    models: tuple[str, ...]


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
    keys = {"model", "family", "number"}
    with (
        store_folder(out) as path,
        ResultStore(path, config.fingerprint(library, models), keys, (REPORT,)) as store,
        workforce(workers, None) as force,
    ):
        rows = {_key(row): row for row in measured(store.rows)}
        # Families in turn, so that the rows of an evaluation that was stopped are of all of them.
        named = (*models, DISTURBED) if disturbed else models
        jobs = list(_missing(rows, named, [(family, number) for number in range(scenes) for family in chosen]))
        absolute = replace(config, weights=config.weights and config.weights.absolute())
        with progress("scenes of goals", len(jobs)) as advance:
            for result in force.do(partial(_solve_job, absolute), _Loaded, (library,), jobs):
                if isinstance(result, Lost):
                    job = result.job
                    result = lost_rows(job.models, job.family, job.number, config.seed, result.reason, LOST)
                for row in result:
                    store.add(row)
                    rows[_key(row)] = row
                advance(all(LOST not in row for row in result))
    return _report(config, list(rows.values()))


def _key(row: Row) -> tuple[str, str, int]:
    return row["model"], row["family"], row["number"]


def _missing(rows: dict[Any, Row], models: Sequence[str], places: Sequence[tuple[str, int]]) -> Iterator[_Job]:
    draws = {(row["family"], row["number"]): row["draw"] for row in rows.values() if "draw" in row}
    for place in places:
        wanted = tuple(model for model in models if (model, *place) not in rows)
        if wanted:
            yield _Job(*place, draws.get(place), wanted)


class _Loaded:
    """The resources that a worker keeps between its jobs."""

    def __init__(self, library: Library) -> None:
        self.objects, self._cache = library, ResourceCache()

    def planner(self, name: str, config: GoalsConfig) -> GoalPlanner:
        """Return the planner of goals that uses the planner of a name for its structures."""
        return self._cache.goal_planner(name, config.weights, config.allow_unverified)


def _solve_job(config: GoalsConfig, loaded: _Loaded, job: _Job) -> list[Row]:
    """Draw a scene and let each planner solve it; return their rows."""
    try:
        scene = draw_goal_scene(loaded.objects, job.family, job.number, seed=config.seed, accepted=job.draw)
    except SceneError as error:
        return lost_rows(job.models, job.family, job.number, config.seed, str(error), NO_SCENE)
    rows = []
    for name in job.models:
        if name == DISTURBED:
            rows.append({"model": name, **judge_disturbed(scene)})
            continue
        planner = loaded.planner(name, config)
        row, observed, arrangements = solve_goal_scene(planner, scene, config.candidates)
        if config.arm:
            graspable = with_fixed(observed, config.hold)
            if graspable.fixed:
                arrangements, _ = proposals_of(planner, scene, graspable, config.candidates)
            row["arm"] = build_goal_scene(scene, observed, arrangements, config.hold)
        rows.append({"model": name, **row})
    return rows


def _report(config: GoalsConfig, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the report of rows, by planner and family."""
    models = tuple(dict.fromkeys(row["model"] for row in rows))
    families = tuple(family for family in checked_families(None) if any(row["family"] == family for row in rows))
    scenes = 1 + max((row["number"] for row in rows), default=0)
    rows = sorted(rows, key=lambda row: (models.index(row["model"]), families.index(row["family"]), row["number"]))
    drawn = [row for row in rows if NO_SCENE not in row]
    return {
        **report_frame(config.command(models, families, scenes), len(drawn), config.seed),
        "rows": rows,
        "left_out": len(rows) - len(drawn),
        "aggregate": {
            model: {
                family: rates_of([row for row in drawn if row["model"] == model and family in ("all", row["family"])])
                for family in (*families, "all")
            }
            for model in models
        },
    }

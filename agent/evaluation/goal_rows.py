"""Compute the rows of an evaluation on scenes of goals, several to a scene: the missing ones, by workers.

The rows of a scene differ in their *variant*: the planner, or what disturbs the build. A key of the row tells which.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from agent.evaluation.planner_config import PlannerConfig
from agent.evaluation.report import REPORT, report_frame
from agent.evaluation.result_store import ResultStore, store_folder
from agent.evaluation.rows import LOST, Row, measured
from agent.pipeline.resources import ResourceCache
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from structdiffusion.benchmark.goals import GoalScene, draw_goal_scene
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.planners.goal_planner import GoalPlanner

NO_SCENE = "no_scene"  # key of the reason in a row for which no scene can be drawn from these objects


@dataclass(frozen=True)
class RowsWanted:
    """The rows that an evaluation has to have.

    Attributes:
        key: of a row, that tells its variant: "model" or "disturbance".
        variants: of every scene.
        families: of goals.
        scenes: number per family.
        seed: of the scenes.
    """

    key: str
    variants: tuple[str, ...]
    families: tuple[str, ...]
    scenes: int
    seed: int

    def place(self, row: Row) -> tuple[str, str, int]:
        """Return the variant, family and number of a row."""
        return row[self.key], row["family"], row["number"]

    def missing(self, rows: Mapping[Any, Row]) -> Iterator[SceneJob]:
        """Yield a job for each scene of which a row is missing, families in turn: an evaluation that was stopped has
        rows of all of them.
        """
        draws = {(row["family"], row["number"]): row["draw"] for row in rows.values() if "draw" in row}
        for place in ((family, number) for number in range(self.scenes) for family in self.families):
            left = tuple(variant for variant in self.variants if (variant, *place) not in rows)
            if left:
                yield SceneJob(*place, draws.get(place), left)

    def without(self, job: SceneJob, why: str, reason: str) -> list[Row]:
        """Return the rows of a scene that could not be measured, with the reason under the key `why`."""
        place = {"family": job.family, "number": job.number, "seed": self.seed, why: reason}
        return [{self.key: variant, **place} for variant in job.variants]


@dataclass(frozen=True)
class SceneJob:
    """The missing rows of one scene.

    Attributes:
        family, number: of the scene.
        draw: that an earlier command accepted, or `None`.
        variants: whose rows are missing.
    """

    family: str
    number: int
    draw: int | None
    variants: tuple[str, ...]


class LoadedPlanners:
    """The resources that a worker keeps between its jobs.

    Args:
        library: the objects.

    Attributes:
        objects: the same.
        cache: of networks.
    """

    def __init__(self, library: tuple[ObjectModel, ...]) -> None:
        self.objects, self.cache = library, ResourceCache()

    def planner(self, name: str, config: PlannerConfig) -> GoalPlanner:
        """Return the planner of goals that uses the planner of a name for its structures."""
        return self.cache.goal_planner(name, config.weights, config.allow_unverified)


Solve: TypeAlias = Callable[[LoadedPlanners, GoalScene, Sequence[str]], list[Row]]


def goal_rows(
    wanted: RowsWanted,
    solve: Solve,
    library: tuple[ObjectModel, ...],
    fingerprint: Mapping[str, Any],
    what: str,
    *,
    workers: int | None = None,
    out: Path | None = None,
) -> list[Row]:
    """Return all rows in a folder, after those that are missing have been computed and added.

    Args:
        wanted: the rows.
        solve: returns the rows of some variants of a scene; it is sent to workers.
        library: the objects.
        fingerprint: the inputs on which every row depends.
        what: the term for the scenes in the progress.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come; `None` stores nothing.

    Raises:
        UsageError, BadInput: as raised by `ResultStore`.
    """
    keys = {wanted.key, "family", "number"}
    with (
        store_folder(out) as path,
        ResultStore(path, fingerprint, keys, (REPORT,)) as store,
        workforce(workers, None) as force,
    ):
        rows = {wanted.place(row): row for row in measured(store.rows)}
        jobs = list(wanted.missing(rows))
        with progress(what, len(jobs)) as advance:
            for result in force.do(partial(_solve_job, wanted, solve), LoadedPlanners, (library,), jobs):
                if isinstance(result, Lost):
                    result = wanted.without(result.job, LOST, result.reason)
                for row in result:
                    store.add(row)
                    rows[wanted.place(row)] = row
                advance(all(LOST not in row for row in result))
    return list(rows.values())


def _solve_job(wanted: RowsWanted, solve: Solve, loaded: LoadedPlanners, job: SceneJob) -> list[Row]:
    """Draw a scene; return its rows."""
    try:
        scene = draw_goal_scene(loaded.objects, job.family, job.number, seed=wanted.seed, accepted=job.draw)
    except SceneError as error:
        return wanted.without(job, NO_SCENE, str(error))
    return solve(loaded, scene, job.variants)


def goals_report(
    rows: Sequence[Row],
    key: str,
    order: tuple[Sequence[str], Sequence[str]],
    command: Callable[[Sequence[str], Sequence[str], int], str],
    rates: Callable[[Sequence[Row], str], dict[str, Any]],
    seed: int,
) -> dict[str, Any]:
    """Return the report of rows, JSON-ready: in order, and their rates by variant and family.

    Args:
        rows: all of them.
        key: as of `RowsWanted`.
        order: the variants and the families in their order; those without rows are left out.
        command: returns the command that makes the rows of variants, families and a number of scenes of each.
        rates: returns the rates of one variant among rows of all variants.
        seed: of the scenes.
    """
    variants = tuple(variant for variant in order[0] if any(row[key] == variant for row in rows))
    families = tuple(family for family in order[1] if any(row["family"] == family for row in rows))
    scenes = 1 + max((row["number"] for row in rows), default=0)
    rows = sorted(rows, key=lambda row: (variants.index(row[key]), families.index(row["family"]), row["number"]))
    drawn = [row for row in rows if NO_SCENE not in row]
    return {
        **report_frame(command(variants, families, scenes), len(drawn), seed),
        "rows": rows,
        "left_out": len(rows) - len(drawn),
        "aggregate": {
            variant: {
                family: rates([row for row in drawn if family in ("all", row["family"])], variant)
                for family in (*families, "all")
            }
            for variant in variants
        },
    }

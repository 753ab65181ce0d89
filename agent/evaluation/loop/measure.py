"""Measure builds with and without disturbances on the same scenes: rows that are missing are computed by workers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from agent.arm.disturbances import DISTURBANCES
from agent.arm.remainder import Replanner
from agent.evaluation.loop.build import KINDS, UNDISTURBED, LoopBuild
from agent.evaluation.loop.config import LoopConfig
from agent.evaluation.loop.rates import rates_of
from agent.evaluation.planner_config import checked_names
from agent.evaluation.report import REPORT, report_frame
from agent.evaluation.result_store import ResultStore, store_folder
from agent.evaluation.rows import LOST, Row, measured
from agent.evaluation.scenes import SENTENCE_PLANNERS
from agent.pipeline.candidates import checked_planner, is_viable
from agent.pipeline.laying_out import GoalLayouts
from agent.pipeline.proposing import propose_goal
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import make_goal
from agent.pipeline.table_goal import TableGoal
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from grounding.spec import SpecError
from structdiffusion.benchmark.goal_names import LOOP_FAMILIES
from structdiffusion.benchmark.goals import GoalScene, draw_goal_scene
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.parallel import Lost
from structdiffusion.planners.goal_planner import GoalArrangement, GoalPlanner
from structdiffusion.structures.structure import LayoutError

NO_SCENE = "no_scene"  # key of the reason in a row for which no scene can be drawn from these objects


@dataclass(frozen=True)
class _Job:
    """The missing rows of one scene.

    Attributes:
        family, number: of the scene.
        draw: that an earlier command accepted, or `None`.
        kinds: of the disturbances whose rows are missing.
    """

    family: str
    number: int
    draw: int | None
    kinds: tuple[str, ...]


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
    keys = {"disturbance", "family", "number"}
    with (
        store_folder(out) as path,
        ResultStore(path, config.fingerprint(library), keys, (REPORT,)) as store,
        workforce(workers, None) as force,
    ):
        rows = {_key(row): row for row in measured(store.rows)}
        # Families in turn, so that the rows of an evaluation that was stopped are of all of them.
        jobs = list(_missing(rows, kinds, [(family, number) for number in range(scenes) for family in chosen]))
        absolute = replace(config, weights=config.weights and config.weights.absolute())
        with progress("scenes of the loop", len(jobs)) as advance:
            for result in force.do(partial(_build_job, absolute), _Loaded, (library,), jobs):
                if isinstance(result, Lost):
                    result = _rows_without(result.job, config.seed, LOST, result.reason)
                for row in result:
                    store.add(row)
                    rows[_key(row)] = row
                advance(all(LOST not in row for row in result))
    return _report(config, list(rows.values()))


def _key(row: Row) -> tuple[str, str, int]:
    return row["disturbance"], row["family"], row["number"]


def _missing(rows: dict[Any, Row], kinds: Sequence[str], places: Sequence[tuple[str, int]]) -> Iterator[_Job]:
    draws = {(row["family"], row["number"]): row["draw"] for row in rows.values() if "draw" in row}
    for place in places:
        wanted = tuple(kind for kind in kinds if (kind, *place) not in rows)
        if wanted:
            yield _Job(*place, draws.get(place), wanted)


class _Loaded:
    """The resources that a worker keeps between its jobs."""

    def __init__(self, library: tuple[ObjectModel, ...]) -> None:
        self.objects, self._cache = library, ResourceCache()

    def _planner(self, config: LoopConfig) -> GoalPlanner:
        return self._cache.goal_planner(config.model, config.weights, config.allow_unverified)

    def replanner(self, config: LoopConfig, scene: GoalScene, wanted: TableGoal) -> Replanner:
        """Return what lays a scene's goal out anew."""
        planner, seed = self._planner(config), scene.planning_seed
        return GoalLayouts(wanted, lambda now, rest: propose_goal(planner, config.model, now, rest, seed))

    def proposed(self, config: LoopConfig, scene: GoalScene) -> tuple[Scene, list[GoalArrangement]]:
        """Observe a scene, and return the observation and the arrangements that are worth a try, best first."""
        planner = self._planner(config)
        observed, spec = scene.observed(), scene.goal.plain_spec
        words = {}
        if spec is not None and config.model in SENTENCE_PLANNERS:
            asked = make_goal(spec, self._cache.encoder)
            words = {"sentence": asked.sentence, "embedding": asked.embedding}
        generator = torch.Generator().manual_seed(scene.planning_seed)
        try:
            found = planner.propose(
                observed, scene.goal, count=config.candidates, generator=generator, colors=scene.colors, **words
            )
        except (LayoutError, SpecError):
            found = []
        return observed, [arrangement for arrangement in found if is_viable(arrangement)]


def _build_job(config: LoopConfig, loaded: _Loaded, job: _Job) -> list[Row]:
    """Draw a scene, plan it, and build it once for each disturbance; return the rows."""
    try:
        scene = draw_goal_scene(loaded.objects, job.family, job.number, seed=config.seed, accepted=job.draw)
    except SceneError as error:
        return _rows_without(job, config.seed, NO_SCENE, str(error))
    build = LoopBuild(scene, *loaded.proposed(config, scene), config.hold, loaded.objects)
    build.replanner = loaded.replanner(config, scene, build.wanted)
    return [build.row(kind) for kind in job.kinds]


def _rows_without(job: _Job, seed: int, key: str, reason: str) -> list[Row]:
    """Return the rows of a scene that could not be measured, with the reason under `key`."""
    return [
        {"disturbance": kind, "family": job.family, "number": job.number, "seed": seed, key: reason}
        for kind in job.kinds
    ]


def _report(config: LoopConfig, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the report of rows, by disturbance and family."""
    kinds = tuple(kind for kind in KINDS if any(row["disturbance"] == kind for row in rows))
    families = tuple(family for family in LOOP_FAMILIES if any(row["family"] == family for row in rows))
    scenes = 1 + max((row["number"] for row in rows), default=0)
    rows = sorted(rows, key=lambda row: (kinds.index(row["disturbance"]), families.index(row["family"]), row["number"]))
    drawn = [row for row in rows if NO_SCENE not in row]
    return {
        **report_frame(config.command(kinds[1:], families, scenes), len(drawn), config.seed),
        "rows": rows,
        "left_out": len(rows) - len(drawn),
        "aggregate": {
            kind: {
                family: rates_of([row for row in drawn if family in ("all", row["family"])], kind)
                for family in (*families, "all")
            }
            for kind in kinds
        },
    }

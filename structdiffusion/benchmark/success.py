"""Measure how often a planner's arrangements stand: success rate, the four failure classes, and success@k.

Every planner is measured on the same scenes, drawn by `structdiffusion.benchmark.scenes`. `solve` lets a planner
propose arrangements and tries the best-ranked ones in physics until one stands; `Evaluation` computes the rates.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import torch

from grounding.spec import SHAPES
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.evaluation_protocol import FAILURE_CLASSES, INTERSECTION
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.protocol.physical_stability import Verdict
from structdiffusion.structures.structure import LayoutError
from structdiffusion.worker_process import WORKER_DIED

SCHEMA = "structagent-success/3"
Row = dict[str, Any]
NO_ARRANGEMENT = "no arrangement"  # the planner proposed nothing: counted beside the four failure classes


class ScenePlanner(Protocol):
    """The planner to measure (see `structdiffusion.planners.factory.Planner`)."""

    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose arrangements of the scene's objects, best first."""


@dataclass(frozen=True)
class SceneResult:
    """The result of one scene: a row of the report.

    Attributes:
        scene: the scene.
        verdicts: of the best-ranked arrangements in order, up to the first that stands.
        motions: (N, 4, 4) of the best-ranked arrangement (`Arrangement.goal_from_initial`), or `None`.
        proposed: the number of arrangements that the planner proposed.
        plan_seconds: the planning time.
        seconds: the total time, from the observation to the last verdict.
        problem: why there is no arrangement, or `None`.
    """

    scene: EvaluationScene
    verdicts: tuple[Verdict, ...]
    motions: np.ndarray | None
    proposed: int
    plan_seconds: float
    seconds: float
    problem: str | None = None

    @property
    def failure(self) -> str | None:
        """Return the failure class of the best-ranked arrangement; `None` if it stands."""
        return self.verdicts[0].failure if self.verdicts else NO_ARRANGEMENT

    def success_at(self, k: int) -> bool:
        """Return whether one of the k best-ranked arrangements stands."""
        return any(verdict.success for verdict in self.verdicts[:k])

    @property
    def left(self) -> list[np.ndarray | None] | None:
        """Return the final poses (4, 4), world frame, of all objects of a best-ranked arrangement that fails.

        If a predicted pose intersects something, these are the predicted poses; otherwise the poses at the end of the
        simulation, with `None` for objects that were never placed. The result is `None` if the arrangement stands or if
        there is none.
        """
        if not self.verdicts or self.verdicts[0].success:
            return None
        if self.failure == INTERSECTION:
            return list(self.motions @ self.scene.drawn.world_from_initial[: self.scene.drawn.count])
        final = self.verdicts[0].world_from_final
        assert final is not None
        return [None if np.isnan(pose).any() else pose for pose in final]

    def to_dict(self) -> Row:
        """Return the row as JSON-ready values."""
        scene, drawn = self.scene, self.scene.drawn
        left = self.left
        return {
            "structure": scene.structure,
            "number": scene.number,
            "seed": scene.seed,
            "draw": scene.draw,
            "spec": drawn.spec.to_dict(),
            "words": scene.words,
            "parsed": scene.parsed.to_dict() if scene.parsed else None,
            "objects": [model.name for model in drawn.models[: drawn.count]],
            "distractors": [model.name for model in drawn.models[drawn.count :]],
            "success": self.success_at(1),
            "failure": self.failure,
            "first_success_rank": next((k + 1 for k, v in enumerate(self.verdicts) if v.success), None),
            "proposed": self.proposed,
            "plan_seconds": round(self.plan_seconds, 3),
            "seconds": round(self.seconds, 3),
            "problem": self.problem,
            "verdicts": [verdict.to_dict() for verdict in self.verdicts],
            "left": left and [None if pose is None else pose.round(6).tolist() for pose in left],
        }


def lost_row(structure: str, number: int, seed: int, reason: str) -> Row:
    """Return the row of a scene whose worker died: a failure class of its own, with the keys of `SceneResult.to_dict`.

    Args:
        structure, number, seed: of the scene, as in `EvaluationScene`.
        reason: as in `structdiffusion.parallel.Lost`.
    """
    return {
        "structure": structure,
        "number": number,
        "seed": seed,
        "draw": None,
        "spec": None,
        "words": None,
        "parsed": None,
        "objects": [],
        "distractors": [],
        "success": False,
        "failure": WORKER_DIED,
        "first_success_rank": None,
        "proposed": 0,
        "plan_seconds": None,
        "seconds": None,
        "problem": reason,
        "verdicts": [],
        "left": None,
    }


@dataclass(frozen=True)
class Evaluation:
    """All rows of a planner, and their success rates.

    Attributes:
        rows: one per scene, as from `SceneResult.to_dict`.
        top_k: the largest k for which success@k was measured.
        about: facts about the measurement (model, objects, seed, command...), included in the report.
    """

    rows: tuple[Row, ...]
    top_k: int
    about: dict[str, Any] = field(default_factory=dict)

    def aggregate(self) -> dict[str, dict[str, Any]]:
        """Return the rates per structure, and over all scenes as "all".

        "failures" counts the failures of the best-ranked arrangements; "into_table" is how many of them intersect the
        table, which are included in "intersection". "lost" counts the scenes whose worker died: they count as failed,
        belong to no failure class, and have no times.
        """
        groups = {shape: [row for row in self.rows if row["structure"] == shape] for shape in SHAPES}
        groups = {shape: rows for shape, rows in groups.items() if rows} | {"all": list(self.rows)}
        return {name: _rates(rows, self.top_k) for name, rows in groups.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return the evaluation as JSON-ready values: schema, about, aggregates, rows."""
        return {
            "schema": SCHEMA,
            "about": self.about,
            "top_k": self.top_k,
            "aggregate": self.aggregate(),
            "scenes": list(self.rows),
        }


def wilson_interval(successes: int, n: int, z: float = 1.959964) -> tuple[float, float]:
    """Return the Wilson score interval of a rate, 95 % by default; (0, 1) if there are no trials."""
    if not 0 <= successes <= n:
        raise ValueError(f"successes must be between 0 and n = {n}, got {successes}")
    if n == 0:
        return 0.0, 1.0
    share, spread = successes / n, z * z / n
    middle = (share + spread / 2) / (1 + spread)
    half = math.sqrt(share * (1 - share) * spread + spread * spread / 4) / (1 + spread)
    # Rounding must not put an end of the interval on the wrong side of the rate itself.
    return max(0.0, min(share, middle - half)), min(1.0, max(share, middle + half))


def solve(planner: ScenePlanner, scene: EvaluationScene, *, candidates: int = 64, top_k: int = 5) -> SceneResult:
    """Let a planner solve one scene. The scene and the planner determine everything but the times.

    Args:
        planner: the planner to measure.
        scene: the scene, with words and their embedding if the planner needs them.
        candidates: the number of arrangements that the planner proposes.
        top_k: the largest number of them to try in physics; the first that stands ends the trials.
    """
    generator = torch.Generator().manual_seed(scene.planning_seed)
    goal = StructureGoal(scene.parsed or scene.spec, scene.words, scene.embedding)
    looked = time.perf_counter()
    observed, problem = scene.observed(), None
    started = time.perf_counter()
    try:
        arrangements = planner.propose(observed, goal, count=candidates, generator=generator)
    except LayoutError as error:
        arrangements, problem = [], str(error)
    planned = time.perf_counter()
    verdicts: list[Verdict] = []
    for arrangement in arrangements[:top_k]:
        verdicts.append(scene.verdict(arrangement.goal_from_initial))
        if verdicts[-1].success:
            break
    motions = arrangements[0].goal_from_initial if arrangements else None
    seconds = time.perf_counter() - looked
    return SceneResult(scene, tuple(verdicts), motions, len(arrangements), planned - started, seconds, problem)


def _rates(rows: Sequence[Row], top_k: int) -> dict[str, Any]:
    n = len(rows)

    def rate(count: int) -> dict[str, Any]:
        low, high = wilson_interval(count, n)
        return {"count": count, "rate": count / n if n else None, "low": low, "high": high}

    causes = (*FAILURE_CLASSES, NO_ARRANGEMENT)
    first = [row["verdicts"][0] for row in rows if row["verdicts"]]
    ranks = [row["first_success_rank"] or math.inf for row in rows]
    completed = [row for row in rows if row["failure"] != WORKER_DIED]
    planning = [row["plan_seconds"] for row in completed]
    return {
        "n": n,
        "success": rate(sum(rank == 1 for rank in ranks)),
        "success_at": {str(k): rate(sum(rank <= k for rank in ranks)) for k in range(1, top_k + 1)},
        "failures": {cause: rate(sum(row["failure"] == cause for row in rows)) for cause in causes},
        "into_table": rate(sum(verdict["penetrated"] == "table" for verdict in first)),
        "lost": rate(n - len(completed)),
        "plan_seconds": float(np.mean(planning)) if planning else None,
        "plan_seconds_median": float(np.median(planning)) if planning else None,
        "plan_seconds_total": sum(planning),
        "seconds_total": sum(row["seconds"] for row in completed),
    }

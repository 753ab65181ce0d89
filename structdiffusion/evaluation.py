"""How often a planner's arrangements stand: success, the four failure classes, and success@k.

On scenes that `structdiffusion.evaluation_scenes` draws, so that every planner is measured on the same ones,
`evaluate_success` lets a planner propose and tries its best-ranked arrangements in physics until one stands, in a
process pool.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch

from grounding.spec import SHAPES
from structdiffusion.evaluation_scenes import EvaluationScene
from structdiffusion.layouts import LayoutError
from structdiffusion.observation import Arrangement, Goal, Scene
from structdiffusion.physical import Verdict
from structdiffusion.success import FAILURE_CLASSES
from structdiffusion.workers import in_parallel

SCHEMA = "structagent-success/1"
NO_ARRANGEMENT = "no arrangement"  # the planner gave up: counted beside the four failure classes


class ScenePlanner(Protocol):
    """What is measured (`structdiffusion.sampling.Planner`)."""

    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Arrangements of the scene's objects, the best first."""


@dataclass(frozen=True)
class SceneResult:
    """What became of one scene: a row of the report.

    Attributes:
        scene: which.
        verdicts: of the best-ranked arrangements in order, up to the first that stands.
        proposed: how many arrangements the planner proposed.
        plan_seconds: the time that the planner took.
        problem: why there is no arrangement, or `None`.
    """

    scene: EvaluationScene
    verdicts: tuple[Verdict, ...]
    proposed: int
    plan_seconds: float
    problem: str | None = None

    @property
    def failure(self) -> str | None:
        """The failure class of the best-ranked arrangement; `None` where it stands."""
        return self.verdicts[0].failure if self.verdicts else NO_ARRANGEMENT

    def success_at(self, k: int) -> bool:
        """Whether one of the k best-ranked arrangements stands."""
        return any(verdict.success for verdict in self.verdicts[:k])

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        scene, drawn = self.scene, self.scene.drawn
        return {
            "structure": scene.structure,
            "number": scene.number,
            "seed": scene.seed,
            "draw": scene.draw,
            "spec": drawn.spec.to_dict(),
            "words": scene.words,
            "heard": scene.heard.to_dict() if scene.heard else None,
            "objects": [model.name for model in drawn.models[: drawn.count]],
            "distractors": [model.name for model in drawn.models[drawn.count :]],
            "success": self.success_at(1),
            "failure": self.failure,
            "first_success_rank": next((k + 1 for k, v in enumerate(self.verdicts) if v.success), None),
            "proposed": self.proposed,
            "plan_seconds": round(self.plan_seconds, 3),
            "problem": self.problem,
            "verdicts": [verdict.to_dict() for verdict in self.verdicts],
        }


@dataclass(frozen=True)
class Evaluation:
    """All rows, and the rates over them.

    Attributes:
        results: one per scene.
        top_k: success@k was measured up to this k.
        about: what was measured (model, objects, seed, command...), written along.
    """

    results: tuple[SceneResult, ...]
    top_k: int
    about: dict[str, Any] = field(default_factory=dict)

    def aggregate(self) -> dict[str, dict[str, Any]]:
        """Rates per structure, and over all scenes as "all"."""
        groups = {shape: [r for r in self.results if r.scene.structure == shape] for shape in SHAPES}
        groups = {shape: rows for shape, rows in groups.items() if rows} | {"all": list(self.results)}
        return {name: _rates(rows, self.top_k) for name, rows in groups.items()}

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready: schema, about, aggregates, rows."""
        return {
            "schema": SCHEMA,
            "about": self.about,
            "top_k": self.top_k,
            "aggregate": self.aggregate(),
            "scenes": [result.to_dict() for result in self.results],
        }

    def write(self, path: str | Path) -> Path:
        """Writes it as JSON; the path, whose folder is made where it is missing."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")
        return path


def wilson_interval(successes: int, n: int, z: float = 1.959964) -> tuple[float, float]:
    """The Wilson score interval of a rate, 95 % by default; (0, 1) without any trial."""
    if not 0 <= successes <= n:
        raise ValueError(f"successes must be between 0 and n = {n}, got {successes}")
    if n == 0:
        return 0.0, 1.0
    share, spread = successes / n, z * z / n
    middle = (share + spread / 2) / (1 + spread)
    half = math.sqrt(share * (1 - share) * spread + spread * spread / 4) / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


def evaluate_success(
    load_planner: Callable[[], ScenePlanner],
    scenes: Sequence[EvaluationScene],
    *,
    candidates: int = 64,
    top_k: int = 5,
    workers: int = 1,
) -> Iterator[SceneResult]:
    """Lets a planner solve every scene; yields the results in order as they come.

    Args:
        load_planner: gives the planner; called once in each process, so it must pickle when workers > 1.
        scenes: from `evaluation_scenes.draw_evaluation_scenes`, with words and embeddings where the planner needs them.
        candidates: how many arrangements the planner proposes per scene.
        top_k: how many of them are tried in physics at most; trying ends with the first that stands.
        workers: processes.
    """
    yield from in_parallel(partial(_solved, candidates, top_k), load_planner, (), list(scenes), workers)


def _solved(candidates: int, top_k: int, planner: ScenePlanner, scene: EvaluationScene) -> SceneResult:
    generator = torch.Generator().manual_seed(scene.planning_seed)
    goal = Goal(scene.heard or scene.spec, scene.words, scene.embedding)
    observed, problem = scene.observed(), None
    started = time.perf_counter()
    try:
        arrangements = planner.propose(observed, goal, count=candidates, generator=generator)
    except LayoutError as error:
        arrangements, problem = [], str(error)
    seconds = time.perf_counter() - started
    verdicts: list[Verdict] = []
    for arrangement in arrangements[:top_k]:
        verdicts.append(scene.verdict(arrangement.goal_from_initial))
        if verdicts[-1].success:
            break
    return SceneResult(scene, tuple(verdicts), len(arrangements), seconds, problem)


def _rates(rows: Sequence[SceneResult], top_k: int) -> dict[str, Any]:
    n = len(rows)

    def rate(count: int) -> dict[str, Any]:
        low, high = wilson_interval(count, n)
        return {"count": count, "rate": count / n if n else None, "low": low, "high": high}

    causes = (*FAILURE_CLASSES, NO_ARRANGEMENT)
    return {
        "n": n,
        "success": rate(sum(row.success_at(1) for row in rows)),
        "success_at": {str(k): rate(sum(row.success_at(k) for row in rows)) for k in range(1, top_k + 1)},
        "failures": {cause: rate(sum(row.failure == cause for row in rows)) for cause in causes},
        "plan_seconds": float(np.mean([row.plan_seconds for row in rows])) if rows else None,
    }

"""Evaluate how often the arrangements of planners stand, on the same simulated scenes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from grounding.spec import FIRST_SHAPES, SHAPES
from structagent.arguments import MOST_SEED, check_choice, checked_integer, is_listing, shown, wrong_argument
from structagent.errors import public_errors
from structagent.proposals import MOST_PROPOSALS, check_model, checked_weights
from structagent.sources import checked_source

MOST_SCENES, MOST_WORKERS = 100_000, 1024
ALL = "all"  # the structures together


@dataclass(frozen=True)
class SuccessRate:
    """How often a planner's best-ranked arrangement stands.

    Attributes:
        model: the planner's name.
        structure: "circle", "line", "tower", "table setting", or "all".
        scenes: how many.
        successes: in how many of them it stands.
        rate: their share.
        low, high: its 95 % Wilson interval.
        failures: class of the evaluation protocol -> how many scenes failed with it first.
    """

    model: str
    structure: str
    scenes: int
    successes: int
    rate: float
    low: float
    high: float
    failures: Mapping[str, int]


@dataclass(frozen=True, repr=False)
class EvaluationReport:
    """The measured rates and their report.

    Attributes:
        rates: of each planner on each structure, and on "all" of them.
        command: the command line that measures the same.
        report: the whole report with a row for each scene, as printed by `structagent evaluate success --json`.
    """

    rates: tuple[SuccessRate, ...]
    command: str
    report: Mapping[str, Any]

    def rate(self, model: str, structure: str = ALL) -> SuccessRate:
        """Look a rate up.

        Raises:
            StructagentError: for a planner or structure that was not measured.
        """
        for one in self.rates:
            if (one.model, one.structure) == (model, structure):
                return one
        there = "; ".join(f"{one.model!r}, {one.structure!r}" for one in self.rates)
        raise wrong_argument(f"{shown(model)} on {shown(structure)} was not measured; legal: {there}")

    def __repr__(self) -> str:
        together = [f"{one.model} {one.successes} of {one.scenes}" for one in self.rates if one.structure == ALL]
        return f"EvaluationReport({', '.join(together)} stand)"

    def _repr_html_(self) -> str:
        from structagent.notebooks import evaluation_html

        return evaluation_html(map(asdict, self.rates))

    def __str__(self) -> str:
        """Format the rates as a table, one line each."""
        wide = max(len(one.model) for one in self.rates)
        return "\n".join(
            f"{one.model:<{wide}}  {one.structure:<13}  {one.successes:>4} of {one.scenes:<4}  {one.rate:>6.1%}  "
            f"({one.low:.1%} to {one.high:.1%})"
            for one in self.rates
        )


@public_errors()
def evaluate(
    models: str | Sequence[str] = "diffusion",
    *,
    structures: Sequence[str] = FIRST_SHAPES,
    scenes: int = 10,
    objects: str = "ycb",
    seed: int = 0,
    count: int = 64,
    weights: str | os.PathLike[str] | None = None,
    allow_unverified: bool = False,
    workers: int = 0,
    out: str | os.PathLike[str] | None = None,
) -> EvaluationReport:
    """Measure how often planners' arrangements stand, by the evaluation protocol (docs/protocol.md).

    Args:
        models: names of planners; all are measured on the same scenes.
        structures: which of the shapes that `parse` gives; by default "circle", "line", "tower" and "table setting".
            The trained planners know these four; "geometric" builds every shape.
        scenes: how many scenes for each structure.
        objects: what scenes are drawn from: "ycb", "procedural", "random_urdfs", or a folder of meshes.
        seed: of the scenes, the sensor's noise and the sampling, in [0, 2**63).
        count: arrangements that a planner proposes for each scene, 1 to 1024.
        weights: a folder of checkpoints; by default those shipped.
        allow_unverified: take checkpoints that are not what their cards say.
        workers: processes that share the work; 0 for this one alone. With more, a script needs the usual
            `if __name__ == "__main__":`, because each process imports it.
        out: a folder that stores the rows; the same call resumes there.

    Returns:
        The rates with their intervals. Progress is printed to standard error.

    Raises:
        StructagentError: for an argument, objects, checkpoints or a folder that cannot be used.
    """
    names, shapes = _checked_models(models), _checked_structures(structures)
    checked_source("simulated", objects)
    if out is not None and not isinstance(out, str | os.PathLike):
        raise wrong_argument(f"out cannot be {shown(out)}; legal: a folder, or None")
    count = checked_integer("count", count, 1, MOST_PROPOSALS)
    scenes = checked_integer("scenes", scenes, 1, MOST_SCENES)
    workers = checked_integer("workers", workers, 0, MOST_WORKERS)
    seed, folder = checked_integer("seed", seed, 0, MOST_SEED), checked_weights(weights)
    from structdiffusion.simulation.pybullet_import import import_pybullet_silently

    import_pybullet_silently()
    from agent.evaluation.success.config import TOP_K, SuccessConfig
    from agent.evaluation.success.measure import measure_success

    config = SuccessConfig(objects, folder, seed, count, allow_unverified, top_k=min(TOP_K, count))
    report = measure_success(config, names, shapes, scenes, workers=workers, out=None if out is None else Path(out))
    return EvaluationReport(tuple(_rates(report)), report["command"], report)


def _checked_models(models: Any) -> list[str]:
    names = [models] if isinstance(models, str) else models
    if not is_listing(names) or not len(names):
        raise wrong_argument(f"models cannot be {shown(models)}; legal: the name of a planner, or a list of them")
    for name in names:
        check_model(name)
    return list(names)


def _checked_structures(structures: Any) -> list[str]:
    shapes = [structures] if isinstance(structures, str) else structures
    if not is_listing(shapes) or not len(shapes):
        raise wrong_argument(f"structures cannot be {shown(structures)}; legal: a list of {', '.join(SHAPES)}")
    for shape in shapes:
        check_choice("a structure", shape, SHAPES)
    return list(shapes)


def _rates(report: Mapping[str, Any]) -> list[SuccessRate]:
    return [
        SuccessRate(
            evaluation["about"]["model"],
            structure,
            rates["n"],
            rates["success"]["count"],
            rates["success"]["rate"],
            rates["success"]["low"],
            rates["success"]["high"],
            {cause: share["count"] for cause, share in rates["failures"].items()},
        )
        for evaluation in report["evaluations"]
        for structure, rates in evaluation["aggregate"].items()
    ]

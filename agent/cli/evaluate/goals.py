"""Judge arrangements of goals of several parts: `structagent evaluate goals`."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import typer

from agent.cli.evaluate.options import CandidatesOption, RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
    Hold,
    HoldOption,
    JsonOption,
    ModelsOption,
    ObjectsOption,
    PoolOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.stdio import import_pybullet_silently
from structdiffusion.benchmark.goal_names import GOAL_FAMILIES


def goals(
    objects: ObjectsOption = "ycb",
    model: ModelsOption = None,
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(GOAL_FAMILIES), help="Family of goals to measure. Repeatable.  [default: all]"),
    ] = None,
    scenes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of scenes per family.")] = 50,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    arm: Annotated[bool, typer.Option("--arm", help="Build with the arm too.")] = False,
    hold: HoldOption = Hold.friction,
    disturbed: Annotated[
        bool,
        typer.Option("--disturbed", help="Judge the reference arrangements with every object moved by 4 cm, too."),
    ] = False,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """Measure how often goals of several parts are met.

    Scenes are drawn so that a reference arrangement passes every check of the goal. The best-ranked arrangement of each
    scene is released in physics, object by object, and with --arm built by the arm too. The looser checks of two other
    systems judge the same rows. All planners get the same scenes; --disturbed adds arrangements that are nearly right,
    to compare the checks.

    \b
    DIR gets rows.jsonl with a row per planner and scene: the same command resumes an
    evaluation that was stopped, and one with more planners, families or scenes adds to it.
    At the end eval.json has the report.

    Example: structagent evaluate goals --objects ycb --model diffusion --model geometric --out out/goals
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.goals.config import GoalsConfig
    from agent.evaluation.goals.measure import measure_goals
    from agent.evaluation.goals.report import print_goals
    from agent.evaluation.report import write_evaluation

    config = GoalsConfig(objects, weights, seed, candidates, allow_unverified, arm, hold.value)
    options: dict[str, Any] = {"disturbed": disturbed, "workers": workers, "out": out}
    measure = partial(measure_goals, config, model or ["diffusion"], family, scenes, **options)
    finish(measure, print_goals, out, json_output, write_evaluation)

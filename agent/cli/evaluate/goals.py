"""Judge arrangements of goals of several parts: `structagent evaluate goals`."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import typer

from agent.cli.arguments import with_arguments
from agent.cli.evaluate.options import EvaluationArguments
from agent.cli.options import (
    Hold,
    HoldOption,
    ModelsOption,
)
from structdiffusion.benchmark.goal_names import GOAL_FAMILIES


@with_arguments
def goals(
    arguments: EvaluationArguments,
    model: ModelsOption = None,
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(GOAL_FAMILIES), help="Family of goals to measure. Repeatable.  [default: all]"),
    ] = None,
    scenes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of scenes per family.")] = 50,
    arm: Annotated[bool, typer.Option("--arm", help="Also build with the arm.")] = False,
    hold: HoldOption = Hold.friction,
    disturbed: Annotated[
        bool,
        typer.Option("--disturbed", help="Also judge the reference arrangements with every object moved by 4 cm."),
    ] = False,
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
    arguments.begin()
    from agent.evaluation.goals.config import GoalsConfig
    from agent.evaluation.goals.measure import measure_goals
    from agent.evaluation.goals.report import print_goals

    config = GoalsConfig(**arguments.settings, arm=arm, hold=hold.value)
    options: dict[str, Any] = {"disturbed": disturbed, **arguments.storing}
    measure = partial(measure_goals, config, model or ["diffusion"], family, scenes, **options)
    arguments.finish(measure, print_goals)

"""Judge builds that are disturbed: `structagent evaluate loop`."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from agent.cli.arguments import with_arguments
from agent.cli.evaluate.options import EvaluationArguments
from agent.cli.options import (
    Hold,
    HoldOption,
    ModelOption,
)
from structdiffusion.benchmark.goal_names import LOOP_FAMILIES


@with_arguments
def loop(
    arguments: EvaluationArguments,
    model: ModelOption = "diffusion",
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(LOOP_FAMILIES), help="Family of goals to build. Repeatable.  [default: all]"),
    ] = None,
    disturb: Annotated[
        list[str] | None,
        typer.Option(
            metavar="push|remove|add|drop|topple|swap", help="Kind of disturbance. Repeatable.  [default: all]"
        ),
    ] = None,
    scenes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of scenes per family.")] = 8,
    hold: HoldOption = Hold.friction,
) -> None:
    """Measure what a build does when somebody disturbs it.

    Every scene is built without a disturbance, and once with each: something is pushed, taken away, added where
    something was to go, dropped, laid on its side, or two objects change places, at a random moment between the first
    pick and the last placement. Success is judged on the true objects; what was taken away, or lies, may be left out if
    the tool says so and the rest stands.

    \b
    DIR gets rows.jsonl with a row per build: the same command resumes an evaluation that
    was stopped, and one with more disturbances, families or scenes adds to it. At the end
    eval.json has the report.

    Example: structagent evaluate loop --objects blocks --scenes 2 --hold friction --out out/loop
    """
    arguments.begin()
    from agent.evaluation.loop.config import LoopConfig
    from agent.evaluation.loop.measure import measure_loop
    from agent.evaluation.loop.report import print_loop

    config = LoopConfig(**arguments.settings, model=model, hold=hold.value)
    measure = partial(measure_loop, config, disturb, family, scenes, **arguments.storing)
    arguments.finish(measure, print_loop)

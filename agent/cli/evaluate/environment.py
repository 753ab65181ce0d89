"""Judge policies in the environment for learning agents: `structagent evaluate environment`."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import Annotated

import typer

from agent.cli.arguments import with_arguments
from agent.cli.evaluate.options import EvaluationArguments
from agent.cli.options import (
    Hold,
    HoldOption,
)
from grounding.spec import FIRST_SHAPES


class Mode(StrEnum):
    """The ways in which an action is carried out."""

    place = "place"
    arm = "arm"


@with_arguments
def environment(
    arguments: EvaluationArguments,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="random|PLANNER",
            help="Policy to measure: random moves, or a planner whose best arrangement is built. Repeatable.  "
            "[default: random, geometric, diffusion]",
        ),
    ] = None,
    structure: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(FIRST_SHAPES), help="Structure to ask for. Repeatable.  [default: all four]"),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes per policy.")] = 30,
    mode: Annotated[
        Mode,
        typer.Option(help="How an action is carried out: released above its goal, or picked and placed by the arm."),
    ] = Mode.place,
    hold: HoldOption = Hold.friction,
    actions: Annotated[int, typer.Option(metavar="N", min=1, help="Most actions of an episode.")] = 20,
) -> None:
    """Measure policies in the environment structagent/Build-v0.

    Every policy acts in the same episodes; episode k is that of the seed plus k. It sees what every agent sees: the
    clouds of the objects and the instruction. An episode succeeds if everything stands as asked by the evaluation
    protocol. Needs the package gymnasium.

    \b
    DIR gets rows.jsonl with a row per policy and episode: the same command resumes an
    evaluation that was stopped, and one with more policies or episodes adds to it. At the
    end eval.json has the leaderboard.

    Example: structagent evaluate environment --episodes 30 --seed 0 --out out/environment
    """
    arguments.begin()
    from agent.environment.registration import register_environment

    register_environment()
    from agent.evaluation.environment.config import EnvironmentConfig
    from agent.evaluation.environment.measure import measure_environment
    from agent.evaluation.environment.report import print_environment
    from agent.evaluation.planner_config import checked_names

    config = EnvironmentConfig(
        **arguments.settings, mode=mode.value, hold=hold.value, actions=actions,
        structures=checked_names("structure", structure, FIRST_SHAPES),
    )  # fmt: skip
    measure = partial(measure_environment, config, policy, episodes, **arguments.storing)
    arguments.finish(measure, print_environment)

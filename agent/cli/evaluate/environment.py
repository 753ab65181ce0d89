"""Judge policies in the environment for learning agents: `structagent evaluate environment`."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import Annotated

import typer

from agent.cli.evaluate.options import CandidatesOption, RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
    Hold,
    HoldOption,
    JsonOption,
    ObjectsOption,
    PoolOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.stdio import import_pybullet_silently
from grounding.spec import FIRST_SHAPES


class Mode(StrEnum):
    """The ways in which an action is carried out."""

    place = "place"
    arm = "arm"


def environment(
    objects: ObjectsOption = "ycb",
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="random|PLANNER",
            help="Policy to measure: random moves, or a planner whose best arrangement is built. Repeatable.  "
            "[default: random, geometric, diffusion]",
        ),
    ] = None,
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    structure: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(FIRST_SHAPES), help="Structure to ask for. Repeatable.  [default: all four]"),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes per policy.")] = 30,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    mode: Annotated[
        Mode,
        typer.Option(help="How an action is carried out: released above its goal, or picked and placed by the arm."),
    ] = Mode.place,
    hold: HoldOption = Hold.friction,
    actions: Annotated[int, typer.Option(metavar="N", min=1, help="Most actions of an episode.")] = 20,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
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
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.environment.registration import register_environment

    register_environment()
    from agent.evaluation.environment.config import EnvironmentConfig
    from agent.evaluation.environment.measure import measure_environment
    from agent.evaluation.environment.report import print_environment
    from agent.evaluation.planner_config import checked_names
    from agent.evaluation.report import write_evaluation

    config = EnvironmentConfig(
        objects, weights, seed, candidates, allow_unverified, mode.value, hold.value, actions,
        checked_names("structure", structure, FIRST_SHAPES),
    )  # fmt: skip
    measure = partial(measure_environment, config, policy, episodes, workers=workers, out=out)
    finish(measure, print_environment, out, json_output, write_evaluation)

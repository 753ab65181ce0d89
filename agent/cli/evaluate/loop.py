"""Judge builds that are disturbed: `structagent evaluate loop`."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from agent.cli.evaluate.options import CandidatesOption, RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
    Hold,
    HoldOption,
    JsonOption,
    ModelOption,
    ObjectsOption,
    PoolOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.stdio import import_pybullet_silently
from structdiffusion.benchmark.goal_names import LOOP_FAMILIES


def loop(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
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
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    hold: HoldOption = Hold.friction,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
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
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.loop.config import LoopConfig
    from agent.evaluation.loop.measure import measure_loop
    from agent.evaluation.loop.report import print_loop
    from agent.evaluation.report import write_evaluation

    config = LoopConfig(objects, weights, seed, candidates, allow_unverified, model, hold.value)
    measure = partial(measure_loop, config, disturb, family, scenes, workers=workers, out=out)
    finish(measure, print_loop, out, json_output, write_evaluation)

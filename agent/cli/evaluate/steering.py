"""Judge what comes of what is said while the arm builds: `structagent evaluate steering`."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from agent.cli.evaluate.options import RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
    Hold,
    HoldOption,
    JsonOption,
    ModelOption,
    PoolOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.stdio import import_pybullet_silently


def steering(
    half: Annotated[
        list[str] | None,
        typer.Option(
            metavar="seen|unseen",
            help="Half of the sentences: those used in development, or the others. Repeatable.  [default: all]",
        ),
    ] = None,
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    seed: SeedOption = 0,
    hold: HoldOption = Hold.friction,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """Measure the reaction to sentences during a build.

    60 sentences are each said once while the arm builds on a drawn table of YCB scans, after a drawn number of
    placements or with an object in the hand: corrections, orders of work, questions, wait, stop, and what has to be
    refused. The reaction up to the next placement is compared with what a person expects.

    Example: structagent evaluate steering --half seen --out out/steering
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.interjections.measure import SteeringConfig, measure_steering
    from agent.evaluation.interjections.report import print_steering
    from agent.evaluation.report import write_evaluation

    config = SteeringConfig("ycb", weights, seed, allow_unverified=allow_unverified, model=model, hold=hold.value)
    finish(
        partial(measure_steering, config, half, workers=workers, out=out),
        print_steering,
        out,
        json_output,
        write_evaluation,
    )

"""Measure structures that are like an example or a name: `structagent evaluate figures`."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from agent.cli.arguments import with_arguments
from agent.cli.evaluate.options import EvaluationArguments
from agent.cli.options import Hold, HoldOption, ModelOption


@with_arguments
def figures(
    arguments: EvaluationArguments,
    model: ModelOption = "diffusion",
    method: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METHOD",
            help="template copy, curve fit, 'curve fit, no order' or name. Repeatable.  [default: all]",
        ),
    ] = None,
    family: Annotated[
        list[str] | None, typer.Option(metavar="FIGURE", help="Figure to measure. Repeatable.  [default: 12 figures]")
    ] = None,
    lot: Annotated[
        int, typer.Option("--lot", metavar="N", min=0, help="Measure N randomly drawn figures of the library instead.")
    ] = 0,
    scenes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of scenes per figure; five transfers take turns.")
    ] = 50,
    arm: Annotated[bool, typer.Option("--arm", help="Also build with the arm.")] = False,
    hold: HoldOption = Hold.friction,
) -> None:
    """Measure how often a structure like an example shows the same figure.

    Scenes are drawn so that a reference arrangement passes every check. What is built has the example's objects, other
    ones, two thirds of their number, up to twice their number, or two distractors beside it. The example is copied as a
    template, or its strokes or blocks are read off it, with and without the order in which they were drawn, or the
    figure is known by its name. Upright figures are built of blocks, all others of the objects of --objects.

    \b
    DIR gets rows.jsonl with a row per method and scene: the same command resumes an
    evaluation that was stopped, and one with more methods, figures or scenes adds to it.
    At the end eval.json has the report.

    Example: structagent evaluate figures --scenes 10 --out out/figures
    """
    arguments.begin()
    from agent.evaluation.figures.config import FiguresConfig
    from agent.evaluation.figures.measure import measure_figures
    from agent.evaluation.figures.report import print_figures

    config = FiguresConfig(**arguments.settings, model=model, arm=arm, hold=hold.value)
    measure = partial(measure_figures, config, method, family, scenes, lot=lot, **arguments.storing)
    arguments.finish(measure, print_figures)

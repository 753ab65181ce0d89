"""Measure structures that are like an example or a name: `structagent evaluate figures`."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from agent.cli.evaluate.options import CandidatesOption, RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
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


def figures(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
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
        int, typer.Option("--lot", metavar="N", min=0, help="Measure N figures drawn by lot from the library instead.")
    ] = 0,
    scenes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of scenes per figure; five transfers take turns.")
    ] = 50,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
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
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.figures.config import FiguresConfig
    from agent.evaluation.figures.measure import measure_figures
    from agent.evaluation.figures.report import print_figures
    from agent.evaluation.report import write_evaluation

    config = FiguresConfig(objects, weights, seed, candidates, allow_unverified, model)
    measure = partial(measure_figures, config, method, family, scenes, workers=workers, lot=lot, out=out)
    finish(measure, print_figures, out, json_output, write_evaluation)

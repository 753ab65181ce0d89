"""Evaluate single parts of the pipeline: `structagent evaluate completion`, `nouns`, `segmentation`, `picks`,
`discriminators` and `coverage`.
"""

from __future__ import annotations

import os
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.evaluate.options import ProcessesOption, ReportOption, ScenesOption, finish
from agent.cli.options import (
    Hold,
    HoldOption,
    JsonOption,
    ModelOption,
    ObjectsOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_paths import check_file
from agent.runtime.stdio import import_pybullet_silently

_CORES = max(1, os.cpu_count() or 1)


class TablePart(StrEnum):
    """The parts of the synthetic tables, which hold different objects."""

    development = "development"
    test = "test"


class Method(StrEnum):
    """Who tells objects apart."""

    geometry = "geometry"
    network = "network"
    both = "both"


# The commands that `evaluate_on_scenes` carries out, which have the same options, and their help texts.
ON_SCENES = {
    "nouns": (
        "Measure how often recorded objects get nouns, and how often the nouns are right.\n\n"
        "Simulated scenes are recorded. The least confidence for a noun was chosen without YCB objects.\n\n"
        "Example: structagent evaluate nouns --objects validation --scenes 10"
    ),
    "completion": (
        "Compare methods of shape completion.\n\n"
        "The unseen sides of objects are completed by all methods, and compared with the true shapes.\n\n"
        "Example: structagent evaluate completion --objects ycb --scenes 10"
    ),
}


def evaluate_on_scenes(
    ctx: typer.Context,
    objects: ObjectsOption = "ycb",
    scenes: ScenesOption = 10,
    seed: SeedOption = 0,
    workers: ProcessesOption = _CORES,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """Measure on simulated scenes what the command is named after, one of `ON_SCENES`."""
    check_file(out)
    import_pybullet_silently()
    if ctx.command.name == "nouns":
        from agent.evaluation.nouns.measurement import measure_nouns as measure
        from agent.evaluation.nouns.measurement import print_nouns as print_report
    else:
        from agent.evaluation.completion import measure_completion as measure
        from agent.evaluation.completion import print_completion as print_report

    finish(partial(measure, objects, scenes, seed, workers), print_report, out, json_output)


def segmentation(
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of labelled clouds (.pcd); by default synthetic tables are made."),
    ] = None,
    part: Annotated[
        TablePart, typer.Option(help="Objects of the synthetic tables; perception was tuned on development.")
    ] = TablePart.test,
    scenes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of synthetic tables of each class.")] = 10,
    method: Annotated[
        Method, typer.Option(help="Method that separates the objects: geometry, the network, or both.")
    ] = Method.both,
    printed: Annotated[
        bool, typer.Option("--printed", help="Draw synthetic objects with labels, caps, handles and other prints.")
    ] = False,
    seed: SeedOption = 0,
    workers: ProcessesOption = _CORES,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """Compare the objects that are found in depth pictures with the true ones.

    The labels of a cloud are those of the object segmentation database: 1 to 9 are the table, 20 to 29 the first
    object, 30 to 39 the second.

    Example: structagent evaluate segmentation --data OSD
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.segmentation.measurement import measure_segmentation, print_segmentation

    measure = partial(measure_segmentation, data, part.value, scenes, seed, workers, method.value, printed)
    finish(measure, print_segmentation, out, json_output)


def picks(
    objects: ObjectsOption = "training",
    picks: Annotated[int, typer.Option(metavar="N", min=1, help="Number of picks, of objects in turn.")] = 100,
    hold: HoldOption = Hold.friction,
    seed: SeedOption = 0,
    workers: ProcessesOption = _CORES,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """Measure how well the hand holds single objects.

    Each object is taken from one side of the table to the other, turned, and let go. Objects for which there is no
    grasp are left out before anything moves, and named.

    Example: structagent evaluate picks --objects training --picks 200 --hold friction
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.picks import measure_picks, print_picks

    finish(partial(measure_picks, objects, picks, seed, hold.value, workers), print_picks, out, json_output)


def discriminators(
    data: Annotated[
        Path, typer.Option(metavar="DIR", help="Data of `structagent generate` that was not used for training.")
    ],
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    examples: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of examples for each discriminator.")
    ] = 3000,
    seed: SeedOption = 0,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """Measure how often the discriminators are right.

    Scenes and pairs of objects that were not used for training are judged.

    Example: structagent evaluate discriminators --data data/validation
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.discriminators import measure_discriminators, print_discriminators

    measure = partial(measure_discriminators, data, weights, examples, seed, allow_unverified)
    finish(measure, print_discriminators, out, json_output)


def coverage(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    scenes: ScenesOption = 10,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(metavar="N", min=2, help="Arrangements to propose per scene.")] = 64,
    workers: ProcessesOption = _CORES,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """Measure the diversity of proposed arrangements.

    Reports how evenly they spread over the values of the slots that the instruction leaves open.

    Example: structagent evaluate coverage --objects ycb --scenes 10
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.coverage import measure_coverage, print_coverage

    options = (objects, model, weights, scenes, seed, candidates, workers, allow_unverified)
    finish(partial(measure_coverage, *options), print_coverage, out, json_output)

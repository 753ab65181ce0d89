"""The verbs of `structagent evaluate`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer

from agent.cli.config import reading_options
from agent.cli.options import (
    ForceOutOption,
    JsonOption,
    LLMModelOption,
    LLMUrlOption,
    ModelOption,
    ModelsOption,
    ObjectsOption,
    ParserOption,
    Parsers,
    PoolOption,
    RayOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.output_paths import check_file, write_report
from agent.runtime.stdio import import_pybullet_silently, results_stream
from grounding.spec import SHAPES

evaluate_app = typer.Typer(rich_markup_mode=None)

ScenesOption = Annotated[int, typer.Option(min=1, help="How many per structure.")]
CandidatesOption = Annotated[int, typer.Option(min=1, help="Arrangements imagined per scene.")]
ProcessesOption = Annotated[int, typer.Option(min=1, help="Processes.")]
RowsOption = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Keep rows and the report there, and go on where it stopped.")
]
ReportOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")]


@evaluate_app.callback()
def _evaluate() -> None:
    """Measure the models.

    Example: structagent evaluate success --objects ycb --scenes 50
    """


@evaluate_app.command("success")
def evaluate_success(
    objects: ObjectsOption = "ycb",
    model: ModelsOption = None,
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    structure: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(SHAPES), help="May be given several times.  [default: all four]"),
    ] = None,
    scenes: ScenesOption = 50,
    seed: SeedOption = 0,
    candidates: Annotated[
        int, typer.Option(min=1, help="Arrangements imagined per scene, by planners that choose among them.")
    ] = 64,
    top_k: Annotated[
        int | None,
        typer.Option(min=1, help="Measure success@k up to this k; by default 5, or --candidates where that is less."),
    ] = None,
    objects_per_scene: Annotated[
        str | None, typer.Option(metavar="LOW-HIGH", help="How many objects take part; by default as in training.")
    ] = None,
    table: Annotated[
        str | None, typer.Option(metavar="DEPTHxBREADTH", help="The table's size in metres; by default 0.54x0.90.")
    ] = None,
    camera: Annotated[
        str, typer.Option(metavar="robot|opposite|left|right", help="From which side of the table it looks.")
    ] = "robot",
    workers: PoolOption = None,
    ray: RayOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep rows, tables, plots and pictures there, and go on where it stopped."),
    ] = None,
    force: ForceOutOption = False,
    pictures: Annotated[
        int, typer.Option(min=0, help="With --out: the most pictures of failures per model and failure class.")
    ] = 5,
    json_output: JsonOption = False,
) -> None:
    """How often the best imagined arrangement stands: released piece by piece in physics, without the arm.

    \b
    Every model gets the same scenes. DIR gets rows.jsonl, a row per model and scene as
    they come: the same command goes on where it was stopped, and one with more models
    or more scenes adds to it. At the end eval.json, tables.md, success_at_k.png and
    failures.png tell all that is there, and failures/ has pictures of what failed.

    Example: structagent evaluate success --objects ycb --model diffusion --model geometric --out out/success
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.success.config import TOP_K, Asked
    from agent.evaluation.success.measure import checked_structures, measure_success
    from agent.evaluation.success.report import tell_success, write_success

    most = min(TOP_K, candidates) if top_k is None else top_k
    asked = Asked(objects, weights, seed, candidates, most, objects_per_scene, table, camera, allow_unverified)
    structures = checked_structures(structure)
    names = model or ["diffusion"]
    how = {"workers": workers, "ray": ray, "out": out, "pictures": pictures}
    measured = partial(measure_success, asked, names, structures, scenes, **how)
    _report(measured, tell_success, out, json_output, write_success)


@evaluate_app.command("arm")
def evaluate_arm(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    scenes: ScenesOption = 5,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """How often the arm finds a plan, and how often what it builds stands as asked.

    \b
    DIR gets rows.jsonl, a row per scene as they come: the same command goes on where it
    was stopped, and one with more scenes adds to it. At the end eval.json tells all.

    Example: structagent evaluate arm --objects ycb --scenes 5 --out out/arm
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.arm import measure_arm, tell_arm, write_evaluation

    how = {"workers": workers, "out": out, "allow_unverified": allow_unverified}
    measured = partial(measure_arm, objects, model, weights, scenes, seed, candidates, **how)
    _report(measured, tell_arm, out, json_output, write_evaluation)


@evaluate_app.command("recordings")
def evaluate_recordings(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    scenes: ScenesOption = 8,
    seed: SeedOption = 0,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or only try each goal without it.")
    ] = True,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """What is found in bags of simulated scenes, and whether runs over them end as in simulation.

    \b
    DIR gets rows.jsonl, a row per scene as they come: the same command goes on where it
    was stopped, and one with more scenes adds to it. At the end eval.json tells all.

    Example: structagent evaluate recordings --objects ycb --scenes 8 --out out/recordings
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.arm import write_evaluation
    from agent.evaluation.recordings import measure_recordings, tell_recordings

    how = {"workers": workers, "out": out, "allow_unverified": allow_unverified}
    measured = partial(measure_recordings, objects, model, weights, scenes, seed, execute, **how)
    _report(measured, tell_recordings, out, json_output, write_evaluation)


@evaluate_app.command("completion")
def evaluate_completion(
    objects: ObjectsOption = "ycb",
    scenes: ScenesOption = 10,
    seed: SeedOption = 0,
    workers: ProcessesOption = max(1, os.cpu_count() or 1),
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """How well the unseen sides of objects are guessed: the ways of completing them, side by side.

    Example: structagent evaluate completion --objects ycb --scenes 10
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.completion import measure_completion, tell_completion

    measured = partial(measure_completion, objects, scenes, seed, workers)
    _report(measured, tell_completion, out, json_output)


@evaluate_app.command("parse")
def evaluate_parse(
    ctx: typer.Context,
    parser: Annotated[
        list[Parsers] | None, typer.Option(help="May be given several times.  [default: embedding]")
    ] = None,
    data: Annotated[
        list[str] | None,
        typer.Option(
            metavar="templated|free|FILE", help="May be given several times.  [default: templated and free]"
        ),
    ] = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Read so many rows of each, evenly spaced; by default all.")
    ] = None,
    llm_model: LLMModelOption = None,
    llm_url: LLMUrlOption = None,
    replies: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Keep the LLM's replies there, and replay those found there.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write the report, the table and pictures of confusions there.")
    ] = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """How often an instruction ends in the right slots, and how often a parser makes something up.

    Example: structagent evaluate parse --data free --parser embedding --parser llm --out out/parsing
    """
    claim_folder(out, "evaluation", force)
    from agent.evaluation.parsing import measure_parsing, tell_parsing, write_parsing
    options = reading_options(ctx, "embedding", "robot", llm_model, llm_url)
    options = replace(options, replies=replies)
    parsers = [name.value for name in parser or [Parsers.embedding]]
    measured = partial(measure_parsing, parsers, data or ["templated", "free"], limit, options)
    _report(measured, tell_parsing, out, json_output, write_parsing)


@evaluate_app.command("language")
def evaluate_language(
    data: Annotated[
        str, typer.Option(metavar="free|templated|FILE", help="Sentences, as `structagent evaluate parse` takes them.")
    ] = "free",
    limit: Annotated[
        int | None, typer.Option(min=1, help="Take so many rows, evenly spaced; by default all.")
    ] = None,
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    parser: ParserOption = Parsers.embedding,
    as_said: Annotated[
        bool,
        typer.Option("--as-said", help="Tell sentence models the instruction itself, not what was heard, said anew."),
    ] = False,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    workers: PoolOption = None,
    ray: RayOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """What parsing costs: sentences straight through parser, planner and physics, beside the same with the slots told.

    \b
    DIR gets rows.jsonl, a row per sentence as they come: the same command goes on where
    it was stopped, and one without --limit adds to it. At the end eval.json tells all.

    Example: structagent evaluate language --data free --objects ycb --model diffusion
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.language import LanguageAsked, measure_language, tell_language, write_language

    asked = LanguageAsked(data, objects, model, weights, parser.value, seed, candidates, as_said, allow_unverified)
    measured = partial(measure_language, asked, limit, workers=workers, ray=ray, out=out)
    _report(measured, tell_language, out, json_output, write_language)


@evaluate_app.command("discriminators")
def evaluate_discriminators(
    data: Annotated[
        Path, typer.Option(metavar="DIR", help="Scenes and pairs of `structagent generate`, none of them trained on.")
    ],
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    examples: Annotated[int, typer.Option(min=1, help="How many, of each discriminator.")] = 3000,
    seed: SeedOption = 0,
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """How often the discriminators are right on scenes and pairs of objects that they were not trained on.

    Example: structagent evaluate discriminators --data data/validation
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.discriminators import measure_discriminators, tell_discriminators

    measured = partial(measure_discriminators, data, weights, examples, seed, allow_unverified)
    _report(measured, tell_discriminators, out, json_output)


@evaluate_app.command("coverage")
def evaluate_coverage(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    scenes: ScenesOption = 10,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(min=2, help="Arrangements imagined per scene.")] = 64,
    workers: ProcessesOption = max(1, os.cpu_count() or 1),
    out: ReportOption = None,
    json_output: JsonOption = False,
) -> None:
    """How evenly imagined arrangements spread over what the instruction leaves open.

    Example: structagent evaluate coverage --objects ycb --scenes 10
    """
    check_file(out)
    import_pybullet_silently()
    from agent.evaluation.coverage import measure_coverage, tell_coverage

    measured = partial(measure_coverage, objects, model, weights, scenes, seed, candidates, workers, allow_unverified)
    _report(measured, tell_coverage, out, json_output)


def _report(
    measured: Callable[[], dict[str, Any]],
    table: Callable[[dict[str, Any], TextIO], None],
    out: Path | None,
    as_json: bool,
    write: Callable[[dict[str, Any], Path], list[Path]] = write_report,
) -> None:
    """Measures; the report goes where it is to be kept, and to standard output as JSON or as the table for people."""
    with results_stream() as results:
        report = measured()
        for path in write(report, out) if out is not None else ():
            print(f"wrote {path}", file=sys.stderr)
        if as_json:
            print(json.dumps(report, indent=1, ensure_ascii=False), file=results)
        else:
            table(report, results)

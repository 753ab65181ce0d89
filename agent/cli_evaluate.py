"""The verbs of `structagent evaluate`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer

from agent.cli_options import (
    JsonOption,
    LLMModelOption,
    LLMUrlOption,
    ObjectsOption,
    ParserOption,
    Parsers,
    SeedOption,
    WeightsOption,
)
from agent.streams import import_pybullet_silently, results_stream

evaluate_app = typer.Typer(rich_markup_mode=None)


@evaluate_app.callback()
def _evaluate() -> None:
    """Measure the models.

    Example: structagent evaluate success --objects ycb --scenes 50
    """


@evaluate_app.command("success")
def evaluate_success(
    objects: ObjectsOption = "ycb",
    model: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="May be given several times.  [default: diffusion]")
    ] = None,
    weights: WeightsOption = None,
    scenes: Annotated[int, typer.Option(min=1, help="How many per structure.")] = 50,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(min=1, help="Arrangements imagined per scene.")] = 64,
    top_k: Annotated[int, typer.Option(min=1, help="Measure success@k up to this k.")] = 5,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """How often the best imagined arrangement stands: released piece by piece in physics, without the arm.

    Example: structagent evaluate success --objects ycb --model diffusion --model geometric --scenes 50
    """
    import_pybullet_silently()
    from agent.evaluating import measure_success, tell_success, write_report

    with results_stream() as results:
        report = measure_success(
            objects, model or ["diffusion"], weights, scenes, seed, candidates, top_k, workers
        )
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_success, results)


@evaluate_app.command("arm")
def evaluate_arm(
    objects: ObjectsOption = "ycb",
    model: Annotated[str, typer.Option(metavar="NAME", help="The planner.")] = "diffusion",
    weights: WeightsOption = None,
    scenes: Annotated[int, typer.Option(min=1, help="How many per structure.")] = 5,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(min=1, help="Arrangements imagined per scene.")] = 64,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """How often the arm finds a plan, and how often what it builds stands as asked.

    Example: structagent evaluate arm --objects ycb --scenes 5
    """
    import_pybullet_silently()
    from agent.evaluating import write_report
    from agent.evaluating_arm import measure_arm, tell_arm

    with results_stream() as results:
        report = measure_arm(objects, model, weights, scenes, seed, candidates, workers)
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_arm, results)


@evaluate_app.command("recordings")
def evaluate_recordings(
    objects: ObjectsOption = "ycb",
    model: Annotated[str, typer.Option(metavar="NAME", help="The planner.")] = "diffusion",
    weights: WeightsOption = None,
    scenes: Annotated[int, typer.Option(min=1, help="How many per structure.")] = 8,
    seed: SeedOption = 0,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or only try each goal without it.")
    ] = True,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """What is found in bags of simulated scenes, and whether runs over them end as in simulation.

    Example: structagent evaluate recordings --objects ycb --scenes 8
    """
    import_pybullet_silently()
    from agent.evaluating import write_report
    from agent.evaluating_recordings import measure_recordings, tell_recordings

    with results_stream() as results:
        report = measure_recordings(objects, model, weights, scenes, seed, execute, workers)
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_recordings, results)


@evaluate_app.command("completion")
def evaluate_completion(
    objects: ObjectsOption = "ycb",
    scenes: Annotated[int, typer.Option(min=1, help="How many per structure.")] = 10,
    seed: SeedOption = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """How well the unseen sides of objects are guessed: the ways of completing them, side by side.

    Example: structagent evaluate completion --objects ycb --scenes 10
    """
    import_pybullet_silently()
    from agent.evaluating import write_report
    from agent.evaluating_completion import measure_completion, tell_completion

    with results_stream() as results:
        report = measure_completion(objects, scenes, seed, workers)
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_completion, results)


@evaluate_app.command("parse")
def evaluate_parse(
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
    json_output: JsonOption = False,
) -> None:
    """How often an instruction ends in the right slots, and how often a parser makes something up.

    Example: structagent evaluate parse --data free --parser embedding --parser llm --out out/parsing
    """
    from agent.evaluating_parse import measure_parsing, tell_parsing, write_parsing
    from agent.reading import ReadingOptions

    options = ReadingOptions(llm_model=llm_model, llm_url=llm_url, replies=replies)
    parsers = [name.value for name in parser or [Parsers.embedding]]
    with results_stream() as results:
        report = measure_parsing(parsers, data or ["templated", "free"], limit, options)
        if out is not None:
            for path in write_parsing(report, out):
                print(f"wrote {path}", file=sys.stderr)
        _tell(report, json_output, tell_parsing, results)


@evaluate_app.command("language")
def evaluate_language(
    data: Annotated[
        str, typer.Option(metavar="free|templated|FILE", help="Sentences, as `structagent evaluate parse` takes them.")
    ] = "free",
    limit: Annotated[
        int | None, typer.Option(min=1, help="Take so many rows, evenly spaced; by default all.")
    ] = None,
    objects: ObjectsOption = "ycb",
    model: Annotated[str, typer.Option(metavar="NAME", help="The planner.")] = "diffusion",
    weights: WeightsOption = None,
    parser: ParserOption = Parsers.embedding,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(min=1, help="Arrangements imagined per scene.")] = 64,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """What parsing costs: sentences straight through parser, planner and physics, beside the same with the slots told.

    Example: structagent evaluate language --data free --objects ycb --model diffusion
    """
    import_pybullet_silently()
    from agent.evaluating import write_report
    from agent.evaluating_language import measure_language, tell_language
    from agent.reading import ReadingOptions

    with results_stream() as results:
        options = ReadingOptions(parser=parser.value)
        report = measure_language(data, limit, objects, model, weights, options, seed, candidates, workers)
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_language, results)


@evaluate_app.command("coverage")
def evaluate_coverage(
    objects: ObjectsOption = "ycb",
    model: Annotated[str, typer.Option(metavar="NAME", help="The planner.")] = "diffusion",
    weights: WeightsOption = None,
    scenes: Annotated[int, typer.Option(min=1, help="How many per structure.")] = 10,
    seed: SeedOption = 0,
    candidates: Annotated[int, typer.Option(min=2, help="Arrangements imagined per scene.")] = 64,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the JSON report there too.")] = None,
    json_output: JsonOption = False,
) -> None:
    """How evenly imagined arrangements spread over what the instruction leaves open.

    Example: structagent evaluate coverage --objects ycb --scenes 10
    """
    import_pybullet_silently()
    from agent.evaluating import write_report
    from agent.evaluating_coverage import measure_coverage, tell_coverage

    with results_stream() as results:
        report = measure_coverage(objects, model, weights, scenes, seed, candidates, workers)
        if out is not None:
            write_report(report, out)
        _tell(report, json_output, tell_coverage, results)


def _tell(
    report: dict[str, Any], as_json: bool, table: Callable[[dict[str, Any], TextIO], None], results: TextIO
) -> None:
    """The report on standard output: as JSON, or as the table for people."""
    if as_json:
        print(json.dumps(report, indent=1, ensure_ascii=False), file=results)
    else:
        table(report, results)

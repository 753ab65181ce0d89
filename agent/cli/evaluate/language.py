"""Measure what parsers read and the cost of their mistakes: `structagent evaluate parse` and `language`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.config import reading_options
from agent.cli.evaluate.options import CandidatesOption, LimitOption, RowsOption, finish
from agent.cli.options import (
    ForceOutOption,
    JsonOption,
    LLMModelOption,
    LLMUrlOption,
    ModelOption,
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
from agent.runtime.stdio import import_pybullet_silently


def parse(
    ctx: typer.Context,
    parser: Annotated[
        list[Parsers] | None,
        typer.Option(metavar="|".join(Parsers), help="Parser to measure. Repeatable.  [default: embedding]"),
    ] = None,
    data: Annotated[
        list[str] | None,
        typer.Option(
            metavar="templated|free|FILE",
            help="Data set of the five slots, or a file in its format (JSON lines). Repeatable.  [default: templated "
            "and free, unless there are --goals]",
        ),
    ] = None,
    goals: Annotated[
        list[str] | None,
        typer.Option(
            metavar="templated|free|FILE",
            help="Data set of goals, or a file in its format (JSON lines). Repeatable.",
        ),
    ] = None,
    limit: LimitOption = None,
    llm_model: LLMModelOption = None,
    llm_url: LLMUrlOption = None,
    replies: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File for the LLM's replies; a reply in this file is not requested again."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the report, the table and plots of the confusions.")
    ] = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """Measure how well parsers read instructions.

    Reports how often all slots are right, and how often a parser fills a slot that the instruction leaves open. With
    --goals: how often the whole goal is right, and how often parts and keys are invented, dropped or wrong.

    Example: structagent evaluate parse --data free --goals free --parser embedding --out out/parsing
    """
    claim_folder(out, "evaluation", force)
    from agent.evaluation.parsing import measure_parsing, print_parsing, write_parsing

    options = replace(reading_options(ctx, "embedding", "robot", llm_model, llm_url), replies=replies)
    parsers = [name.value for name in parser or [Parsers.embedding]]
    sets = data or ([] if goals else ["templated", "free"])
    measure = partial(measure_parsing, parsers, sets, goals or [], limit, options)
    finish(measure, print_parsing, out, json_output, write_parsing)


def language(
    data: Annotated[
        str, typer.Option(metavar="free|templated|FILE", help="Sentences, as `structagent evaluate parse` takes them.")
    ] = "free",
    limit: LimitOption = None,
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    parser: ParserOption = Parsers.embedding,
    as_said: Annotated[
        bool,
        typer.Option(
            "--as-said",
            help="Give sentence planners the instruction itself instead of a sentence made of the parsed slots.",
        ),
    ] = False,
    seed: SeedOption = 0,
    candidates: CandidatesOption = 64,
    workers: PoolOption = None,
    ray: RayOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """Measure what parsing mistakes cost.

    Sentences go through parser, planner and physics. The same scenes are solved with the true slots, and what stands
    only then is the cost of parsing.

    \b
    DIR gets rows.jsonl with a row per sentence: the same command resumes an evaluation that
    was stopped, and one without --limit adds to it. At the end eval.json has the report.

    Example: structagent evaluate language --data free --objects ycb --model diffusion
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.language import LanguageConfig, measure_language, print_language
    from agent.evaluation.report import write_evaluation

    config = LanguageConfig(data, objects, model, weights, parser.value, seed, candidates, as_said, allow_unverified)
    measure = partial(measure_language, config, limit, workers=workers, ray=ray, out=out)
    finish(measure, print_language, out, json_output, write_evaluation)

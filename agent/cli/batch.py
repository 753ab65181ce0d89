"""Carry out many instructions from a file: `structagent batch`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.arguments import RunArguments, with_arguments
from agent.cli.examples import ExactOption, LikeOption, check_example
from agent.cli.options import (
    RECORD_NEEDS_ARM,
    AcceptDrawingsOption,
    ForceOutOption,
    JsonOption,
    PoolOption,
    RayOption,
    RecordOption,
    print_error,
)
from agent.errors import UsageError
from agent.runtime.stdio import results_stream


@with_arguments
def batch(
    ctx: typer.Context,
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="Text, JSON or a table; - for standard input.", show_default=False)
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for results and reports; finished rows in it are kept.")
    ],
    arguments: RunArguments,
    force: ForceOutOption = False,
    workers: PoolOption = None,
    ray: RayOption = None,
    json_output: JsonOption = False,
    accept_drawings: AcceptDrawingsOption = False,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or stop at the goals.")
    ] = True,
    like: LikeOption = None,
    exact: ExactOption = False,
    record: RecordOption = False,
    retry: Annotated[bool, typer.Option("--retry", help="Repeat rows that failed before.")] = False,
) -> None:
    """Carry out many instructions from a file.

    The same command again carries out the rows that are missing or have changed.

    \b
    FILE has one instruction per line, with # before a comment, or JSON lines such as
      {"text": "make a line", "id": "mine", "seed": 3, "scene": "desk.yaml"}
    or a JSON array of these or of strings, or a table (commas, tabs) whose first line
    has these keys. Its content decides. Only text is required. id is unique and names the
    folder of the row's report. The other keys are named like the options below, which are
    their defaults: scene, objects, model, weights, seed, execute, parser, viewpoint,
    llm_model, llm_url, like, exact. Paths in a row are relative to the folder of FILE.
    An invalid row fails; the others run.

    \b
    DIR gets results.jsonl with a line per row, written as the rows end: a batch that is
    stopped loses only the rows in progress. rows/ID has the report and the session of
    each row, and index.html shows all rows with their pictures and reasons, and filters
    them by outcome, structure and words.

    \b
    A row that failed is only repeated with --retry, because it would fail in the same way.
    A row whose worker died, or that was in progress when the batch was stopped, is repeated.

    The exit code is 0 if all rows succeeded, otherwise that of the most serious failure, in this order: 1 (defect of
    structagent), 6, 2, 5, 8, 4, 3.

    Example: structagent batch orders.jsonl --out out/orders --workers 4
    """
    from agent.batch.run import run_batch

    check_example(like, exact, arguments.reading.parser)
    if record and not execute:
        raise UsageError(RECORD_NEEDS_ARM)
    defaults = arguments.options(ctx, execute=execute, example=like, exact=exact, record=record)
    defaults = replace(defaults, reading=replace(defaults.reading, accept_drawings=accept_drawings))
    with results_stream() as results:
        summary = run_batch(file, out, defaults, workers, ray, retry, force)
        if json_output:
            print(json.dumps(summary.to_dict(), indent=1, ensure_ascii=False), file=results)
        else:
            summary.print_table(results)
    if summary.failures:
        print_error(f"{len(summary.failures)} of {len(summary.results)} rows failed")
        raise typer.Exit(summary.exit_code)

"""`structagent batch`: many instructions from a file."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.config import reading_options
from agent.cli.options import (
    AtOption,
    CallOption,
    CameraPoseOption,
    ForceOutOption,
    JsonOption,
    EncoderOption,
    LLMModelOption,
    LLMUrlOption,
    ModelOption,
    ObjectsOption,
    ParserOption,
    Parsers,
    PoolOption,
    RayOption,
    SceneOption,
    SeedOption,
    TopicOption,
    UnverifiedOption,
    Viewpoint,
    ViewpointOption,
    WeightsOption,
    print_error,
    recorded_options,
)
from agent.runtime.stdio import results_stream


def batch(
    ctx: typer.Context,
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="JSON lines or plain text; - is standard input.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Results and reports; what is there is kept.")],
    force: ForceOutOption = False,
    scene: SceneOption = "simulated",
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    seed: SeedOption = 0,
    workers: PoolOption = None,
    ray: RayOption = None,
    json_output: JsonOption = False,
    parser: ParserOption = Parsers.embedding,
    viewpoint: ViewpointOption = Viewpoint.robot,
    encoder: EncoderOption = None,
    llm_model: LLMModelOption = None,
    llm_url: LLMUrlOption = None,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or stop at the imagined goals.")
    ] = True,
    at: AtOption = None,
    topic: TopicOption = None,
    camera_pose: CameraPoseOption = None,
    call: CallOption = None,
    allow_unverified: UnverifiedOption = False,
    retry: Annotated[bool, typer.Option("--retry", help="Carry out the rows that failed before once more.")] = False,
) -> None:
    """Carry out many instructions; called again, it does what is missing or has changed.

    \b
    FILE has an instruction a line, with # before a comment, or JSON lines such as
      {"text": "make a line", "id": "mine", "seed": 3, "scene": "desk.yaml"}
    where only text is needed; id is unique and names the report's folder; all other
    keys are called as the flags below, which hold where a row has none: scene, objects,
    model, weights, seed, execute, parser, viewpoint, encoder, llm_model, llm_url. Paths in a row
    are seen from FILE's folder. A row that is wrong fails in its place.

    \b
    DIR gets results.jsonl, a line per row, written as the rows end: a batch that is
    stopped loses only the rows at work. rows/ID has each row's report and session,
    and index.html shows all rows with their pictures.

    \b
    A row that failed is not carried out again unless --retry is given, because it would
    fail in the same way; a row that was lost when a worker died or the batch was stopped is.

    The exit code is 0 when all rows succeeded, otherwise that of the most serious failure, in this order: 1 the tool
    broke down, 6, 2, 5, 8, 4, 3.

    Example: structagent batch orders.jsonl --out out/orders --workers 4
    """
    from agent.batch.run import run_batch
    from agent.pipeline.run import RunOptions

    reading = reading_options(ctx, parser.value, viewpoint.value, llm_model, llm_url, encoder)
    recorded = recorded_options(at, topic, camera_pose, call)
    defaults = RunOptions(scene, objects, model, weights, seed, execute, reading, recorded, allow_unverified)
    with results_stream() as results:
        summary = run_batch(file, out, defaults, workers, ray, retry, force)
        if json_output:
            print(json.dumps(summary.to_dict(), indent=1, ensure_ascii=False), file=results)
        else:
            summary.print_table(results, shutil.get_terminal_size().columns if results.isatty() else None)
    if summary.failures:
        print_error(f"{len(summary.failures)} of {len(summary.results)} rows failed")
        raise typer.Exit(summary.exit_code)

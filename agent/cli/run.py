"""`structagent run`: one instruction, from its text to the built structure."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import asdict
from datetime import datetime
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
from agent.errors import DONE, INTERRUPTED, BadInput, UsageError
from agent.runtime.output_ownership import check_own_folder
from agent.runtime.stdio import (
    NO_TEXT,
    ReaderGone,
    as_text,
    import_pybullet_silently,
    results_stream,
)
from agent.runtime.terminal_text import console_on


def run(
    ctx: typer.Context,
    text: Annotated[str, typer.Argument(help="The instruction.", show_default=False)],
    scene: SceneOption = "simulated",
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    seed: SeedOption = 0,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where the report goes; by default out/TIME-seedS.")
    ] = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
    parser: ParserOption = Parsers.embedding,
    viewpoint: ViewpointOption = Viewpoint.robot,
    encoder: EncoderOption = None,
    llm_model: LLMModelOption = None,
    llm_url: LLMUrlOption = None,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build it with the arm, or stop at the imagined goal.")
    ] = True,
    rerun: Annotated[
        Path | None, typer.Option(metavar="FILE.rrd", help="Record the run for the Rerun viewer (extra `viz`).")
    ] = None,
    at: AtOption = None,
    topic: TopicOption = None,
    camera_pose: CameraPoseOption = None,
    call: CallOption = None,
    allow_unverified: UnverifiedOption = False,
    export_trajectory: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Write what the arm was told to do: .json, .bag (ROS 1), .mcap or a folder (ROS 2); may be given "
            "several times.",
        ),
    ] = None,
) -> None:
    """Read an instruction, look at the table, imagine, choose and build; then report.

    Example: structagent run "put the cups in a small circle on the left" --seed 3 --out out/cups
    """
    import_pybullet_silently()
    from agent.event_base import Listener, send
    from agent.events import Failed
    from agent.pipeline.run import RunOptions, run_instruction
    from agent.reporting.rerun_log import RerunLog
    from agent.reporting.run_report import RunRecord
    from agent.reporting.session_log import run_session
    from agent.reporting.terminal_report import TerminalReport

    replaced, text = text, as_text(text)
    if text.count(NO_TEXT) > replaced.count(NO_TEXT):
        raise BadInput(f"the instruction {text!r} has a byte that is no UTF-8 text, where {NO_TEXT} stands")
    folder = out or Path("out") / f"{datetime.now():%Y%m%d-%H%M%S}-seed{seed}"
    check_own_folder(folder, "run", force)
    reading = reading_options(ctx, parser.value, viewpoint.value, llm_model, llm_url, encoder)
    trajectories = export_trajectory or []
    if trajectories and not execute:
        raise UsageError("--export-trajectory needs the arm at work, and --no-execute stops before it")
    if trajectories:
        from agent.recordings.trajectory_export import check_export

        for path in trajectories:
            check_export(path)
    recorded = recorded_options(at, topic, camera_pose, call)
    options = RunOptions(scene, objects, model, weights, seed, execute, reading, recorded, allow_unverified)
    with ExitStack() as open_files:
        results = open_files.enter_context(results_stream())
        record = RunRecord(open_files.enter_context(run_session(folder, asdict(options))))
        viewer = open_files.enter_context(RerunLog(rerun)) if rerun is not None else None
        terminal = TerminalReport(console_on(sys.stderr if json_output else results))
        listeners: list[Listener] = [record, terminal, *([viewer] if viewer is not None else [])]
        try:
            on_step = None if viewer is None else viewer.on_physics_step
            for event in run_instruction(text, options, on_step=on_step, trajectories=trajectories):
                send(event, listeners)
        except (KeyboardInterrupt, ReaderGone):
            record.on_event(Failed("run", "interrupted", INTERRUPTED))
            raise
        finally:
            page = record.write(folder) if record.saw_something else None
            if json_output:
                print(record.json(), file=results)
            if page is not None:
                print(f"report: {page}", file=sys.stderr if json_output else results)
    outcome = record.report["outcome"]
    if outcome["exit_code"] != DONE:
        print_error(outcome["message"])
        raise typer.Exit(outcome["exit_code"])

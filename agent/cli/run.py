"""Carry out one instruction from its text to the built structure: `structagent run`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agent.cli.arguments import RunArguments, with_arguments
from agent.cli.examples import ExactOption, LikeOption, check_example
from agent.cli.options import (
    RECORD_NEEDS_ARM,
    AcceptDrawingsOption,
    ForceOutOption,
    JsonOption,
    RecordOption,
    print_error,
)
from agent.cli.robot import ApproveOption, RobotOption, robot_options
from agent.cli.serve import ViewOption, view_beside
from agent.errors import DONE, INTERRUPTED, BadInput, UsageError
from agent.runtime.output_ownership import OwnFolder, claim_folder
from agent.runtime.output_paths import folder_or_new
from agent.runtime.stdio import (
    NO_TEXT,
    ReaderGone,
    as_text,
    import_pybullet_silently,
    results_stream,
)
from agent.runtime.terminal_text import console_on
from agent.runtime.termination import Terminated

if TYPE_CHECKING:
    from agent.pipeline.real_arm import RobotOptions
    from agent.pipeline.run import RunOptions
    from agent.scenes.table_scene import TableScene
    from grounding.figures.figure import Figure


@with_arguments
def run(
    ctx: typer.Context,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="Instruction.", show_default=False)],
    arguments: RunArguments,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the report; by default out/TIME-seedSEED.")
    ] = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
    accept_drawings: AcceptDrawingsOption = False,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build the structure with the arm, or stop at the goal.")
    ] = True,
    rerun: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File for a recording for the Rerun viewer (needs the extra `viz`)."),
    ] = None,
    record: RecordOption = False,
    view: ViewOption = False,
    disturb: Annotated[
        str | None,
        typer.Option(
            metavar="KIND[@K]",
            help="Disturb the build once, at a random moment or after the K-th placement: push, remove, add, drop, "
            "topple or swap. For simulated scenes.",
        ),
    ] = None,
    like: LikeOption = None,
    exact: ExactOption = False,
    export_trajectory: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="File for the commands that the arm gets: .json, .bag (ROS 1), .mcap, or no suffix for a ROS 2 "
            "folder. Repeatable.",
        ),
    ] = None,
    robot: RobotOption = None,
    approve: ApproveOption = False,
) -> None:
    """Carry out one instruction.

    The instruction is parsed, the table is observed, arrangements are sampled and ranked, and the arm builds the best
    one. A report is written.

    Example: structagent run "put the cups in a small circle on the left" --seed 3 --out out/cups
    """
    import_pybullet_silently()
    replaced, text = text, as_text(text)
    if text.count(NO_TEXT) > replaced.count(NO_TEXT):
        raise BadInput(f"the instruction {text!r} has a byte that is not UTF-8 text, shown as {NO_TEXT}")
    disturbance = None
    if disturb is not None:
        from agent.arm.disturbances import Disturbance
        from agent.pipeline.disturbance import check_disturbance

        disturbance = Disturbance.parse(disturb)
        check_disturbance(disturbance, arguments.scene, execute)
    claim_folder(out, "run", force)
    check_example(like, exact, arguments.reading.parser)
    trajectories = export_trajectory or []
    if record and not execute:
        raise UsageError(RECORD_NEEDS_ARM)
    if trajectories and not execute:
        raise UsageError("--export-trajectory needs the arm, but --no-execute does not use it; leave out one of them")
    if trajectories:
        from agent.recordings.trajectory_export import check_export

        for path in trajectories:
            check_export(path)
    real = robot_options(robot, arguments.arm, approve, execute, arguments.hold, disturb)
    options = arguments.options(ctx, execute=execute, disturb=disturbance, record=record)
    options = replace(options, reading=replace(options.reading, accept_drawings=accept_drawings))
    with folder_or_new(out, f"seed{arguments.seed}") as folder:
        if like is not None:
            from agent.figures.examples import keep_example

            example = keep_example(like, exact, OwnFolder(folder, "run"))
            options = replace(options, reading=replace(options.reading, like=example))
        outcome = _carry_out(text, options, folder, rerun, trajectories, json_output, view, real)
    if outcome["exit_code"] != DONE:
        print_error(outcome["message"])
        raise typer.Exit(outcome["exit_code"])


def _is_accepted(unasked: bool, drawn: Sequence[Figure]) -> bool:
    """Show what a language model drew on standard error; return whether it is to be built, which a person says."""
    from agent.figures.picture import picture
    from grounding.dialogue.answers import YES, bare_words

    for figure in drawn:
        said = f"the language model drew this, of {figure.legal_numbers()} objects, for {figure.nouns[0]!r}:"
        print("\n".join(["structagent: " + said, *picture(figure)]), file=sys.stderr)
    if unasked or not sys.stdin.isatty():
        return unasked
    print("build it? [y/n] ", end="", file=sys.stderr, flush=True)
    return bare_words(sys.stdin.readline()) in YES


def _carry_out(
    text: str,
    options: RunOptions,
    folder: Path,
    rerun: Path | None,
    trajectories: list[Path],
    as_json: bool,
    view: bool = False,
    robot: RobotOptions | None = None,
) -> dict[str, Any]:
    """Carry out an instruction, print its progress and write its report; return the outcome of the report."""
    from agent.event_base import Listener, send
    from agent.events import Failed
    from agent.pipeline.resources import ResourceCache
    from agent.pipeline.run import run_instruction
    from agent.reporting.build_recording import BuildRecorder
    from agent.reporting.rerun_log import RerunLog
    from agent.reporting.run_report import RunRecord
    from agent.reporting.session_log import run_session
    from agent.reporting.terminal_report import TerminalReport

    with ExitStack() as open_files:
        results = open_files.enter_context(results_stream())
        record = RunRecord(open_files.enter_context(run_session(folder, asdict(options))))
        log = open_files.enter_context(RerunLog(rerun)) if rerun is not None else None
        viewer = open_files.enter_context(view_beside(view))
        terminal = TerminalReport(console_on(sys.stderr if as_json else results))
        recorder = BuildRecorder() if options.record else None
        listeners: list[Listener] = [record, terminal, *(one for one in (log, viewer, recorder) if one is not None)]
        watching = [one for one in (log, viewer, recorder) if one is not None]

        def on_step(table: TableScene) -> None:
            for one in watching:
                one.on_physics_step(table)

        try:
            on_table = None if viewer is None else viewer.on_table
            steps = on_step if watching else None
            cache = ResourceCache(OwnFolder(folder, "run"))
            accepts = partial(_is_accepted, options.reading.accept_drawings)
            for event in run_instruction(text, options, cache, steps, trajectories, on_table, accepts, robot):
                send(event, listeners)
        except Terminated as ended:
            record.on_event(Failed("run", ended.reason, int(ended.code or 0)))
            raise
        except (KeyboardInterrupt, ReaderGone):
            record.on_event(Failed("run", "interrupted", INTERRUPTED))
            raise
        finally:
            page = record.write(folder) if record.saw_something else None
            if recorder is not None:
                recorder.write(folder, record.report)
            if as_json:
                print(record.json(), file=results)
            if page is not None:
                print(f"report: {page}", file=sys.stderr if as_json else results)
    return record.report["outcome"]

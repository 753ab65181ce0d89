"""The command line: thin verbs over the pipeline, the trainers and the evaluator.

Everything heavy is imported inside the verb that needs it, so that `--help` answers at once.
"""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from agent import __version__
from agent.cli_bag import bag_app
from agent.cli_batch import batch
from agent.cli_chat import chat
from agent.cli_completion import completion
from agent.cli_config import ConfiguredGroup, config_app, reading_options
from agent.cli_doctor import doctor
from agent.cli_evaluate import evaluate_app
from agent.cli_models import models_app
from agent.cli_options import (
    AtOption,
    CallOption,
    CameraPoseOption,
    ForceOutOption,
    JsonOption,
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
    complain,
    recorded_options,
)
from agent.cli_report import replay, report
from agent.cli_scene import scene_app
from agent.cli_train import generate, train
from agent.errors import (
    BAD_INPUT,
    DONE,
    INTERRUPTED,
    NOT_BUILDABLE,
    USAGE,
    BadInput,
    UsageError,
    exit_code_of,
    one_sentence,
)
from agent.ownership import check_own_folder
from agent.streams import NO_TEXT, ReaderGone, as_text, import_pybullet_silently, lines_as_they_come, results_stream
from agent.terminal_text import console_on

# Typer carries its own copy of click in some versions and uses the installed one in others; its public
# BadParameter is a usage error in both, and that is the general click error.
_ClickError = typer.BadParameter.__bases__[0].__bases__[0]

app = typer.Typer(
    cls=ConfiguredGroup,
    name="structagent",
    help="From a sentence to a built structure: reads an instruction, looks at a table, imagines arrangements, and "
    "builds the best one with a simulated arm.\n\n"
    'Example: structagent run "put the cups in a small circle on the left"',
    epilog="Exit codes: 0 done; 2 usage; 3 instruction not understood or not buildable with these objects; "
    "4 no valid goal; 5 execution failed; 6 bad input data; 7 a model is not what its card says; "
    "8 built with some of the objects that were asked for; 130 interrupted.",
    add_completion=False,
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(evaluate_app, name="evaluate")
app.add_typer(scene_app, name="scene")
app.add_typer(config_app, name="config")
app.add_typer(bag_app, name="bag")
app.add_typer(models_app, name="models")
app.command("chat")(chat)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"structagent {__version__}")
        raise typer.Exit()


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
    trust_project: Annotated[
        bool,
        typer.Option(
            "--trust-project",
            help="Let structagent.toml of this folder or one above name a folder of a language model, and endpoints on "
            "other machines. The endpoint's key is not sent to an endpoint of that file in any case.",
        ),
    ] = False,
) -> None:
    """Options before the verb."""


@app.command()
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
    from agent.events import Failed
    from agent.pipeline import RunOptions, run_instruction
    from agent.record import RunRecord
    from agent.report import TerminalReport
    from agent.rerun_log import RerunLog
    from agent.session_file import run_session

    replaced, text = text, as_text(text)
    if text.count(NO_TEXT) > replaced.count(NO_TEXT):
        raise BadInput(f"the instruction {text!r} has a byte that is no UTF-8 text, where {NO_TEXT} stands")
    folder = out or Path("out") / f"{datetime.now():%Y%m%d-%H%M%S}-seed{seed}"
    check_own_folder(folder, "run", force)
    reading = reading_options(ctx, parser.value, viewpoint.value, llm_model, llm_url)
    trajectories = export_trajectory or []
    if trajectories and not execute:
        raise UsageError("--export-trajectory needs the arm at work, and --no-execute stops before it")
    if trajectories:
        from agent.twin.trajectory import check_export

        for path in trajectories:
            check_export(path)
    recorded = recorded_options(at, topic, camera_pose, call)
    options = RunOptions(scene, objects, model, weights, seed, execute, reading, recorded, allow_unverified)
    with ExitStack() as open_files:
        results = open_files.enter_context(results_stream())
        record = RunRecord(open_files.enter_context(run_session(folder, asdict(options))))
        viewer = open_files.enter_context(RerunLog(rerun)) if rerun is not None else None
        tell = TerminalReport(console_on(sys.stderr if json_output else results))
        listeners = [record, tell] + ([viewer] if viewer is not None else [])
        try:
            for event in run_instruction(text, options, watch=viewer and viewer.watch, trajectories=trajectories):
                for listener in listeners:
                    listener(event)
        except (KeyboardInterrupt, ReaderGone):
            record(Failed("run", "interrupted", INTERRUPTED))
            raise
        finally:
            page = record.write(folder) if record.saw_something else None
            if json_output:
                print(record.json(), file=results)
            if page is not None:
                print(f"report: {page}", file=sys.stderr if json_output else results)
    outcome = record.report["outcome"]
    if outcome["exit_code"] != DONE:
        complain(outcome["message"])
        raise typer.Exit(outcome["exit_code"])


app.command("batch")(batch)
app.command("replay")(replay)
app.command("report")(report)


@app.command()
def parse(
    ctx: typer.Context,
    texts: Annotated[
        list[str] | None,
        typer.Argument(metavar="TEXT", help="Instructions; without any, one a line from standard input."),
    ] = None,
    parser: ParserOption = Parsers.embedding,
    viewpoint: ViewpointOption = Viewpoint.robot,
    objects: Annotated[
        str | None, typer.Option(metavar="NAMES", help='What is on the table, as "mug,bowl,plate,fork".')
    ] = None,
    llm_model: LLMModelOption = None,
    llm_url: LLMUrlOption = None,
    json_output: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
) -> None:
    """Read instructions into the five slots, with a confidence for each; or ask, or refuse.

    Example: structagent parse "build a tower on the right" "stack the cans" --objects "can,can,mug" --json
    """
    from agent.reading import read_instructions

    if not texts and (sys.stdin is None or sys.stdin.isatty()):
        raise UsageError("parse needs an instruction, as an argument or on standard input, one a line")
    # As JSON every line has its row, an empty one too, so that rows and lines can be counted off.
    given = [list(map(as_text, texts))] if texts else lines_as_they_come(sys.stdin, keep_blank=json_output)
    names = None if objects is None else [name.strip() for name in objects.split(",") if name.strip()]
    if names == []:
        raise UsageError(f'--objects must name objects, as "mug,bowl,plate", and {objects!r} names none')
    options = reading_options(ctx, parser.value, viewpoint.value, llm_model, llm_url)
    with results_stream() as results:
        read, refused = read_instructions(given, options, names, json_output, results, complain)
    if not read:
        raise UsageError("parse needs an instruction, and standard input had none")
    if refused:
        raise typer.Exit(NOT_BUILDABLE)


app.command("generate")(generate)
app.command("train")(train)
app.command("doctor")(doctor)
app.command("completion")(completion)


def _usage_sentence(error: Exception) -> str:
    """A click error in one sentence, with the legal commands where one was missing or unknown."""
    message = error.format_message().rstrip(".").replace("Value error, ", "")  # type: ignore[attr-defined]
    # Newer versions of typer check values with pydantic, whose messages do not say what was given.
    for detail in error.__cause__.errors() if hasattr(error.__cause__, "errors") else ():
        given = repr(detail["input"])
        message += "" if given in message else f" (got {given})"
    command = getattr(getattr(error, "ctx", None), "command", None)
    verbs = getattr(command, "commands", None)
    return message[:1].lower() + message[1:] + (f"; commands: {', '.join(verbs)}" if verbs else "")


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and ends the process with its exit code; every error is one sentence."""
    sys.exit(command_line(arguments))


def command_line(arguments: list[str] | None = None) -> int:
    """Runs one command line; its exit code. A defect of our own is raised, everything else is told in a sentence."""
    try:
        code = app(args=arguments, prog_name="structagent", standalone_mode=False)
        sys.stdout.flush()
        if code == INTERRUPTED:  # typer swallows the interruption itself
            complain("interrupted")
        return code if isinstance(code, int) else DONE
    except _ClickError as error:
        complain(_usage_sentence(error))
        return USAGE
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted")
        return INTERRUPTED
    except MemoryError:
        complain("there is not enough memory; end other programs, or raise the limit of this one (ulimit -v)")
        return BAD_INPUT
    except ImportError as error:
        if (error.name or "").partition(".")[0] in ("agent", "grounding", "structdiffusion"):
            raise
        complain(f"cannot load a library: {one_sentence(error)}; `structagent doctor` names what would mend it")
        return BAD_INPUT
    except Exception as error:
        code = exit_code_of(error)
        if code is None:
            raise
        complain(one_sentence(error))
        return code

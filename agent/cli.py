"""The command line: thin verbs over the pipeline, the trainers and the evaluator.

Everything heavy is imported inside the verb that needs it, so that `--help` answers at once.
"""

from __future__ import annotations

import os
import sys
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from agent import __version__
from agent.errors import DONE, INTERRUPTED, NOT_BUILDABLE, USAGE, UsageError, exit_code_of, one_sentence
from agent.streams import import_pybullet_silently, results_stream

# Typer carries its own copy of click in some versions and uses the installed one in others; its public
# BadParameter is a usage error in both, and that is the general click error.
_ClickError = typer.BadParameter.__bases__[0].__bases__[0]

app = typer.Typer(
    name="structagent",
    help="From a sentence to a built structure: reads an instruction, looks at a table, imagines arrangements, and "
    "builds the best one with a simulated arm.\n\n"
    'Example: structagent run "put the cups in a small circle on the left"',
    epilog="Exit codes: 0 done; 2 usage; 3 instruction not understood or not buildable with these objects; "
    "4 no valid goal; 5 execution failed; 6 bad input data; 130 interrupted.",
    add_completion=False,
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
evaluate_app = typer.Typer(rich_markup_mode=None)
app.add_typer(evaluate_app, name="evaluate")


class SceneSource(str, Enum):
    """Where the scene comes from."""

    simulated = "simulated"


class ModelKind(str, Enum):
    """Which network is trained."""

    diffusion = "diffusion"
    structure = "structure"
    collision = "collision"


ObjectsOption = Annotated[
    str, typer.Option(metavar="ycb|procedural|random_urdfs|DIR", help="The objects: a library, or a folder of meshes.")
]
ModelOption = Annotated[str, typer.Option(metavar="NAME", help="diffusion, diffusion-tokens or geometric.")]
WeightsOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Checkpoints diffusion/, structure/ and collision/; by default those shipped."),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Everything drawn at random follows from it.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON to standard output, and nothing else.")]



def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"structagent {__version__}")
        raise typer.Exit()


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Options before the verb."""


@app.command()
def run(
    text: Annotated[str, typer.Argument(help="The instruction.", show_default=False)],
    scene: Annotated[SceneSource, typer.Option(help="Where the scene comes from.")] = SceneSource.simulated,
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    seed: SeedOption = 0,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where the report goes; by default out/TIME-seedS.")
    ] = None,
    json_output: JsonOption = False,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build it with the arm, or stop at the imagined goal.")
    ] = True,
) -> None:
    """Read an instruction, look at the table, imagine, choose and build; then report.

    Example: structagent run "put the cups in a small circle on the left" --seed 3 --out out/cups
    """
    import_pybullet_silently()
    from rich.console import Console

    from agent.events import Failed
    from agent.pipeline import RunOptions, run_instruction
    from agent.record import RunRecord
    from agent.report import TerminalReport

    folder = out or Path("out") / f"{datetime.now():%Y%m%d-%H%M%S}-seed{seed}"
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"--out must be a folder, and {str(folder)!r} is a file")
    options = RunOptions(scene.value, objects, model, weights, seed, execute)
    with results_stream() as results:
        record = RunRecord()
        tell = TerminalReport(Console(file=sys.stderr if json_output else results))
        try:
            for event in run_instruction(text, options):
                record(event)
                tell(event)
        except KeyboardInterrupt:
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
        _complain(outcome["message"])
        raise typer.Exit(outcome["exit_code"])


@app.command()
def parse(
    texts: Annotated[
        list[str] | None,
        typer.Argument(metavar="TEXT", help="Instructions; without any, one a line from standard input."),
    ] = None,
    json_output: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
) -> None:
    """Read instructions into the five slots, with a confidence for each.

    Example: structagent parse "build a tower on the right" "set the table facing west" --json
    """
    from agent.reading import read_instructions

    if not texts and sys.stdin.isatty():
        raise UsageError("parse needs an instruction, as an argument or on standard input, one a line")
    lines = texts if texts else [line.strip() for line in sys.stdin if line.strip()]
    if not lines:
        raise UsageError("parse needs an instruction, and standard input had none")
    with results_stream() as results:
        not_understood = read_instructions(lines, json_output, results, _complain)
    if not_understood:
        raise typer.Exit(NOT_BUILDABLE)


@app.command()
def generate(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the scenes go; finished shards there are kept.")],
    scenes: Annotated[int, typer.Option(min=1, help="How many, rounded up to whole shards of 500.")] = 10_000,
    pairs: Annotated[int, typer.Option(min=1, help="Pairs of objects for the collision discriminator.")] = 100_000,
    objects: ObjectsOption = "training",
    seed: SeedOption = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = max(1, os.cpu_count() or 1),
) -> None:
    """Draw training scenes with the geometric planner, towers proven in physics.

    Example: structagent generate --out data/train --scenes 20000 --workers 8
    """
    import_pybullet_silently()
    from agent.training import generate_scenes

    generate_scenes(out, scenes, pairs, objects, seed, workers)


@app.command()
def train(
    kind: Annotated[ModelKind, typer.Argument(metavar="diffusion|structure|collision", show_default=False)],
    data: Annotated[Path, typer.Option(metavar="DIR", help="Scenes that `structagent generate` made.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Checkpoint, training state and log.csv of this run.")],
    steps: Annotated[
        int | None, typer.Option(min=1, help="In all, earlier runs included; by default what suits the model.")
    ] = None,
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda", help="Where to train.")] = "auto",
    seed: SeedOption = 0,
    learning_rate: Annotated[float | None, typer.Option(min=0.0, help="Its peak; by default what suits.")] = None,
    batch: Annotated[int | None, typer.Option(min=3, help="Scenes, or pairs, per step; likewise.")] = None,
) -> None:
    """Train the denoiser or one of the discriminators; a run that was stopped goes on where it stopped.

    Example: structagent train diffusion --data data/train --out runs/diffusion --steps 12000
    """
    from dataclasses import replace

    from agent.training import RECIPES, train_model

    given = {"steps": steps, "learning_rate": learning_rate, "batch": batch}
    recipe = replace(RECIPES[kind.value], **{name: value for name, value in given.items() if value is not None})
    train_model(kind.value, data, out, recipe, device, seed)


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
    import json

    from agent.evaluating import measure_success, tell_success, write_report

    with results_stream() as results:
        report = measure_success(
            objects, model or ["diffusion"], weights, scenes, seed, candidates, top_k, workers
        )
        if out is not None:
            write_report(report, out)
        if json_output:
            print(json.dumps(report, indent=1), file=results)
        else:
            tell_success(report, results)


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
    import json

    from agent.evaluating import write_report
    from agent.evaluating_arm import measure_arm, tell_arm

    with results_stream() as results:
        report = measure_arm(objects, model, weights, scenes, seed, candidates, workers)
        if out is not None:
            write_report(report, out)
        if json_output:
            print(json.dumps(report, indent=1), file=results)
        else:
            tell_arm(report, results)


def _complain(message: str) -> None:
    print(f"structagent: {message}", file=sys.stderr)


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
            _complain("interrupted")
        return code if isinstance(code, int) else DONE
    except _ClickError as error:
        _complain(_usage_sentence(error))
        return USAGE
    except (KeyboardInterrupt, typer.Abort):
        _complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        code = exit_code_of(error)
        if code is None:
            raise
        _complain(one_sentence(error))
        return code

"""Export recorded runs for other tools: `structagent export lerobot` and `structagent export mcap`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from agent.cli.options import JsonOption, print_error
from agent.errors import BAD_INPUT, NotWritten, UsageError
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import results_stream

if TYPE_CHECKING:
    from agent.export.recorded_runs import LeftOut

export_app = typer.Typer(rich_markup_mode=None)

RunsOption = Annotated[
    Path, typer.Option(metavar="DIR", help="Folder in which runs are looked for: of one run, of a batch, or above.")
]


@export_app.callback()
def _export() -> None:
    """Export recorded runs for other tools: as a data set, or to look at them.

    Runs are recorded with the option --record of run and batch.

    Example: structagent export lerobot --runs out/orders --out out/dataset
    """


@export_app.command("lerobot")
def lerobot(
    runs: RunsOption,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the data set, new or empty.")],
    json_output: JsonOption = False,
) -> None:
    """Export recorded runs as a LeRobot dataset (version 3).

    A run is an episode and its instruction the task. A frame has the picture of the fixed camera, the positions of
    joints and fingers, and their commands as the action, ten times a second. Successes and goals are in the table of
    episodes; runs that failed are exported too. Needs the package pyarrow.

    A run without a recording, or with one that cannot be read, is named and left out; the exit code then is 6.

    Example: structagent export lerobot --runs out/orders --out out/dataset
    """
    _check_empty(out)
    try:
        from agent.export.lerobot import export_lerobot
    except ImportError as error:
        raise UsageError("the export needs the package pyarrow: pip install 'structagent[lerobot]'") from error
    from agent.export.recorded_runs import recorded_runs

    with results_stream() as results:
        done = export_lerobot(recorded_runs(runs), out)
        if json_output:
            counts = {"episodes": done.episodes, "frames": done.frames, "successes": done.successes}
            _print_json(counts, done.left_out, results)
        else:
            print(
                f"{done.episodes} episodes, {done.successes} of them as asked, {done.frames} frames: {out}",
                file=results,
            )
    _name_left_out(done.left_out)


@export_app.command("mcap")
def mcap(
    runs: RunsOption,
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE", help="New file that ends in .mcap, for one run; or a new or empty folder, for a file each."
        ),
    ],
    layout: Annotated[
        Path | None, typer.Option(metavar="FILE", help="New file (.json) for a layout that shows it in Foxglove.")
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Export recorded runs as MCAP files, to look at them in Foxglove.

    A file has the camera, the joints and the fingers with their commands, the frames of the arm and of all objects with
    their bodies, and a log of what happened, in the schemas of Foxglove. Needs the package foxglove-sdk.

    A run without a recording, or with one that cannot be read, is named and left out; the exit code then is 6.

    Example: structagent export mcap --runs out/cups --out cups.mcap --layout layout.json
    """
    try:
        from agent.export.mcap import LAYOUT, SUFFIX, export_mcap
    except ImportError as error:
        raise UsageError("the export needs the package foxglove-sdk: pip install 'structagent[mcap]'") from error
    from agent.export.recorded_runs import recorded_runs

    if out.suffix == SUFFIX:
        _check_new("--out", out)
    else:
        _check_empty(out)
    if layout is not None:
        _check_new("--layout", layout)
    with results_stream() as results:
        done = export_mcap(recorded_runs(runs), out)
        if layout is not None:
            _write_layout(layout, LAYOUT.read_text(encoding="utf-8"))
        if json_output:
            counts = {"files": list(map(str, done.files)), "frames": done.frames, "events": done.events}
            _print_json(counts, done.left_out, results)
        else:
            number = "1 run" if len(done.files) == 1 else f"{len(done.files)} runs"
            print(f"{number}, {done.frames} frames, {done.events} events: {out}", file=results)
    _name_left_out(done.left_out)


def _check_empty(out: Path) -> None:
    check_folder(out)
    if out.exists() and any(out.iterdir()):
        raise UsageError(f"--out must be a new or an empty folder, but {str(out)!r} is not empty")


def _check_new(option: str, path: Path) -> None:
    if path.exists():
        raise UsageError(f"{option} must be a new file, and {str(path)!r} exists")


def _write_layout(path: Path, content: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    except OSError as error:
        raise NotWritten(f"cannot write the layout {str(path)!r}: {error.strerror}") from error


def _print_json(counts: Mapping[str, Any], left_out: Sequence[LeftOut], results: TextIO) -> None:
    named = [{"run": one.name, "reason": one.reason} for one in left_out]
    print(json.dumps({**counts, "left_out": named}, indent=1, ensure_ascii=False), file=results)


def _name_left_out(left_out: Sequence[LeftOut]) -> None:
    """Name the runs that were left out.

    Raises:
        typer.Exit: if there are any.
    """
    for one in left_out:
        print_error(f"the run {one.name} is left out: {one.reason}")
    if left_out:
        raise typer.Exit(BAD_INPUT)

"""Export recorded runs as data sets: `structagent export lerobot`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import JsonOption, print_error
from agent.errors import BAD_INPUT, UsageError
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import results_stream

export_app = typer.Typer(rich_markup_mode=None)


@export_app.callback()
def _export() -> None:
    """Export recorded runs as data sets for other tools.

    Runs are recorded with the option --record of run and batch.

    Example: structagent export lerobot --runs out/orders --out out/dataset
    """


@export_app.command("lerobot")
def lerobot(
    runs: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder in which runs are looked for: of one run, of a batch, or above.")
    ],
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
    check_folder(out)
    if out.exists() and any(out.iterdir()):
        raise UsageError(f"--out must be a new or an empty folder, and {str(out)!r} is not empty")
    try:
        from agent.export.lerobot import export_lerobot
    except ImportError as error:
        raise UsageError("the export needs the package pyarrow: pip install 'structagent[lerobot]'") from error
    from agent.export.recorded_runs import recorded_runs

    with results_stream() as results:
        done = export_lerobot(recorded_runs(runs), out)
        if json_output:
            left_out = [{"run": one.name, "reason": one.reason} for one in done.left_out]
            counts = {"episodes": done.episodes, "frames": done.frames, "successes": done.successes}
            print(json.dumps({**counts, "left_out": left_out}, indent=1, ensure_ascii=False), file=results)
        else:
            print(
                f"{done.episodes} episodes, {done.successes} of them as asked, {done.frames} frames: {out}",
                file=results,
            )
    for one in done.left_out:
        print_error(f"the run {one.name} is left out: {one.reason}")
    if done.left_out:
        raise typer.Exit(BAD_INPUT)

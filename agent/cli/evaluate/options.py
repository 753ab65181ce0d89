"""Share the options of the evaluations, and the printing and writing of a report."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer

from agent.cli.options import print_error
from agent.errors import DEFECT
from agent.runtime.output_paths import write_report
from agent.runtime.stdio import results_stream
from grounding.parse_result import shortened

Report = dict[str, Any]

ScenesOption = Annotated[int, typer.Option(metavar="N", min=1, help="Number of scenes per structure.")]
CandidatesOption = Annotated[int, typer.Option(metavar="N", min=1, help="Arrangements to propose per scene.")]
ProcessesOption = Annotated[int, typer.Option(metavar="N", min=1, help="Worker processes.")]
LimitOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Largest number of rows of each data set, evenly spaced; by default all."),
]
RowsOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Folder for the rows and the report; an evaluation in it is resumed."),
]
ReportOption = Annotated[Path | None, typer.Option(metavar="FILE", help="File for the report as JSON.")]


def finish(
    measure: Callable[[], Report],
    print_report: Callable[[Report, TextIO], None],
    out: Path | None,
    as_json: bool,
    write: Callable[[Report, Path], list[Path]] = write_report,
) -> None:
    """Measure, write the report to `out`, and print it to standard output.

    The command ends with the exit code of a defect if the program itself failed at rows; the report's "defects" name
    them, and they count as wrong.

    Args:
        measure: makes the report.
        print_report: prints its tables.
        out: what `--out` names; `None` writes nothing.
        as_json: print JSON, not tables.
        write: writes the report, and gives the paths of the files.
    """
    with results_stream() as results:
        report = measure()
        for path in write(report, out) if out is not None else ():
            print(f"wrote {path}", file=sys.stderr)
        if as_json:
            print(json.dumps(report, indent=1, ensure_ascii=False), file=results)
        else:
            print_report(report, results)
    if defects := report.get("defects"):
        for defect in defects:
            print_error(f"{shortened(defect['text'])!r} was not read: {defect['message']}")
        raise typer.Exit(DEFECT)

"""Share the options of the evaluations, and the printing and writing of a report."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer

from agent.cli.options import (
    ForceOutOption,
    JsonOption,
    ObjectsOption,
    PoolOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
    print_error,
)
from agent.errors import DEFECT
from agent.runtime.output_ownership import claim_folder
from agent.runtime.output_paths import write_report
from agent.runtime.stdio import import_pybullet_silently, results_stream
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


@dataclass(frozen=True)
class EvaluationArguments:
    """What the evaluations of planners have in common; each stores a row for each scene."""

    objects: ObjectsOption = "ycb"
    weights: WeightsOption = None
    allow_unverified: UnverifiedOption = False
    seed: SeedOption = 0
    candidates: CandidatesOption = 64
    workers: PoolOption = None
    out: RowsOption = None
    force: ForceOutOption = False
    json_output: JsonOption = False

    @property
    def settings(self) -> dict[str, Any]:
        """Return the fields of `agent.evaluation.planner_config.PlannerConfig`."""
        return {
            "objects": self.objects,
            "weights": self.weights,
            "seed": self.seed,
            "candidates": self.candidates,
            "allow_unverified": self.allow_unverified,
        }

    @property
    def storing(self) -> dict[str, Any]:
        """Return who makes the rows, and where they are stored."""
        return {"workers": self.workers, "out": self.out}

    def begin(self) -> None:
        """Claim the folder for rows, before anything heavy is imported.

        Raises:
            UsageError: if it holds something else.
        """
        claim_folder(self.out, "evaluation", self.force)
        import_pybullet_silently()

    def finish(
        self,
        measure: Callable[[], Report],
        print_report: Callable[[Report, TextIO], None],
        write: Callable[[Report, Path], list[Path]] | None = None,
    ) -> None:
        """Measure, write the report (by default eval.json beside the rows), and print it."""
        from agent.evaluation.report import write_evaluation

        finish(measure, print_report, self.out, self.json_output, write or write_evaluation)


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

"""Build the parts that all evaluation reports share: command, version, rates with 95 % intervals, tables and notes."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, TextIO

from agent import __version__
from agent.evaluation.result_store import checksum_of_code
from agent.rendering.text import aligned, columns_of
from agent.runtime.output_paths import write_report
from structdiffusion.benchmark.success import wilson_interval
from structdiffusion.worker_process import WORKER_DIED

SCHEMA_VERSION = 2
REPORT = "eval.json"  # beside the rows
Row = dict[str, Any]


def command_line(verb: str, **options: Any) -> str:
    """Return the command `structagent evaluate VERB` with these options, quoted for a shell.

    Args:
        verb: of the evaluation, such as "arm".
        options: values by the option's name, with underscores; `None` and `False` leave an option out, `True` is a
            switch, and a sequence repeats it.
    """
    words = ["structagent", "evaluate", verb]
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        for one in value if isinstance(value, list | tuple) else [value]:
            if one is True:
                words.append(flag)
            elif one is not None and one is not False:
                words += [flag, str(one)]
    return shlex.join(words)


def report_frame(command: str, count: int, seed: int | None = None, packages: Sequence[ModuleType] = ()) -> Row:
    """Return what every report begins with, JSON-ready.

    Args:
        command: that makes the report.
        count: number of rows, or of what else is counted.
        seed: of the evaluation; `None` if nothing is drawn.
        packages: other packages besides `structdiffusion` whose code affects the rows.
    """
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "code": checksum_of_code(*packages),
        "command": command,
        "seed": seed,
        "n": count,
    }


def report_by_structure(frame: Row, rows: Sequence[Row], rates: Callable[[Sequence[Row]], Row]) -> Row:
    """Return a report of rows that each have a structure, with `rates` of the rows of each structure and of all."""
    return {
        **frame,
        "rows": list(rows),
        "aggregate": {
            structure: rates([row for row in rows if structure in ("all", row["structure"])])
            for structure in (*dict.fromkeys(row["structure"] for row in rows), "all")
        },
    }


def rate_of(hits: Sequence[bool]) -> dict[str, float]:
    """Return the share of hits among some trials, JSON-ready, with its 95 % Wilson interval."""
    count = sum(map(bool, hits))
    low, high = wilson_interval(count, len(hits))
    return {"count": count, "n": len(hits), "rate": count / max(1, len(hits)), "low": low, "high": high}


def percent(share: float | None, digits: int = 0) -> str:
    """Format a share as a percentage without its sign; "-" for `None`."""
    return "-" if share is None else f"{100 * share:.{digits}f}"


def interval(rate: Mapping[str, Any], digits: int = 0) -> str:
    """Format the 95 % interval of a rate as percentages."""
    return f"{percent(rate['low'], digits)} to {percent(rate['high'], digits)}"


def print_table(table: Sequence[Sequence[str]], results: TextIO, left: int = 1) -> None:
    """Print a table whose first `left` columns are text and whose other columns are numbers."""
    print(aligned(table, left, columns_of(results)), file=results)


def print_footer(report: Mapping[str, Any], results: TextIO, *notes: str) -> None:
    """Print the notes that are not empty, and the command, below the tables."""
    print("", *filter(None, notes), report["command"], sep="\n", file=results)


def missing_note(count: int, unit: str) -> str:
    """Return the note on rows that count as failed because their worker died; empty if there are none.

    Args:
        count: number of such rows.
        unit: the term for a row, such as "scene".
    """
    if not count:
        return ""
    these, them = (f"1 {unit} is", "it") if count == 1 else (f"{count} {unit}s are", "them")
    return f"{these} missing because a {WORKER_DIED}, counted as failed; the same command with --out tries {them} again"


def left_out_note(count: int) -> str:
    """Return the note on scenes that are left out because their worker died; empty if there are none."""
    if not count:
        return ""
    return f"{count} {'scene is' if count == 1 else 'scenes are'} left out of these figures because a {WORKER_DIED}"


def write_evaluation(report: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write the report beside the rows; return its path."""
    return write_report(report, folder / REPORT)

"""`structagent evaluate parse`: the parsing benchmark, as a table, as JSON and as a picture."""

from __future__ import annotations

import io
import json
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from rich.progress import Progress

from agent import __version__
from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.rendering.text import aligned, number
from agent.runtime.atomic_files import write_all_whole
from agent.runtime.output_ownership import mark
from agent.runtime.terminal_text import console_on
from grounding.benchmark import Row, free_rows, load_rows, rate, score, templated_rows
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import SLOTS

if TYPE_CHECKING:
    from grounding.interpreter import Interpreter

SCHEMA_VERSION = 1
T = TypeVar("T")
SHIPPED: Mapping[str, Callable[[], list[Row]]] = {"templated": templated_rows, "free": free_rows}
# Instructions that are timed one by one.
TIMED = 50


def measure_parsing(
    parsers: Sequence[str], data: Sequence[str], limit: int | None, options: ReadingOptions
) -> dict[str, Any]:
    """Every parser on every data set.

    Args:
        parsers: names, such as "embedding".
        data: "templated", "free" or files of the benchmark's form.
        limit: read at most so many rows of each, evenly spaced; `None` for all.
        options: how to read, but for the parser.

    Returns:
        The report as JSON values.
    """
    sets = {name: thinned(benchmark_rows(name), limit) for name in data}
    evaluations = []
    with Progress(console=console_on(sys.stderr), transient=True, disable=None) as progress:
        for parser in parsers:
            interpreter = make_interpreter(replace(options, parser=parser), strict=True)
            started = time.perf_counter()
            interpreter.interpret("put the cups in a circle")
            cold = time.perf_counter() - started
            for name, rows in sets.items():
                task = progress.add_task(f"{parser}, {name}", total=len(rows))
                evaluations.append(
                    {"parser": parser, "data": name, "rows": len(rows)}
                    | _measured(interpreter, rows, lambda done, task=task: progress.update(task, completed=done))
                    | {"seconds_cold": cold}
                )
    return {"schema_version": SCHEMA_VERSION, "version": __version__, "evaluations": evaluations}


def benchmark_rows(name: str) -> list[Row]:
    """The rows of a data set that comes along, "templated" or "free", or of a file of the benchmark's form."""
    return SHIPPED[name]() if name in SHIPPED else load_rows(name)


def thinned(rows: Sequence[T], limit: int | None) -> Sequence[T]:
    """At most `limit` of some rows, evenly spaced; all where it is `None`."""
    if limit is None or limit >= len(rows):
        return rows
    return [rows[i * len(rows) // limit] for i in range(limit)]


def _measured(interpreter: Interpreter, rows: Sequence[Row], progress: Callable[[int], None]) -> dict[str, Any]:
    texts = [row.text for row in rows]
    every = max(1, len(texts) // TIMED)
    single = [interpreter.interpret(text).seconds for text in texts[::every][:TIMED]]
    parses, seconds = [], 0.0
    for start in range(0, len(texts), 256):
        goals = interpreter.interpret_many(texts[start : start + 256])
        seconds += sum(goal.seconds for goal in goals)
        parses += [goal.parse for goal in goals]
        progress(len(parses))
    selecting = [row for row in rows if row.objects is not None]
    encoder = SentenceEncoder()
    return {
        "prompt_sha256": parses[0].prompt_sha256,
        **score(rows, parses),
        "objects": rate(sum(_selected(row, encoder) == row.objects for row in selecting), len(selecting)),
        "seconds_warm": statistics.median(single),
        "seconds_warm_most": max(single),
        "instructions_per_second": len(texts) / seconds,
    }


def _selected(row: Row, encoder: SentenceEncoder) -> tuple[int, ...] | None:
    try:
        return select_objects(row.text, row.scene, encoder).indices
    except SelectionError:
        return None


def tell_parsing(report: Mapping[str, Any], results: TextIO) -> None:
    """The tables for people: a row per parser and data set, then one per stratum; rates in percent."""
    head = ["parser", "data", "n", "exact", "95 %", *(slot.replace("_", " ") for slot in SLOTS)]
    head += ["false fills", "refusal P", "refusal R", "objects", "ECE", "cold s", "warm ms", "a second"]
    rows = [head]
    for found in report["evaluations"]:
        exact = found["exact"]
        rates = [found["slots"][slot] for slot in SLOTS]
        rates += [found["false_fills"], found["refusal"]["precision"], found["refusal"]["recall"], found["objects"]]
        rows.append(
            [found["parser"], found["data"], str(found["rows"]), _percent(exact["rate"]), _interval(exact)]
            + [_percent(entry["rate"]) for entry in rates]
            + [number(found["calibration_error"], 3), number(found["seconds_cold"], 1)]
            + [number(1000 * found["seconds_warm"], 1), number(found["instructions_per_second"], 0)]
        )
    print(aligned(rows, left=2), file=results)
    strata = [["parser", "data", "stratum", "n", "exact", "95 %"]]
    for found in report["evaluations"]:
        strata += [
            [found["parser"], found["data"], name, str(exact["n"]), _percent(exact["rate"]), _interval(exact)]
            for name, exact in found["strata"].items()
        ]
    print("\n" + aligned(strata, left=3), file=results)
    print("\nrates in percent, with 95 % Wilson intervals", file=results)


def write_parsing(report: Mapping[str, Any], folder: Path) -> list[Path]:
    """Writes `parse.json`, `parse.txt` and a picture of the confusions per evaluation; their paths."""
    from agent.evaluation.confusion_plot import draw_confusion

    paths = [folder / "parse.json", folder / "parse.txt"]
    table = io.StringIO()
    tell_parsing(report, table)
    report_text = json.dumps(report, indent=1, ensure_ascii=False) + "\n"
    write_all_whole(folder, {paths[0].name: report_text, paths[1].name: table.getvalue()})
    for found in report["evaluations"]:
        paths.append(folder / f"confusion-{found['parser']}-{Path(found['data']).stem}.png")
        draw_confusion(found["confusion"], f"{found['parser']} parser, {Path(found['data']).name}", paths[-1])
    mark(folder, "evaluation", (path.name for path in paths))
    return paths


def _interval(found: Mapping[str, Any]) -> str:
    return f"{_percent(found['low'])} to {_percent(found['high'])}"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f}"

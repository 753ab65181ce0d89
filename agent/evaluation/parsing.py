"""Run the parsing benchmark and report it as a table, as JSON and as plots: `structagent evaluate parse`."""

from __future__ import annotations

import io
import json
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO, TypeVar

from rich.progress import Progress, TaskID

import grounding
from agent.evaluation.goal_reading import defects_of, goal_rows, measure_goal_reading, print_goal_reading
from agent.evaluation.report import command_line, interval, percent, print_footer, print_table, report_frame
from agent.evaluation.slot_reading import SlotReader, slot_reader
from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.pipeline.reading_alone import Reads, itself, read_alone
from agent.rendering.text import number
from agent.runtime.output_ownership import mark, own_folder
from agent.runtime.redaction import without_credentials
from agent.runtime.terminal_text import console_on
from grounding.benchmark import Row, five_slots, free_rows, load_rows, rate, score, templated_rows
from grounding.spec import SLOTS

T = TypeVar("T")
SHIPPED: Mapping[str, Callable[[], list[Row]]] = {"templated": templated_rows, "free": free_rows}
TIMED = 50  # instructions that are timed one by one


def measure_parsing(
    parsers: Sequence[str], data: Sequence[str], goals: Sequence[str], limit: int | None, options: ReadingOptions
) -> dict[str, Any]:
    """Measure every parser on every data set; return a JSON-ready report.

    Args:
        parsers: names, such as "embedding".
        data: "templated", "free" or files in the format of the benchmark of the five slots.
        goals: "templated", "free" or files in the format of the benchmark of goals.
        limit: read at most that many rows of each, evenly spaced; `None` for all.
        options: how to read, except for the parser.

    Raises:
        BenchmarkError: for a file that is not in the format of the benchmark.
        LLMError: for a language model that cannot be used.
    """
    sets = {name: thinned(benchmark_rows(name), limit) for name in data}
    goal_sets = {name: thinned(goal_rows(name), limit) for name in goals}
    evaluations, readings = [], []
    shown: Any = {"transient": True, "disable": None}  # rich decides
    defects: dict[str, str] = {}  # text -> sentence
    with Progress(console=console_on(sys.stderr), **shown) as progress:
        for parser in parsers:
            reading = replace(options, parser=parser)
            interpreter, slots = make_interpreter(reading, strict=True), slot_reader(reading)
            started = time.perf_counter()
            (slots if sets else interpreter).interpret_many(["put the cups in a circle"], None)
            cold = time.perf_counter() - started
            for name, rows in sets.items():
                task = progress.add_task(f"{parser}, {name}", total=len(rows))
                evaluations.append(
                    {"parser": parser, "data": name, "rows": len(rows)}
                    | _measured(slots, rows, partial(_advance, progress, task), defects)
                    | {"seconds_cold": cold}
                )
            for name, instructions in goal_sets.items():
                task = progress.add_task(f"{parser}, goals {name}", total=len(instructions))
                readings.append(
                    {"parser": parser, "data": name, "rows": len(instructions)}
                    | measure_goal_reading(interpreter, instructions, partial(_advance, progress, task), defects)
                )
    command = command_line(
        "parse", parser=parsers, data=data, goals=goals, limit=limit,
        llm_model=options.llm_model, replies=options.replies,
        llm_url=without_credentials(options.llm_url, "llm_url"),
    )  # fmt: skip
    count = sum(map(len, sets.values())) + sum(map(len, goal_sets.values()))
    return {**report_frame(command, count, packages=(grounding,)), "evaluations": evaluations, "goals": readings,
            "defects": [{"text": text, "message": message} for text, message in defects.items()]}  # fmt: skip


def benchmark_rows(name: str) -> list[Row]:
    """Return the rows of an included data set, "templated" or "free", or of a file in the format of the benchmark."""
    return SHIPPED[name]() if name in SHIPPED else load_rows(name)


def thinned(rows: Sequence[T], limit: int | None) -> Sequence[T]:
    """Return at most `limit` of some rows, evenly spaced; all for `None`."""
    if limit is None or limit >= len(rows):
        return rows
    return [rows[i * len(rows) // limit] for i in range(limit)]


def _measured(
    interpreter: Reads, rows: Sequence[Row], progress: Callable[[int], None], defects: dict[str, str]
) -> dict[str, Any]:
    texts = [row.text for row in rows]
    every = max(1, len(texts) // TIMED)
    single = [read_alone(interpreter, [text], None, itself)[0].seconds for text in texts[::every][:TIMED]]
    parses, seconds = [], 0.0
    for start in range(0, len(texts), 256):
        found = read_alone(interpreter, texts[start : start + 256], None, itself)
        defects |= defects_of(found)
        seconds += sum(one.seconds for one in found)
        parses += [five_slots(one.parse, one.status, one.goal, one.choices) for one in found]
        progress(len(parses))
    selecting = [] if isinstance(interpreter, SlotReader) else [row for row in rows if row.objects is not None]
    return {
        "prompt_sha256": parses[0].prompt_sha256,
        **score(rows, parses),
        "objects": rate(sum(_selected(row, interpreter) == row.objects for row in selecting), len(selecting)),
        "seconds_warm": statistics.median(single),
        "seconds_warm_most": max(single),
        "instructions_per_second": len(texts) / seconds,
    }


def _advance(progress: Progress, task: TaskID, done: int) -> None:
    progress.update(task, completed=done)


def _selected(row: Row, interpreter: Reads) -> tuple[int, ...] | None:
    goal = interpreter.interpret_many([row.text], row.scene)[0].goal
    if any(part.objects is None for part in goal.structures):
        return tuple(range(len(row.scene)))
    return tuple(sorted(index for index in goal.named_objects() if isinstance(index, int))) or None


def print_parsing(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the tables: a row per parser and data set, then one per stratum; rates in percent. Goals come last."""
    if report["evaluations"]:
        _print_slots(report, results)
    if report["goals"]:
        print(file=results)
        print_goal_reading(report["goals"], results)
    print_footer(report, results, "rates in percent, with 95 % Wilson intervals")


def _print_slots(report: Mapping[str, Any], results: TextIO) -> None:
    head = ["parser", "data", "n", "exact", "95 %", *(slot.replace("_", " ") for slot in SLOTS)]
    head += ["false fills", "refusal P", "refusal R", "objects", "ECE", "cold s", "warm ms", "a second"]
    rows = [head]
    for found in report["evaluations"]:
        exact = found["exact"]
        rates = [found["slots"][slot] for slot in SLOTS]
        rates += [found["false_fills"], found["refusal"]["precision"], found["refusal"]["recall"], found["objects"]]
        rows.append(
            [found["parser"], found["data"], str(found["rows"]), percent(exact["rate"], 1), interval(exact, 1)]
            + [percent(entry["rate"], 1) for entry in rates]
            + [number(found["calibration_error"], 3), number(found["seconds_cold"], 1)]
            + [number(1000 * found["seconds_warm"], 1), number(found["instructions_per_second"], 0)]
        )
    print_table(rows, results, left=2)
    strata = [["parser", "data", "stratum", "n", "exact", "95 %"]]
    for found in report["evaluations"]:
        strata += [
            [found["parser"], found["data"], name, str(exact["n"]), percent(exact["rate"], 1), interval(exact, 1)]
            for name, exact in found["strata"].items()
        ]
    print(file=results)
    print_table(strata, results, left=3)


def write_parsing(report: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write `parse.json`, `parse.txt` and a plot of the confusions per evaluation; return their paths."""
    from agent.evaluation.confusion_plot import draw_confusion

    paths = [folder / "parse.json", folder / "parse.txt"]
    table = io.StringIO()
    print_parsing(report, table)
    report_text = json.dumps(report, indent=1, ensure_ascii=False) + "\n"
    paths += [folder / f"confusion-{found['parser']}-{Path(found['data']).stem}.png" for found in report["evaluations"]]
    with own_folder(folder, "evaluation") as place:
        mark(place, "evaluation", (path.name for path in paths))
        place.write({paths[0].name: report_text, paths[1].name: table.getvalue()})
    for found, path in zip(report["evaluations"], paths[2:], strict=True):
        draw_confusion(found["confusion"], f"{found['parser']} parser, {Path(found['data']).name}", path)
    return paths

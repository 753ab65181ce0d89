"""Run the benchmark of goals: how well readers turn instructions into goals (`structagent evaluate parse --goals`)."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from agent.evaluation.report import interval, percent, print_table
from agent.pipeline.reading_alone import itself, read_alone
from agent.rendering.text import number
from grounding.benchmark import rate
from grounding.goal_benchmark.rows import GoalRow, free_goal_rows, goal_scenes, load_goal_rows, templated_goal_rows
from grounding.goal_benchmark.scoring import is_exact_reading, score_goals
from grounding.parse_result import DEFECT

if TYPE_CHECKING:
    from grounding.interpretation import Interpretation
    from grounding.interpreter import Interpreter

SHIPPED_GOALS: Mapping[str, Callable[[], list[GoalRow]]] = {"templated": templated_goal_rows, "free": free_goal_rows}
TIMED = 50  # instructions that are timed one by one


def goal_rows(name: str) -> list[GoalRow]:
    """Return the rows of an included set of goals, "templated" or "free",
    or of a file in the format of the benchmark.
    """
    return SHIPPED_GOALS[name]() if name in SHIPPED_GOALS else load_goal_rows(name)


def measure_goal_reading(
    interpreter: Interpreter, rows: Sequence[GoalRow], progress: Callable[[int], None], defects: dict[str, str]
) -> dict[str, Any]:
    """Read every row in its scene and score it; return JSON values, with times.

    "by_model" is the share of exact ones among the readings that are a language model's own.

    Args:
        interpreter: reads the instructions.
        rows: the instructions.
        progress: called with the number of finished rows.
        defects: gets the texts at which the program itself failed, each with a sentence.
    """
    readings: list[Interpretation | None] = [None] * len(rows)
    done = 0
    for scene in dict.fromkeys(row.scene for row in rows):
        own = [i for i, row in enumerate(rows) if row.scene == scene]
        objects = None if scene is None else goal_scenes()[scene]
        for start in range(0, len(own), 64):
            chunk = own[start : start + 64]
            found = read_alone(interpreter, [rows[i].text for i in chunk], objects, itself)
            defects |= defects_of(found)
            for i, reading in zip(chunk, found, strict=True):
                readings[i] = reading
            done += len(chunk)
            progress(done)
    read = [reading for reading in readings if reading is not None]
    every = max(1, len(rows) // TIMED)
    single = [
        reading.seconds
        for row in rows[::every][:TIMED]
        for reading in read_alone(
            interpreter, [row.text], None if row.scene is None else goal_scenes()[row.scene], itself
        )
    ]
    own = [is_exact_reading(row, one) for row, one in zip(rows, read, strict=True) if one.by_model]
    return {
        **score_goals(rows, read), "by_model": rate(sum(own), len(own)),
        "seconds_warm": statistics.median(single), "seconds_warm_most": max(single),
    }  # fmt: skip


def defects_of(readings: Sequence[Interpretation]) -> dict[str, str]:
    """Return the texts at which the program itself failed, each with the sentence that says so."""
    return {one.parse.text: one.message for one in readings if one.status == DEFECT}


def print_goal_reading(evaluations: Sequence[Mapping[str, Any]], results: TextIO) -> None:
    """Print the tables of goals: a row per parser and set, then one per stratum; rates in percent.

    "with answer" counts a refusal that suggests the right goal, and a question that offers it, too; "own" is the number
    of readings that are a language model's own, and "own exact" the share of exact ones of them.
    """
    head = ["parser", "goals", "n", "exact", "95 %", "false fills", "wrong keys", "false parts", "dropped parts"]
    head += [
        "refusal P",
        "refusal R",
        "refused",
        "asked",
        "built wrongly",
        "with answer",
        "warm ms",
        "own",
        "own exact",
    ]
    rows = [head]
    for found in evaluations:
        exact = found["exact"]
        keys = ("false_fills", "wrong_keys", "false_parts", "dropped_parts")
        rates = [found[key] for key in keys] + [found["refusal"]["precision"], found["refusal"]["recall"]]
        rates += [found["wrongly_refused"], found["wrongly_asked"], found["built_wrongly"], found["with_answer"]]
        cells = [
            found["parser"],
            Path(found["data"]).name,
            str(found["rows"]),
            percent(exact["rate"], 1),
            interval(exact, 1),
        ]
        own = found["by_model"]
        cells += [*(percent(one["rate"], 1) for one in rates), number(1000 * found["seconds_warm"], 1)]
        rows.append([*cells, str(own["n"]), percent(own["rate"], 1)])
    print_table(rows, results, left=2)
    strata = [["parser", "goals", "stratum", "n", "exact", "95 %"]]
    for found in evaluations:
        strata += [
            [found["parser"], Path(found["data"]).name, name, str(one["n"]), percent(one["rate"], 1), interval(one, 1)]
            for name, one in found["strata"].items()
        ]
    print(file=results)
    print_table(strata, results, left=3)

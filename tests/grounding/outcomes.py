"""Outcomes of reading labelled texts, pinned row by row: `python -m tests.grounding.outcomes` writes them anew, and
prints the rates of all rows.

A row of `outcomes/SET.tsv` is a status and a goal in words; the texts stand in the sets themselves. A change of the
networks moves a few rows: the test allows some, and rates must hold all the same. Whoever writes them anew looks at the
difference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path

from grounding.goal_benchmark.rows import GoalRow, free_goal_rows, goal_scenes, load_goal_rows
from grounding.goal_benchmark.scoring import score_goals
from grounding.goal_network.vocabulary import NO_GOAL
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.interpreter import Interpreter
from grounding.training.goal_corrections import goal_of
from grounding.training.goal_lines import LabelError, goal_lines
from grounding.training.goal_reader import held_out

FOLDER = Path(__file__).with_name("outcomes")
HELD_OUT = ("held_out", "held_out_b", "held_out_c", "held_out_d", "held_out_e")
FIRST_WRITERS = 14_186  # rows of the writers whose held-back texts are the benchmark "strangers"
STRANGERS_EVERY = 3
EVERY = 2  # of each set so many rows share one that is pinned


def held_out_rows() -> list[GoalRow]:
    """Load the five held-out sets; nobody looks at their texts."""
    folder = resources.files("grounding") / "benchmark_data"
    return [row for name in HELD_OUT for row in load_goal_rows(str(folder / f"goals_{name}.jsonl"))]


def stranger_rows() -> list[GoalRow]:
    """Load the labelled instructions of the first writers that no network was trained on."""
    found = []
    for line in filter(held_out, goal_lines()[:FIRST_WRITERS]):
        label, count = line.label.strip(" ."), len(goal_scenes()[line.scene])
        status, also = {"unclear": ("ask", "refused")}.get(
            label, ("refused", "ask") if label in NO_GOAL else ("ok", None)
        )
        try:
            goals = (goal_of(line.label, count),) if status == "ok" else ()
        except LabelError:
            continue
        found.append(GoalRow(line.text, line.scene, line.stratum, status, goals, also))
    return found


SETS: Mapping[str, Callable[[], list[GoalRow]]] = {
    "free": free_goal_rows,
    "held_out": held_out_rows,
    "strangers": lambda: stranger_rows()[::STRANGERS_EVERY],
}


def readings_of(rows: list[GoalRow], interpreter: Interpreter) -> list[Interpretation]:
    """Read every row in its scene."""
    scenes = goal_scenes() | {None: None}
    interpreter.read_ahead([(row.text, scenes[row.scene], Goal()) for row in rows])
    return [interpreter.interpret(row.text, scenes[row.scene]) for row in rows]


def outcome_of(reading: Interpretation) -> str:
    """Return the row that is pinned."""
    return f"{reading.status}\t{reading.goal}"


def main() -> None:
    """Write the outcomes, and print the rates."""
    from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter

    interpreter = make_interpreter(ReadingOptions())
    FOLDER.mkdir(exist_ok=True)
    for name, rows in SETS.items():
        readings = readings_of(rows(), interpreter)
        print(name, score_goals(rows(), readings))
        lines = [outcome_of(reading) for reading in readings[::EVERY]]
        (FOLDER / f"{name}.tsv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

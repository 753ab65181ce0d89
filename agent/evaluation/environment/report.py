"""Print the leaderboard of the environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TextIO

from agent.evaluation.report import interval, missing_note, percent, print_footer, print_table
from agent.rendering.text import number


def print_environment(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the leaderboard: a row per policy, best first."""
    board = report["leaderboard"]
    causes = list(board[0]["failures"]) if board else []
    table = [["policy", "n", "success", "95 %", *causes, "refused", "actions", "s"]]
    for rates in board:
        cells = [rates["policy"], str(rates["n"]), percent(rates["success"]["rate"]), interval(rates["success"])]
        cells += [str(rates["failures"][cause]) for cause in causes]
        table.append([*cells, str(rates["refused"]), number(rates["actions"], 1), number(rates["seconds"], 1)])
    print_table(table, results)
    explanation = (
        "success in percent, with 95 % Wilson intervals; failures: episodes by the class that ended them; refused: "
        "episodes in which an action moved nothing; actions, s: means per episode"
    )
    print_footer(report, results, explanation, missing_note(sum(rates["lost"] for rates in board), "episode"))

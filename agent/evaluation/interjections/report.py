"""Print the tables of an evaluation of what is said while the arm builds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TextIO

from agent.evaluation.interjections.measure import RESULTS
from agent.evaluation.report import interval, percent, print_footer, print_table


def print_steering(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the rates of each half, and every row that is not right or does not stand."""
    table = [["half", "n", "right", "95 %", *RESULTS[1:], "stands", "95 %"]]
    for half, rates in report["aggregate"].items():
        counts = [str(rates[one]["count"]) for one in RESULTS[1:]]
        right, stands = rates["right"], rates["stands"]
        table.append(
            [
                half,
                str(rates["n"]),
                percent(right["rate"]),
                interval(right),
                *counts,
                percent(stands["rate"]),
                interval(stands),
            ]
        )
    print_table(table, results)
    print(file=results)
    failed = [row for row in report["rows"] if row.get("result") != "right" or row.get("stands") is False]
    listed = [["number", "said", "at", "result", "outcome", "goal or trouble"]]
    for row in failed:
        about = row.get("trouble") if row.get("result") == "right" else row.get("goal")
        cells = (
            row.get("sentence", ""),
            row.get("moment", ""),
            row.get("result", "lost"),
            row.get("outcome") or "-",
            about or "",
        )
        listed.append([str(row["number"]), *cells])
    if failed:
        print_table(listed, results, left=6)
    explanation = (
        "right: read as expected, and built from the next safe point on; asked: a question where a change was "
        "expected; late: after more than one placement; stands: what was wanted in the end, judged on the true objects"
    )
    left_out = f"{report['left_out']} rows are left out: no table could be drawn" if report["left_out"] else ""
    print_footer(report, results, explanation, left_out)

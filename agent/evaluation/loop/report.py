"""Print the tables of an evaluation of the closed loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TextIO

from agent.evaluation.loop.build import UNDISTURBED
from agent.evaluation.report import interval, missing_note, percent, print_footer, print_table
from agent.rendering.text import number


def print_loop(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the tables: per disturbance, and per disturbance and family."""
    print_table(_disturbances(report), results)
    print(file=results)
    print_table(_families(report), results, left=2)
    aggregate = report["aggregate"]
    lost = sum(families["all"]["lost"] for families in aggregate.values())
    impossible = sum(families["all"]["impossible"] for families in aggregate.values())
    these = "1 build is" if impossible == 1 else f"{impossible} builds are"
    left_out = f"{these} left out, in which the disturbance could not happen" if impossible else ""
    undrawn = f"{report['left_out']} rows are left out: no scene could be drawn from these objects"
    explanation = (
        "rates in percent, with 95 % Wilson intervals; ratio: to the same scenes undisturbed; false done: the tool "
        "says that it stands, the verdict on the true poses does not; noticed: before the second placement after it; "
        "replans: builds in which the tool noticed something and did otherwise than planned; extra s: medians, of the "
        "clock and of the arm"
    )
    print_footer(
        report, results, explanation, left_out, undrawn if report["left_out"] else "", missing_note(lost, "row")
    )


def _disturbances(report: Mapping[str, Any]) -> list[list[str]]:
    table = [
        ["disturbance", "n", "success", "95 %", "ratio", "false done", "noticed", "95 %", "replans", "extra s", "arm"]
    ]
    for kind, families in report["aggregate"].items():
        rates, plain = families["all"], kind == UNDISTURBED
        noticed = rates["noticed"]
        cells = [kind, str(rates["n"]), percent(rates["success"]["rate"]), interval(rates["success"])]
        cells += ["-" if plain else number(rates["ratio"], 2), str(rates["false_done"]["count"])]
        cells += ["-", "-"] if noticed is None else [percent(noticed["rate"]), interval(noticed)]
        cells.append(str(rates["replans"]["count"]))
        table.append(
            cells + ["-" if plain else number(rates[key], 1) for key in ("extra_seconds", "extra_arm_seconds")]
        )
    return table


def _families(report: Mapping[str, Any]) -> list[list[str]]:
    table = [["disturbance", "family", "n", "success", "95 %", "undisturbed", "false done", "noticed", "said to stand"]]
    for kind, families in report["aggregate"].items():
        for family, rates in families.items():
            if family != "all" and rates["n"]:
                noticed = "-" if rates["noticed"] is None else str(rates["noticed"]["count"])
                said = ", ".join(f"{words} in {count}" for words, count in rates["said"].items())
                cells = [kind, family, str(rates["n"]), percent(rates["success"]["rate"]), interval(rates["success"])]
                cells += [percent(rates["undisturbed"]["rate"]), str(rates["false_done"]["count"]), noticed, said]
                table.append(cells)
    return table

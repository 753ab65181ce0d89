"""Print the tables of an evaluation of figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TextIO

from agent.evaluation.goals.report import arm_table
from agent.evaluation.report import interval, missing_note, percent, print_footer, print_table
from agent.rendering.text import number
from structdiffusion.benchmark.figure_families import TRANSFERS
from structdiffusion.evaluation_protocol import FAILURE_CLASSES


def print_figures(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the tables: success of each method and family, and of each transfer."""
    print_table(_success(report), results, left=2)
    print(file=results)
    print_table(_transfers(report), results, left=1)
    if arm := arm_table(report, "method"):
        print(file=results)
        print_table(arm, results, left=2)
    lost = sum(rates["all"]["lost"] for rates in report["aggregate"].values())
    left_out = report["left_out"]
    undrawn = f"{left_out} rows left out: no scene could be drawn for them from these objects" if left_out else ""
    explanation = (
        "rates in percent, with 95 % Wilson intervals; @5: one of the five best-ranked stands; loss: what a changed "
        "number costs of the success; named: a blind classifier of 20 figures names the family"
    )
    print_footer(report, results, explanation, undrawn, missing_note(lost, "row"))


def _success(report: Mapping[str, Any]) -> list[list[str]]:
    table = [
        ["method", "family", "n", "success", "95 %", "@5", "95 %", "named", *FAILURE_CLASSES, "no arrangement", "s"]
    ]
    for method, families in report["aggregate"].items():
        for family, rates in families.items():
            cells = [method, family, str(rates["n"]), percent(rates["success"]["rate"]), interval(rates["success"])]
            cells += [percent(rates["success_at_5"]["rate"]), interval(rates["success_at_5"])]
            cells += [percent(rates["named"]["rate"])]
            cells += [percent(rate["rate"]) for rate in rates["failures"].values()]
            table.append([*cells, number(rates["seconds"], 1)])
    return table


def _transfers(report: Mapping[str, Any]) -> list[list[str]]:
    table = [["method", *TRANSFERS, "loss"]]
    for method, families in report["aggregate"].items():
        rates = families["all"]
        cells = [
            f"{percent(rates['transfers'][kind]['rate'])} % of {rates['transfers'][kind]['n']}" for kind in TRANSFERS
        ]
        table.append([method, *cells, percent(rates["loss"])])
    return table

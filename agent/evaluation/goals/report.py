"""Print the tables of an evaluation of goals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TextIO

from agent.evaluation.report import interval, missing_note, percent, print_footer, print_table
from agent.rendering.text import number
from structdiffusion.benchmark.rival_checks import RIVALS
from structdiffusion.evaluation_protocol import FAILURE_CLASSES
from structdiffusion.worker_process import WORKER_DIED

_MOST_PARTS = 4  # failed parts that a table names


def print_goals(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the tables: success per planner and family, per kind, by the rivals' checks, and with the arm."""
    print_table(_success(report), results, left=2)
    print(file=results)
    print_table(_kinds(report), results, left=3)
    print(file=results)
    print_table(_rivals(report), results, left=3)
    if arm := arm_table(report, "model"):
        print(file=results)
        print_table(arm, results, left=2)
    lost = sum(rates["all"]["lost"] for rates in report["aggregate"].values())
    left_out = report["left_out"]
    these, them = ("1 row is", "it") if left_out == 1 else (f"{left_out} rows are", "them")
    undrawn = f"{these} left out: no scene could be drawn for {them} from these objects" if left_out else ""
    explanation = (
        "rates in percent, with 95 % Wilson intervals; s: median seconds of planning; rivals: accepted by their looser "
        "checks, ours on the same rows, and what they accept of what comes to rest and fails our checks"
    )
    print_footer(report, results, explanation, undrawn, missing_note(lost, "row"))


def _success(report: Mapping[str, Any]) -> list[list[str]]:
    head = ["model", "family", "n", "success", "95 %", *FAILURE_CLASSES, "no arrangement", "aside", "s", "failed parts"]
    lost = any(rates["all"]["lost"] for rates in report["aggregate"].values())
    table = [[*head, *([WORKER_DIED] if lost else [])]]
    for model, families in report["aggregate"].items():
        for family, rates in families.items():
            success, failures = rates["success"], rates["failures"]
            parts = list(rates["failed_parts"].items())[:_MOST_PARTS]
            cells = [model, family, str(rates["n"]), percent(success["rate"]), interval(success)]
            cells += [percent(failures[cause]["rate"]) for cause in failures]
            cells += [str(rates["aside"]), number(rates["plan_seconds_median"], 2)]
            cells += [", ".join(f"{name} {count}" for name, count in parts) or "-"]
            table.append([*cells, *([str(rates["lost"])] if lost else [])])
    return table


def _kinds(report: Mapping[str, Any]) -> list[list[str]]:
    table = [["model", "family", "kind", "n", "success", "95 %"]]
    for model, families in report["aggregate"].items():
        for family, rates in families.items():
            if family != "all":
                table += [
                    [model, family, kind, str(rate["n"]), percent(rate["rate"]), interval(rate)]
                    for kind, rate in rates["kinds"].items()
                ]
    return table


def _rivals(report: Mapping[str, Any]) -> list[list[str]]:
    table = [["model", "family", "checks of", "n", "accepts", "95 %", "ours", "fails ours", "of these accepted"]]
    for model, families in report["aggregate"].items():
        for family, rates in families.items():
            for name in RIVALS:
                found = rates["rivals"][name]
                if found["accepts"]["n"]:
                    accepts, false = found["accepts"], found["accepts_what_fails"]
                    cells = [model, family, name, str(accepts["n"]), percent(accepts["rate"]), interval(accepts)]
                    table.append([*cells, percent(found["ours"]["rate"]), str(false["n"]), str(false["count"])])
    return table


def arm_table(report: Mapping[str, Any], by: str) -> list[list[str]]:
    """Return the table of what the arm built, with its head; nothing if it built nothing.

    Args:
        report: of goals or figures.
        by: head of the first column: what is compared.
    """
    table = [[by, "family", "with the arm", "planned", "placed all", "stands", "95 %", "seconds"]]
    for model, families in report["aggregate"].items():
        for family, rates in families.items():
            if (arm := rates["arm"]) is not None:
                counts = [str(arm[key]["count"]) for key in ("planned", "placed", "stands")]
                table.append(
                    [model, family, str(arm["n"]), *counts, interval(arm["stands"]), number(arm["seconds"], 0)]
                )
    return table if len(table) > 1 else []

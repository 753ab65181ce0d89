"""Write the report of a success evaluation: the table for the terminal, and the files of its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from agent.evaluation.report import interval, missing_note, percent, print_footer, print_table
from agent.evaluation.success.plots import draw_failures, draw_success_at_k
from agent.evaluation.success.results_folder import RESULTS
from agent.evaluation.success.tables import markdown_of
from agent.rendering.text import number
from grounding.atomic_files import write_all_whole
from structdiffusion.worker_process import WORKER_DIED


def print_success(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the table: a row per planner and structure; all columns but n and the seconds in percent."""
    top_k = report["evaluations"][0]["top_k"]
    failures = list(report["evaluations"][0]["aggregate"]["all"]["failures"])
    lost = sum(evaluation["aggregate"]["all"]["lost"]["count"] for evaluation in report["evaluations"])
    died = [WORKER_DIED] if lost else []
    rows = [["model", "structure", "n", "success", "95 %", f"success@{top_k}", *failures, *died, "seconds"]]
    for evaluation in report["evaluations"]:
        for structure, rates in evaluation["aggregate"].items():
            success = rates["success"]
            rows.append(
                [
                    evaluation["about"]["model"],
                    structure,
                    str(rates["n"]),
                    percent(success["rate"]),
                    interval(success),
                    percent(rates["success_at"][str(top_k)]["rate"]),
                    *(percent(rates["failures"][name]["rate"]) for name in failures),
                    *([percent(rates["lost"]["rate"])] if lost else []),
                    number(rates["plan_seconds"], 2),
                ]
            )
    print_table(rows, results, left=2)
    explanation = "rates in percent, with 95 % Wilson intervals; seconds of planning per scene"
    print_footer(report, results, explanation, missing_note(lost, "row"))


def write_success(report: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write `eval.json`, `tables.md`, `success_at_k.png` and `failures.png`; return their paths."""
    paths = [folder / name for name in RESULTS]
    report_text = json.dumps(report, indent=1, ensure_ascii=False) + "\n"
    write_all_whole(folder, {paths[0].name: report_text, paths[1].name: markdown_of(report)})
    draw_success_at_k(report, paths[2])
    draw_failures(report, paths[3])
    return paths

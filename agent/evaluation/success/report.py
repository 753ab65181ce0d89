"""What an evaluation found: the table of the terminal, and the files of its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from agent.evaluation.common import lost_note
from agent.evaluation.success.plots import draw_failures, draw_success_at_k
from agent.evaluation.success.results_folder import RESULTS
from agent.evaluation.success.tables import markdown_of
from agent.rendering.text import aligned, number
from agent.runtime.atomic_files import write_all_whole
from structdiffusion.worker_process import WORKER_DIED


def tell_success(report: Mapping[str, Any], results: TextIO) -> None:
    """The table for people: a row per model and structure; all but n and the seconds in percent."""
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
                    _percent(success["rate"]),
                    f"{_percent(success['low'])} to {_percent(success['high'])}",
                    _percent(rates["success_at"][str(top_k)]["rate"]),
                    *(_percent(rates["failures"][name]["rate"]) for name in failures),
                    *([_percent(rates["lost"]["rate"])] if lost else []),
                    number(rates["plan_seconds"], 2),
                ]
            )
    print(aligned(rows, left=2), file=results)
    print("\nrates in percent, with 95 % Wilson intervals; seconds of planning per scene", file=results)
    if lost:
        print(lost_note(lost, "row"), file=results)
    print(report["command"], file=results)


def write_success(report: Mapping[str, Any], folder: Path) -> list[Path]:
    """Writes `eval.json`, `tables.md`, `success_at_k.png` and `failures.png`; their paths."""
    paths = [folder / name for name in RESULTS]
    report_text = json.dumps(report, indent=1, ensure_ascii=False) + "\n"
    write_all_whole(folder, {paths[0].name: report_text, paths[1].name: markdown_of(report)})
    draw_success_at_k(report, paths[2])
    draw_failures(report, paths[3])
    return paths


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f}"

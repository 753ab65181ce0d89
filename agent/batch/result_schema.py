"""Check that a JSON object is a result of a batch: every key, type, legal value and finite number.

Whoever reads `results.jsonl` may then rely on them, whoever has edited it. `agent.batch.row_task` says what they mean.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from agent.batch.rows import ID
from agent.errors import (
    BAD_INPUT,
    DEFECT,
    DONE,
    EXECUTION_FAILED,
    NO_VALID_GOAL,
    NOT_BUILDABLE,
    NOT_VERIFIED,
    PARTLY_DONE,
    USAGE,
)
from agent.reporting.event_schema import misfit
from agent.runtime.settings import MOST_SEED
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.spec import LEGAL_VALUES
from grounding.structure_words import is_shape

ROWS = "rows"  # the folder of the rows' reports
REPORT = "report.html"
OUTCOMES = {
    DONE: "done",
    DEFECT: "broke down",
    BAD_INPUT: "bad input",
    USAGE: "wrong usage",
    NOT_VERIFIED: "a model differs from its card",
    EXECUTION_FAILED: "execution failed",
    PARTLY_DONE: "built with some of the objects asked for",
    NO_VALID_GOAL: "no valid goal",
    NOT_BUILDABLE: "not understood or not buildable",
}  # but for the first, the most serious first
_FINGERPRINT = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class CheckResult:
    """One check of a verdict, as `results.jsonl` has it."""

    name: str
    passed: bool
    measured: float
    limit: str


@dataclass(frozen=True)
class RowResult:
    """A line of `results.jsonl`."""

    id: str
    line: int
    text: str | None
    seed: int | None
    model: str | None
    fingerprint: str | None
    success: bool
    exit_code: int
    step: str | None
    message: str | None
    spec: Mapping[str, str | None] | None
    goal: Mapping[str, Any] | None
    rank: int | None
    score: float | None
    failure_class: str | None
    checks: tuple[CheckResult, ...]
    report: str | None
    seconds: Mapping[str, float]


def report_of(row_id: str) -> str:
    """Return the address of a row's report, seen from the batch's folder."""
    return f"{ROWS}/{row_id}/{REPORT}"


def report_link(row_id: str) -> str:
    """Return the same for a link on a page."""
    return f"{ROWS}/{quote(row_id, safe='')}/{REPORT}"


def result_error(entry: Mapping[str, Any]) -> str | None:
    """Describe the error in a result, in words that continue "line 3: "; `None` if it is valid."""
    # Results of before have no goal.
    if wrong := misfit({"goal": None, **entry}, RowResult, "result"):
        return wrong.removeprefix("result.")
    return _illegal_value(entry) or _illegal_goal(entry)


def _illegal_value(entry: Mapping[str, Any]) -> str | None:
    legal = {
        "id": (ID.fullmatch(entry["id"]), 'be 1 to 80 letters, digits, ".", "_" and "-"'),
        "line": (entry["line"] >= 1, "be at least 1"),
        "seed": (entry["seed"] is None or 0 <= entry["seed"] <= MOST_SEED, f"be from 0 to {MOST_SEED}"),
        "fingerprint": (
            entry["fingerprint"] is None or _FINGERPRINT.fullmatch(entry["fingerprint"]), "be 16 hexadecimal digits",
        ),
        "exit_code": (entry["exit_code"] in OUTCOMES, f"be one of {', '.join(map(str, sorted(OUTCOMES)))}"),
        "success": (entry["success"] == (entry["exit_code"] == DONE), f"fit exit_code {entry['exit_code']}"),
        "message": (entry["success"] or entry["message"] is not None, "say why the row failed"),
        "rank": (entry["rank"] is None or entry["rank"] >= 1, "be at least 1"),
        "report": (entry["report"] in (None, report_of(entry["id"])), f"be null or {report_of(entry['id'])!r}"),
        "seconds": (
            all(value >= 0 for value in entry["seconds"].values())
            and (entry["spec"] is None or "total" in entry["seconds"]),
            "be 0 or more, with their total",
        ),
    }  # fmt: skip
    return next((f"{key} must {what}" for key, (holds, what) in legal.items() if not holds), None)


def _illegal_goal(entry: Mapping[str, Any]) -> str | None:
    for slot, value in (entry["spec"] or {}).items():
        if slot not in LEGAL_VALUES:
            return f"spec cannot have {slot[:40]!r}; legal: {', '.join(LEGAL_VALUES)}"
        if (
            value is not None
            and value not in LEGAL_VALUES[slot]
            and not (slot == "shape" and isinstance(value, str) and is_shape(value))
        ):
            return f"spec.{slot} must be one of {', '.join(LEGAL_VALUES[slot])}, or null"
    try:
        if entry.get("goal") is not None:
            Goal.from_dict(entry["goal"])
    except GoalError as error:
        return f"goal is not legal: {' '.join(str(error).split())[:200]}"
    return None

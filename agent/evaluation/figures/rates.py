"""Compute the rates of an evaluation of figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from agent.evaluation.goals.rates import arm_rates
from agent.evaluation.report import rate_of
from agent.evaluation.rows import Row, lost_count, measured
from structdiffusion.benchmark.figure_families import TRANSFERS
from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.evaluation_protocol import FAILURE_CLASSES

_CHANGED = ("two thirds", "up to twice")


def rates_of(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rates of some rows, JSON-ready; rows whose worker died count as failed.

    Returns:
        "n"; "success" and "success_at_5"; "transfers": the success of each; "loss": by how much of the success with the
        example's number a changed number fails, `None` without such rows; "named": how often the blind classifier names
        the family, among all rows; "failures": class -> rate; "failed_checks"; "arm": see `arm_rates`; "lost";
        "seconds".
    """
    known = measured(rows)
    same = [row["success"] for row in known if row["kind"] not in _CHANGED]
    changed = [row["success"] for row in known if row["kind"] in _CHANGED]
    kept = sum(same) / len(same) if same else 0.0
    return {
        "n": len(rows),
        "success": rate_of([row.get("success", False) for row in rows]),
        "success_at_5": rate_of([row.get("success_at_5", False) for row in rows]),
        "transfers": {kind: rate_of([row["success"] for row in known if row["kind"] == kind]) for kind in TRANSFERS},
        "loss": 1.0 - sum(changed) / len(changed) / kept if changed and kept else None,
        "named": rate_of([row.get("named") == row["family"] for row in rows]),
        "failures": {
            cause: rate_of([row.get("failure") == cause for row in rows])
            for cause in (*FAILURE_CLASSES, NO_ARRANGEMENT)
        },
        "failed_checks": dict(Counter(name for row in known for name in row["failed_checks"]).most_common()),
        "arm": arm_rates(known),
        "lost": lost_count(rows),
        "seconds": sum(row["seconds"] for row in known) / len(known) if known else None,
    }  # fmt: skip

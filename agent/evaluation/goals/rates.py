"""Compute the rates of an evaluation of goals, of some of its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median
from typing import Any

from agent.evaluation.report import rate_of
from agent.evaluation.rows import Row, lost_count, measured
from structdiffusion.benchmark.rival_checks import RIVALS
from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.protocol.semantic import FAILURE_CLASSES


def rates_of(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rates of some rows, JSON-ready.

    Rows whose worker died count as failed, belong to no failure class, and have no times.

    Returns:
        "n"; "success"; "failures": class -> rate; "failed_parts": shape or relation -> in how many rows it failed;
        "aside": rows in which something was set aside; "kinds": the success of each kind of the family; "rivals": see
        `_rival_rates`; "arm": see `_arm_rates`, where the arm built; "lost"; seconds.
    """
    known = measured(rows)
    kinds = dict.fromkeys(row["kind"] for row in known)
    seconds = [row["plan_seconds"] for row in known]
    return {
        "n": len(rows),
        "success": rate_of([row.get("success", False) for row in rows]),
        "failures": {
            cause: rate_of([row.get("failure") == cause for row in rows])
            for cause in (*FAILURE_CLASSES, NO_ARRANGEMENT)
        },
        "failed_parts": dict(Counter(part for row in known for part in row["failed_parts"]).most_common()),
        "aside": sum(bool(row["aside"]) for row in known),
        "kinds": {kind: rate_of([row["success"] for row in known if row["kind"] == kind]) for kind in kinds},
        "rivals": {name: _rival_rates(known, name) for name in RIVALS},
        "arm": _arm_rates([row for row in known if "arm" in row]),
        "lost": lost_count(rows),
        "plan_seconds_median": median(seconds) if seconds else None,
        "plan_seconds_max": max(seconds, default=None),
        "seconds": sum(row["seconds"] for row in known) / len(known) if known else None,
    }


def _rival_rates(rows: Sequence[Row], name: str) -> dict[str, Any]:
    """Return how a rival's looser checks judge the same rows.

    Returns:
        "accepts": of the rows of whose goal it has checks, those that it accepts; what fails physically has failed for it
        too. "ours": our success on the same rows. "accepts_what_fails": of those that come to rest and fail our checks,
        those that it accepts.
    """
    judged = [row for row in rows if row["rivals"].get(name) is not None]
    semantic = [row for row in judged if row["failure"] == "semantic"]
    return {
        "accepts": rate_of([row["rivals"][name] for row in judged]),
        "ours": rate_of([row["success"] for row in judged]),
        "accepts_what_fails": rate_of([row["rivals"][name] for row in semantic]),
    }


def _arm_rates(rows: Sequence[Row]) -> dict[str, Any] | None:
    """Return how often the arm found a plan, placed everything, and built what stands as asked."""
    if not rows:
        return None
    built = [row["arm"] for row in rows]
    return {
        "n": len(built),
        "planned": rate_of([one["planned"] for one in built]),
        "placed": rate_of([one["placed"] == one["to_place"] for one in built]),
        "stands": rate_of([one["stands"] for one in built]),
        "seconds": sum(one["seconds"] for one in built) / len(built),
    }

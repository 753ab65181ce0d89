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
from structdiffusion.evaluation_protocol import FAILURE_CLASSES, SEMANTIC


def rates_of(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rates of some rows, JSON-ready.

    Rows whose worker died count as failed, belong to no failure class, and have no times.

    Returns:
        "n"; "success"; "failures": class -> rate; "failed_parts": shape or relation -> in how many rows it failed;
        "aside": number of rows in which an object was set aside; "kinds": the success of each kind of the family;
        "rivals": see `_rival_rates`; "arm": see `arm_rates`, if the arm was used; "lost"; seconds.
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
        "arm": arm_rates(known),
        "lost": lost_count(rows),
        "plan_seconds_median": median(seconds) if seconds else None,
        "plan_seconds_max": max(seconds, default=None),
        "seconds": sum(row["seconds"] for row in known) / len(known) if known else None,
    }


def _rival_rates(rows: Sequence[Row], name: str) -> dict[str, Any]:
    """Return how a rival's looser checks judge the same rows.

    Returns:
        "accepts": the share that it accepts of the rows with a goal that it can check; rows that fail physically count
        as
    not accepted. "ours": our success on the same rows. "accepts_what_fails": the share that it accepts of the rows
    that come to rest and fail our checks.
    """
    judged = [row for row in rows if row["rivals"].get(name) is not None]
    semantic = [row for row in judged if row["failure"] == SEMANTIC]
    return {
        "accepts": rate_of([row["rivals"][name] for row in judged]),
        "ours": rate_of([row["success"] for row in judged]),
        "accepts_what_fails": rate_of([row["rivals"][name] for row in semantic]),
    }


def arm_rates(rows: Sequence[Row]) -> dict[str, Any] | None:
    """Return how often the arm found a plan, placed all objects, and built a result that stands as asked; `None` if no
    row was built.
    """
    built = [row["arm"] for row in rows if "arm" in row]
    if not built:
        return None
    return {
        "n": len(built),
        "planned": rate_of([one["planned"] for one in built]),
        "placed": rate_of([one["placed"] == one["to_place"] for one in built]),
        "stands": rate_of([one["stands"] for one in built]),
        "seconds": sum(one["seconds"] for one in built) / len(built),
    }

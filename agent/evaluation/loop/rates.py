"""Compute the rates of an evaluation of the closed loop, of some of its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median
from typing import Any

from agent.evaluation.loop.build import UNDISTURBED
from agent.evaluation.report import rate_of
from agent.evaluation.rows import LOST, Row, lost_count, measured


def rates_of(rows: Sequence[Row], kind: str) -> dict[str, Any]:
    """Return the rates of the builds with one kind of disturbance, JSON-ready.

    Builds in which it could not happen are left out. Rows whose worker died count as failed.

    Args:
        rows: of all kinds of disturbances.
        kind: "none" for the undisturbed builds.

    Returns:
        "n"; "success"; "undisturbed": the success of the same scenes without a disturbance, and "ratio" to it; "done":
        how many the tool says are done; "false_done": of all; "noticed": within one placement; "replans": how many
        builds have one; "impossible": how many were left out; "said": how many objects of how many the tool says stand
        -> number of builds; "extra_seconds" and "extra_arm_seconds": medians of what a build took longer than the same
        without a disturbance, of the clock and of the arm; "lost".
    """
    own = [row for row in rows if row["disturbance"] == kind]
    happened = [row for row in own if LOST in row or kind == UNDISTURBED or row["disturbed"] is not None]
    plain = {_scene(row): row for row in rows if row["disturbance"] == UNDISTURBED}
    same = [plain[_scene(row)] for row in happened if _scene(row) in plain]
    success, undisturbed = (rate_of([row.get("success", False) for row in some]) for some in (happened, same))
    known = measured(happened)
    pairs = [(row, plain[_scene(row)]) for row in known if _scene(row) in plain and LOST not in plain[_scene(row)]]
    return {
        "n": len(happened),
        "success": success,
        "undisturbed": undisturbed,
        "ratio": success["rate"] / undisturbed["rate"] if undisturbed["count"] else None,
        "false_done": rate_of([row["false_done"] for row in known]),
        "noticed": None if kind == UNDISTURBED else rate_of([bool(row["noticed"]) for row in known]),
        "replans": rate_of([row["replans"] > 0 for row in known]),
        "impossible": len(own) - len(happened),
        "said": dict(sorted(Counter(f"{row['said']} of {row['to_place']}" for row in known).items())),
        "extra_seconds": _median(row["seconds"] - other["seconds"] for row, other in pairs),
        "extra_arm_seconds": _median(row["arm_seconds"] - other["arm_seconds"] for row, other in pairs),
        "lost": lost_count(happened),
    }


def _scene(row: Row) -> tuple[str, int]:
    return row["family"], row["number"]


def _median(values: Any) -> float | None:
    found = list(values)
    return round(median(found), 2) if found else None

"""Score readings of goals: the share of exact ones, and of invented, dropped and wrong parts and keys (evaluation
protocol, part two).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from grounding.benchmark import rate
from grounding.goal_benchmark.rows import GoalRow, goal_scenes
from grounding.goals.comparison import GoalComparison, compare_goals, one_by_one
from grounding.goals.goal import Goal
from grounding.goals.parts import Part, PartReference, StructurePart

_ARTICLES = frozenset(("the", "a", "an", "all", "my", "your", "these", "those"))


class GoalReading(Protocol):
    """A reader's result for an instruction; see `grounding.interpreter.Interpretation`."""

    @property
    def status(self) -> str: ...
    @property
    def goal(self) -> Goal: ...


def compare_with_row(goal: Goal, row: GoalRow) -> tuple[GoalComparison, Goal]:
    """Compare a goal with the acceptable goal of a row that it is closest to; return the comparison and that goal.

    Without a scene, the objects' words are spelled plainly.
    """
    if row.scene is None:
        pairs = [(compare_goals(_plain(goal), _plain(truth)), truth) for truth in row.goals]
    else:
        pairs = [(compare_goals(goal, truth, len(goal_scenes()[row.scene])), truth) for truth in row.goals]
    return min(pairs, key=lambda pair: _badness(pair[0]))


def _badness(found: GoalComparison) -> tuple[bool, int, int]:
    return not found.exact, len(found.dropped) + len(found.false_parts), len(found.false_fills) + len(found.wrong)


def _plain(goal: Goal) -> Goal:
    return Goal(tuple(map(_plain_words, goal.parts)))


def _plain_words(part: Part) -> Part:
    keys = ("objects", "around") if isinstance(part, StructurePart) else ("objects", "reference")

    def plain(objects: Any) -> Any:
        if objects is None or isinstance(objects, PartReference):
            return objects
        words = (" ".join(w for w in str(one).lower().split() if w not in _ARTICLES) or str(one) for one in objects)
        return tuple(dict.fromkeys(words))

    return replace(part, **{key: plain(getattr(part, key)) for key in keys})


def is_exact_reading(row: GoalRow, reading: GoalReading) -> bool:
    """Return whether a reading has the status of the row and, if that is "ok", one of its goals."""
    if reading.status not in row.statuses:
        return False
    return row.status != "ok" or compare_with_row(reading.goal, row)[0].exact


def is_right_with_an_answer(row: GoalRow, reading: GoalReading) -> bool:
    """Return whether a reading is exact, or suggests or offers in a question one of the row's goals."""
    suggested = getattr(reading, "suggestions", ()) if row.status == "ok" and reading.status != "ok" else ()
    return is_exact_reading(row, reading) or any(compare_with_row(goal, row)[0].exact for goal in suggested)


def score_goals(rows: Sequence[GoalRow], readings: Sequence[GoalReading]) -> dict[str, Any]:
    """Compute all rates of a reader on the rows, as JSON values.

    Returns:
        "exact": the status of the row and, where it is "ok", one of its goals; "with_answer": these, and those refused
        or asked about with the right goal as a suggestion or an option; "suggested": of those refused rightly, the
        share with any suggestion; over instructions that must be and were read: "false_fills" (the share that has a key
        that nobody asked for), "wrong_keys" (the share with another value or objects), "dropped_parts" (of the true
        parts), "false_parts" (of the parts that were read); "refusal": precision and recall of building nothing, by
        refusal or question; "status": of those that must not be built, how many were refused or asked as they must be;
        "wrongly_refused" and "wrongly_asked": of those that must be read; "built_wrongly": of all, the share that reads
        into a goal that was not asked for; "strata": exact per stratum; "keys": how often each key was filled or wrong;
        "wrong": the rows that are not exact.
    """
    pairs = list(zip(rows, readings, strict=True))
    read = [
        (reading.goal, *compare_with_row(reading.goal, row))
        for row, reading in pairs
        if row.status == reading.status == "ok"
    ]
    found = [comparison for _, comparison, _ in read]
    asked = [reading.status for row, reading in pairs if row.status == "ok"]
    idle = [(row, reading) for row, reading in pairs if row.status != "ok"]
    refused = [(row, reading) for row, reading in idle if reading.status == "refused"]
    nothing = sum(reading.status != "ok" for _, reading in pairs)
    rightly = sum(reading.status != "ok" for _, reading in idle)
    strata: dict[str, list[bool]] = {row.stratum: [] for row in rows}
    for row, reading in pairs:
        strata[row.stratum].append(is_exact_reading(row, reading))
    misread = sum(not one.exact for one in found) + sum(reading.status == "ok" for _, reading in idle)
    true_parts = sum(len(one_by_one(truth)) for *_, truth in read)
    read_parts = sum(len(one_by_one(goal)) for goal, *_ in read)
    return {
        "exact": rate(sum(map(sum, strata.values())), len(pairs)),
        "with_answer": rate(sum(is_right_with_an_answer(row, reading) for row, reading in pairs), len(pairs)),
        "suggested": rate(sum(bool(getattr(reading, "suggestions", ())) for _, reading in refused), len(refused)),
        "false_fills": rate(sum(bool(one.false_fills) for one in found), len(found)),
        "wrong_keys": rate(sum(bool(one.wrong) for one in found), len(found)),
        "dropped_parts": rate(sum(len(one.dropped) for one in found), true_parts),
        "false_parts": rate(sum(len(one.false_parts) for one in found), read_parts),
        "refusal": {"precision": rate(rightly, nothing), "recall": rate(rightly, len(idle))},
        "status": rate(sum(reading.status in row.statuses for row, reading in idle), len(idle)),
        "wrongly_refused": rate(asked.count("refused"), len(asked)),
        "wrongly_asked": rate(asked.count("ask"), len(asked)),
        "built_wrongly": rate(misread, len(pairs)),
        "strata": {name: rate(sum(hits), len(hits)) for name, hits in strata.items()},
        "keys": {
            "filled": dict(Counter(key for one in found for key in one.false_fills).most_common()),
            "wrong": dict(Counter(key for one in found for key in one.wrong).most_common()),
        },
        "wrong": [_wrong_row(row, reading) for row, reading in pairs if not is_exact_reading(row, reading)],
    }


def _wrong_row(row: GoalRow, reading: GoalReading) -> dict[str, Any]:
    found = compare_with_row(reading.goal, row)[0] if row.status == reading.status == "ok" else None
    return {
        "text": row.text,
        "scene": row.scene,
        "stratum": row.stratum,
        "expected": row.status,
        "goals": [goal.to_dict() for goal in row.goals],
        "status": reading.status,
        "goal": reading.goal.to_dict(),
        "message": getattr(reading, "message", ""),
        "dropped": list(found.dropped) if found else [],
        "false_parts": list(found.false_parts) if found else [],
        "false_fills": list(found.false_fills) if found else [],
        "wrong_keys": list(found.wrong) if found else [],
    }

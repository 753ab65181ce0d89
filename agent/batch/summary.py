"""Summarize the results of a batch by outcome and by shape, with the reasons of failures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from agent.batch.result_schema import OUTCOMES
from agent.errors import DONE
from agent.rendering.text import aligned, columns_of, duration
from grounding.figures.drawings import without_drawings

_FAILURES_SHOWN = 20  # failures in the table; all are in the results


@dataclass(frozen=True)
class Summary:
    """The results of all rows, in the order of the file.

    Attributes:
        results: one per row, as in `results.jsonl`.
        kept: the number of results from earlier runs of the batch.
        path: the path of `results.jsonl`.
        page: the path of the page with all rows.
    """

    results: Sequence[Mapping[str, Any]]
    kept: int
    path: Path
    page: Path

    @property
    def failures(self) -> list[Mapping[str, Any]]:
        """Return the results of the rows that failed."""
        return [result for result in self.results if not result["success"]]

    @property
    def exit_code(self) -> int:
        """Return 0 if all rows succeeded, otherwise the exit code of the most serious failure."""
        codes = {result["exit_code"] for result in self.failures}
        return next((code for code in OUTCOMES if code in codes), DONE)

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as JSON values."""
        codes = Counter(result["exit_code"] for result in self.results)
        return {
            "rows": len(self.results),
            "succeeded": len(self.results) - len(self.failures),
            "kept": self.kept,
            "exit_code": self.exit_code,
            "outcomes": {str(code): codes[code] for code in OUTCOMES if codes[code]},
            "shapes": self._shapes(),
            "failures": [
                {key: result[key] for key in ("id", "line", "exit_code", "step", "message")} for result in self.failures
            ],
            "results": str(self.path),
            "page": str(self.page),
        }

    def _shapes(self) -> dict[str, dict[str, Any]]:
        of_shape: dict[str, list[Mapping[str, Any]]] = {}
        for result in self.results:
            if result["spec"] is not None:
                of_shape.setdefault(_kind_of_goal(result), []).append(result)
        return {
            shape: {
                "rows": len(results),
                "succeeded": sum(result["success"] for result in results),
                "mean_seconds": round(sum(result["seconds"]["total"] for result in results) / len(results), 3),
            }
            for shape, results in sorted(of_shape.items())
        }

    def print_table(self, results: TextIO) -> None:
        """Print the table, with the whole message of each failure."""
        summary, width = self.to_dict(), columns_of(results)
        rows: list[tuple[str, ...]] = [
            ("outcome", "rows"),
            *((OUTCOMES[int(code)], str(n)) for code, n in summary["outcomes"].items()),
        ]
        print(aligned([*rows, ("all", str(summary["rows"]))], 1, width), file=results)
        if summary["shapes"]:
            rows = [
                (shape, str(one["rows"]), str(one["succeeded"]), duration(one["mean_seconds"]))
                for shape, one in summary["shapes"].items()
            ]
            print("\n" + aligned([("shape", "rows", "done", "mean time"), *rows], 1, width), file=results)
        if self.failures:
            print("\n" + self._failures(width), file=results)
        kept = f" ({self.kept} were there before)" if self.kept else ""
        print(f"\nresults: {self.path}{kept}\npage: {self.page}", file=results)

    def _failures(self, width: int) -> str:
        failures = self.failures[:_FAILURES_SHOWN]
        rows = [(result["id"], str(result["exit_code"]), result["message"]) for result in failures]
        more = len(self.failures) - len(failures)
        table = aligned([("failed", "code", "why"), *rows], width=width)
        return table + (f"\nand {more} more" if more else "")


def outcome_in_words(result: Mapping[str, Any]) -> str:
    """Return the outcome of a row in words, such as "failed: no valid goal"."""
    said = OUTCOMES[result["exit_code"]]
    return said if result["success"] else f"failed: {said}"


def structures_of(result: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the shape or the relation of each part of a row's goal, each once; empty if none was read."""
    return tuple(dict.fromkeys(_kinds_of_parts(result)))


def _kind_of_goal(result: Mapping[str, Any]) -> str:
    """Return the kind of a row's goal: the shape or the relation of its only part, or "several parts"."""
    kinds = _kinds_of_parts(result)
    return "several parts" if len(kinds) > 1 else kinds[0]


def _kinds_of_parts(result: Mapping[str, Any]) -> list[str]:
    if result["spec"] is None:
        return []
    parts = (result.get("goal") or {}).get("parts") or [result["spec"]]  # results of before have the slots alone
    return [part.get("relation") or without_drawings(part.get("shape") or "open") for part in parts]

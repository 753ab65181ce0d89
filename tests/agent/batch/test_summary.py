"""The end of a batch: its exit code and its table."""

import io
from pathlib import Path

import pytest

from agent.batch.summary import Summary


def result(row_id: str, code: int, message: str | None = None, shape: str | None = None) -> dict:
    return {
        "id": row_id, "line": 1, "success": code == 0, "exit_code": code, "step": None, "message": message,
        "spec": None if shape is None else {"shape": shape}, "seconds": {"total": 1.5},
    }  # fmt: skip


def table(results: list[dict]) -> str:
    out = io.StringIO()
    Summary(results, 0, Path("out/results.jsonl"), Path("out/index.html")).print_table(out)
    return out.getvalue()


@pytest.mark.parametrize(
    ("codes", "expected"),
    [([0, 0], 0), ([0, 3], 3), ([3, 4], 4), ([4, 5, 3], 5), ([5, 2], 2), ([2, 6, 0], 6), ([6, 1, 5], 1)],
)
def test_exit_code_is_that_of_the_most_serious_failure(codes, expected):
    results = [result(str(number), code, "") for number, code in enumerate(codes)]
    assert Summary(results, 0, Path(), Path()).exit_code == expected
    assert Summary(results[::-1], 0, Path(), Path()).exit_code == expected


def test_table():
    results = [result("a", 0, None, "tower"), result("b", 4, "it falls", "tower"), result("row-three", 6, "no JSON")]
    assert table(results) == (
        "outcome        rows\ndone              1\nbad input         1\nno valid goal     1\nall               3\n\n"
        "shape  rows  done  mean time\ntower     2     1      1.5 s\n\n"
        "failed     code  why\nb          4     it falls\nrow-three  6     no JSON\n\n"
        "results: out/results.jsonl\npage: out/index.html\n"
    )


@pytest.mark.parametrize("width", [40, 80, 120])
def test_table_fits_into_the_terminal_with_the_whole_reason(monkeypatch, width):
    monkeypatch.setattr("agent.batch.summary.columns_of", lambda stream: width)
    output = table([result("a", 6, "so " * 100), result("b", 0)])
    assert max(map(len, output.splitlines())) <= width and output.split().count("so") == 100


def test_many_failures_are_counted():
    assert "and 10 more" in table([result(f"row-{number}", 3, "why") for number in range(30)])


def test_goals_are_counted_by_what_they_ask_for():
    line = {"kind": "structure", "shape": "line"}
    goals = [[line], [line, line], [{"kind": "relation", "relation": "on"}], [{"kind": "structure", "shape": None}]]
    results = [result(str(k), 0) | {"spec": {"shape": None}, "goal": {"parts": parts}} for k, parts in enumerate(goals)]
    results.append(result("before", 0, None, "tower"))  # a result of one structure, without a goal
    shapes = Summary(results, 0, Path(), Path()).to_dict()["shapes"]
    assert {kind: one["rows"] for kind, one in shapes.items()} == {
        "line": 1, "several parts": 1, "on": 1, "open": 1, "tower": 1
    }  # fmt: skip

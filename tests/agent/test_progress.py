"""What is said on the way: a bar on a terminal, and lines where there is none."""

import sys

import pytest

from agent import progress


def test_plain_lines_now_and_then(monkeypatch, capsys):
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    with progress.progress("rows", 10, done=1, failed=1) as tell:
        for number in range(9):
            now += 4.0 if number else 40.0
            tell(number != 0)
    assert capsys.readouterr().err.splitlines() == [
        "2 of 10 rows, 2 failed",
        "5 of 10 rows, 2 failed, about 20 s left",
        "8 of 10 rows, 2 failed, about 8 s left",
        "10 of 10 rows, 2 failed in 72 s",
    ]


@pytest.mark.parametrize("terminal", [False, True])
def test_lines_about_each_piece_are_told_at_once(monkeypatch, capsys, terminal):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    with progress.progress("rows", 5, done=2, failed=2) as tell:
        for line in ("a done, 3.0 s", "b failed: [no valid goal], 1.0 s", "c done, 9.0 s"):
            now += 30.0
            tell("failed" not in line, line)
    said = capsys.readouterr().err
    for line in (
        "3 of 5: a done, 3.0 s, about 60 s left\n",
        "4 of 5: b failed: [no valid goal], 1.0 s, about 30 s left\n",
        "5 of 5: c done, 9.0 s\n",
    ):
        assert line in said
    assert ("5 of 5 rows, 3 failed in 2 min\n" in said) is not terminal


def test_results_are_followed(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PLAIN_SECONDS", 0.0)
    came = progress.followed("scenes drawn", iter("ab"), 2)
    assert next(came) == "a" and capsys.readouterr().err == "1 of 2 scenes drawn\n"
    assert list(came) == ["b"] and capsys.readouterr().err == "2 of 2 scenes drawn in 0 s\n"


@pytest.mark.parametrize("total", [0, 2])
def test_a_bar_is_drawn_where_there_is_something_to_do(monkeypatch, capsys, total):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert list(progress.followed("scenes drawn", iter("ab"[:total]), total)) == list("ab"[:total])
    assert ("2/2" in capsys.readouterr().err) == bool(total)

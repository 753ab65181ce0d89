"""The audit log: one line for every call, whatever the arguments are."""

import json
import os
from datetime import UTC, datetime

import pytest

from agent.errors import NotWritten
from agent.mcp import audit
from agent.mcp.audit import APPROVED, STARTED, AuditedCall, AuditLog


def test_a_call_is_written_with_its_decision(tmp_path):
    path = tmp_path / "new" / "audit.jsonl"
    with AuditLog(path) as log:
        call = AuditedCall(log, "client 1", "build", {"plan_id": "plan-1"})
        call.decision = APPROVED
        call.write(STARTED)
        call.write("done")
    first, second = map(json.loads, path.read_text().splitlines())
    assert first.keys() == {"time", "client", "tool", "arguments", "decision", "outcome", "seconds"}
    assert (first["client"], first["arguments"], first["decision"]) == ("client 1", {"plan_id": "plan-1"}, APPROVED)
    assert (first["outcome"], second["outcome"]) == (STARTED, "done")
    assert path.stat().st_mode & 0o077 == 0


def test_huge_and_odd_arguments_take_one_short_line(tmp_path):
    path, deep = tmp_path / "audit.jsonl", []
    for _ in range(500):
        deep = [deep]
    odd = {"x" * 9000: "y" * 10**6, "line\nfeed": "\x1b[2J\udc80", "deep": deep, "nan": float("nan"), "big": 10**400}
    with AuditLog(path) as log:
        AuditedCall(log, "c" * 5000, "t" * 5000, odd | {f"a{number}": number for number in range(5000)}).write("done")
    (line,) = path.read_text().splitlines()
    assert len(line) < 6000 and len(json.loads(line)["arguments"]) == 20


def test_lines_are_appended_and_links_are_not_followed(tmp_path):
    path = tmp_path / "audit.jsonl"
    for number in range(2):
        with AuditLog(path) as log:
            log.write({"number": number})
    assert [json.loads(line)["number"] for line in path.read_text().splitlines()] == [0, 1]
    os.symlink(path, tmp_path / "link.jsonl")
    with pytest.raises(NotWritten, match="^cannot write the audit log .*link.jsonl"):
        AuditLog(tmp_path / "link.jsonl")


def test_times_stay_in_order_where_the_clock_is_set_back_and_say_so(tmp_path, monkeypatch):
    hours = iter([12, 11, 9999, 12, 13])

    class Clock(datetime):
        @classmethod
        def now(cls, tz=None):
            hour = next(hours)
            return datetime(2099, 1, 1, tzinfo=UTC) if hour == 9999 else datetime(2030, 10, 27, hour, tzinfo=UTC)

    monkeypatch.setattr(audit, "datetime", Clock)
    path = tmp_path / "audit.jsonl"
    with AuditLog(path) as log:
        for number in range(5):
            log.write({"number": number})
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    times = [line["time"] for line in lines]
    assert times == sorted(times)
    assert [line.get("clock", "")[:13] for line in lines] == ["", "2030-10-27T11", "", "2030-10-27T12", "2030-10-27T13"]

"""The folder of a batch: nothing that was kept is lost or torn, and one batch at a time is at work in it."""

import json
import os
import signal
import subprocess
import sys

import pytest

from agent.batch.results import RESULTS, Results
from agent.cli.app import command_line
from agent.errors import BadInput, UsageError
from agent.runtime import jsonl_journal
from tests.counting import CountedBytes, Steps


def result(row_id: str, **more: object) -> dict:
    return {
        "id": row_id, "line": 1, "text": "stack the cans", "seed": 7, "model": "diffusion", "fingerprint": "0" * 16,
        "success": True, "exit_code": 0, "step": None, "message": None,
        "spec": {"shape": "tower", "size": None, "x_position": None, "y_position": None, "rotation": None},
        "goal": {"parts": [{"kind": "structure", "shape": "tower", "objects": ["can"]}]},
        "rank": 1, "score": 0.5, "failure_class": None,
        "checks": [{"name": "objects in the tower", "passed": True, "measured": 2, "limit": ">= 2"}],
        "report": None, "seconds": {"parse": 1, "total": 2.5},
    } | more  # fmt: skip


FAILED = {"success": False, "exit_code": 4, "step": "check", "message": "it falls"}


def test_results_are_found_again(tmp_path):
    with Results(tmp_path / "new" / "out") as results:
        results.add(result("a", message="“größer”"))
        results.add(result("b"))
    with Results(tmp_path / "new" / "out") as results:
        assert results.by_id == {"a": result("a", message="“größer”"), "b": result("b")}


def test_of_two_lines_with_one_id_the_later_holds(tmp_path):
    with Results(tmp_path) as results:
        results.add(result("a", **FAILED))
        results.add(result("a"))
    with Results(tmp_path) as results:
        assert results.by_id["a"]["success"]


def test_a_torn_last_line_is_dropped_wherever_it_is_torn(tmp_path):
    with Results(tmp_path) as results:
        results.add(result("a"))
        whole = results.path.read_bytes()
        results.add(result("b", message="größer"))
        both = results.path.read_bytes()
    for length in range(len(whole), len(both) + 1):
        (tmp_path / RESULTS).write_bytes(both[:length])
        with Results(tmp_path) as results:
            complete = length >= len(both) - 1  # but for the line's end, nothing is missing
            assert set(results.by_id) == ({"a", "b"} if complete else {"a"})
            assert (tmp_path / RESULTS).read_bytes() == (both if complete else whole)


def test_what_is_added_after_a_torn_line_stands_on_its_own(tmp_path):
    (tmp_path / RESULTS).write_text(json.dumps(result("a")) + '\n{"id": "b", "li')
    with Results(tmp_path) as results:
        results.add(result("c"))
    assert [json.loads(line)["id"] for line in (tmp_path / RESULTS).read_text().splitlines()] == ["a", "c"]


@pytest.mark.parametrize("content", ['{"id": "b"}\n{"id": "c"}\n', "some notes\nof mine\n"])
def test_a_file_of_somebody_else_is_left_alone(tmp_path, content):
    (tmp_path / RESULTS).write_text(content)
    with pytest.raises(BadInput, match="line 1: this is not a result of a batch"):
        Results(tmp_path)
    assert (tmp_path / RESULTS).read_text() == content


def test_two_batches_in_one_folder(tmp_path):
    with Results(tmp_path), pytest.raises(UsageError, match="another batch is at work"):
        Results(tmp_path)
    Results(tmp_path).close()


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "notes").write_text("")
    with pytest.raises(UsageError, match="--out must be a folder"):
        Results(tmp_path / "notes")


def test_a_report_is_moved_into_place_and_replaces_the_earlier_one(tmp_path):
    with Results(tmp_path) as results:
        for name in ("first", "second"):
            results.workplace("a").mkdir()
            (results.workplace("a") / f"{name}.webp").write_text("")
            assert not (name == "first" and results.has_report(result("a", report="rows/a/report.html")))
            (results.workplace("a") / "report.html").write_text(name)
            results.add(result("a", report="rows/a/report.html"))
            assert results.has_report(results.by_id["a"])
        there = sorted(path.name for path in (tmp_path / "rows" / "a").iterdir())
        assert there == [".structagent.json", "report.html", "second.webp"]
        results.add(result("a", **FAILED))
        assert not (tmp_path / "rows" / "a").exists()


def test_what_a_killed_batch_left_half_done_is_cleaned_up_and_reports_stay(tmp_path):
    killed = """
import os, signal, sys
from pathlib import Path
from agent.batch.results import Results
results = Results(Path(sys.argv[1]))
results.workplace("b").mkdir()
(results.workplace("b") / "session.jsonl").write_text("half")
os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, "-c", killed, tmp_path]).returncode == -signal.SIGKILL
    assert len(list(tmp_path.glob(".structagent-work-*/b"))) == 1
    (tmp_path / "rows" / "a").mkdir()
    with Results(tmp_path) as results:
        assert not list(tmp_path.glob(".structagent-work-*/b")) and not results.workplace("b").exists()
        assert [path.name for path in (tmp_path / "rows").iterdir()] == ["a"]
    assert not list(tmp_path.glob(".structagent-work-*"))


def test_results_in_order_replace_the_journal(tmp_path):
    with Results(tmp_path) as results:
        for row_id in "cab":
            results.add(result(row_id))
        results.arrange([results.by_id[row_id] for row_id in "ab"])
        results.add(result("d"))
    assert [json.loads(line)["id"] for line in (tmp_path / RESULTS).read_text().splitlines()] == ["a", "b", "d"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [".lock", ".structagent.json", RESULTS, "rows"]


def foreign(folder, **files: str):
    """A folder with files of somebody else, by name; what is in it, to be compared later."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_text(content)
    return {path.name: path.read_text() for path in folder.iterdir() if path.is_file()}


def test_a_folder_of_somebody_else_is_refused_and_left_as_it_is(tmp_path):
    before = foreign(tmp_path / "rows" / ".git", config="mine")
    with pytest.raises(UsageError, match="files that structagent did not write.*--force"):
        Results(tmp_path)
    assert foreign(tmp_path / "rows" / ".git") == before
    assert [path.name for path in tmp_path.iterdir()] == ["rows"]


def test_results_of_one_torn_line_that_are_not_ours_stay(tmp_path):
    (tmp_path / RESULTS).write_text("some notes of mine")
    with pytest.raises(UsageError, match="did not write"):
        Results(tmp_path)
    assert (tmp_path / RESULTS).read_text() == "some notes of mine"


def test_forced_into_a_folder_of_somebody_else_a_batch_removes_nothing(tmp_path):
    hidden = foreign(tmp_path / "rows" / ".git", config="mine")
    beside = foreign(tmp_path / "rows" / "a", notes="mine")
    with Results(tmp_path, force=True) as results:
        for name in ("first", "second"):
            results.workplace("a").mkdir()
            (results.workplace("a") / f"{name}.html").write_text(name)
            results.add(result("a", report=f"rows/a/{name}.html"))
    assert foreign(tmp_path / "rows" / ".git") == hidden
    there = {name: text for name, text in foreign(tmp_path / "rows" / "a").items() if name != ".structagent.json"}
    assert there == beside | {"second.html": "second"}


def test_a_report_of_somebody_else_in_the_place_of_a_row_is_not_replaced(tmp_path):
    with Results(tmp_path) as results:
        before = foreign(tmp_path / "rows" / "a", **{"report.html": "mine"})
        with pytest.raises(BadInput, match="rows/a/report.html' exists and was not written by a batch"):
            results.workplace("a")
    assert foreign(tmp_path / "rows" / "a") == before


@pytest.mark.parametrize("place", ["rows", "rows/a"])
def test_links_out_of_the_folder_are_not_followed(place, tmp_path):
    out, outside = tmp_path / "out", tmp_path / "outside"
    before = foreign(outside, **{"report.html": "mine", ".hidden": "mine"})
    Results(out).close()
    if place == "rows":
        (out / "rows").rmdir()
    (out / place).symlink_to(outside)
    with pytest.raises(BadInput, match="is a symbolic link, and must be a folder"), Results(out) as results:
        results.workplace("a")
    assert foreign(outside) == before


def test_a_full_disk_keeps_the_results_whole(tmp_path, monkeypatch):
    with Results(tmp_path) as results:
        results.add(result("a"))
        before = results.path.read_bytes()
        monkeypatch.setattr(os, "fsync", no_room)
        with pytest.raises(OSError, match="No space left"):
            results.add(result("b"))
        with pytest.raises(OSError, match="No space left"):
            results.write_page("<html>")
        monkeypatch.undo()
        assert results.path.read_bytes() == before
    assert not [path for path in tmp_path.iterdir() if path.name.endswith(".part")]


def no_room(descriptor: int) -> None:
    raise OSError(28, "No space left on device")


def test_a_second_batch_on_the_same_folder_is_refused_by_the_command_line(tmp_path, capsys):
    (tmp_path / "rows.txt").write_text("make a line\n")
    with Results(tmp_path / "out"):
        before = sorted(path.name for path in (tmp_path / "out").iterdir())
        assert command_line(["batch", str(tmp_path / "rows.txt"), "--out", str(tmp_path / "out")]) == 2
        assert f"another batch is at work in '{tmp_path}/out'; wait for it" in capsys.readouterr().err
        link = tmp_path / "link"
        link.symlink_to("out")  # another name of the same folder
        assert command_line(["batch", str(tmp_path / "rows.txt"), "--out", str(link), "--force"]) == 2
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == before


@pytest.mark.parametrize("name", [".lock", "results.jsonl"])
def test_a_link_in_the_place_of_a_file_of_the_batch_is_not_followed(name, tmp_path):
    out, outside = tmp_path / "out", tmp_path / "outside"
    Results(out).close()
    (out / name).unlink()
    (out / name).symlink_to(outside)
    with pytest.raises((BadInput, OSError)):
        Results(out)
    assert not outside.exists()


WRONG = [
    ("id", ["a"]), ("id", None), ("id", "../a"), ("id", "a/b"), ("id", 'a"><script>'), ("id", ""), ("id", "é"),
    ("line", 0), ("line", 1.5), ("line", True), ("text", 3), ("seed", -1), ("seed", "7"), ("seed", 2**63),
    ("model", ["diffusion"]), ("fingerprint", "0"), ("fingerprint", 7), ("success", "yes"), ("success", 1),
    ("exit_code", None), ("exit_code", 99), ("exit_code", 4), ("exit_code", "0"), ("step", {}), ("message", ["?"]),
    ("spec", []), ("spec", {"shape": "giraffe"}), ("spec", {"shape": 3}), ("spec", {"colour": "red"}),
    ("goal", "tower"), ("goal", {"parts": [{"kind": "structure", "shape": "giraffe"}]}), ("goal", {"parts": 3}),
    ("rank", 0), ("rank", "first"), ("score", float("nan")), ("score", float("inf")), ("score", "good"),
    ("failure_class", 3), ("checks", None), ("checks", {}), ("checks", [{}]), ("checks", ["fine"]),
    ("checks", [{"name": "a", "passed": "no", "measured": 1, "limit": ""}]),
    ("checks", [{"name": "a", "passed": True, "measured": float("nan"), "limit": ""}]),
    ("report", 7), ("report", "javascript:alert(1)"), ("report", "rows/a/../../x.html"), ("report", "/etc/passwd"),
    ("report", "rows/b/report.html"), ("report", "https://example.org"), ("report", ""),
    ("report", "rows/a/report.html#"),
    ("seconds", 3), ("seconds", {}), ("seconds", {"total": "1"}), ("seconds", {"total": float("nan")}),
    ("seconds", {"total": -1}), ("seconds", {"total": 10**400}),
]  # fmt: skip


@pytest.mark.parametrize(("key", "value"), WRONG)
def test_a_line_that_somebody_edited_is_named_and_costs_no_other(key, value, tmp_path, capsys):
    lines = [json.dumps(each) for each in (result("first"), result("a") | {key: value}, result("last"))]
    (tmp_path / RESULTS).write_text("\n".join(lines) + "\n")
    with Results(tmp_path) as results:
        assert set(results.by_id) == {"first", "last"}
    (said,) = capsys.readouterr().err.splitlines()
    named = "success" if (key, value) == ("exit_code", 4) else key
    assert f"{str(tmp_path / RESULTS)!r}, line 2: {named}" in said and said.endswith("the row is carried out again")
    with Results(tmp_path):
        assert capsys.readouterr().err == ""  # it is gone


@pytest.mark.parametrize("key", sorted(set(result("a")) - {"goal"}))
def test_every_key_is_needed(key, tmp_path, capsys):
    less = {name: value for name, value in result("a").items() if name != key}
    (tmp_path / RESULTS).write_text("\n".join(map(json.dumps, (result("b"), less, result("c")))))
    with Results(tmp_path) as results:
        assert set(results.by_id) == {"b", "c"}
    assert f"line 2: {key} is missing" in (said := capsys.readouterr().err) or "line 2: this is not a result" in said


def test_whatever_else_stands_between_results_costs_no_other(tmp_path, capsys):
    Results(tmp_path).close()
    lines = ["notes of mine", json.dumps(result("a")), "[1]", "{", "", "[" * 100_000, json.dumps(result("b"))]
    (tmp_path / RESULTS).write_bytes(b"\xef\xbb\xbf" + "\n".join(lines).encode() + b'\n{"id": "torn')
    with Results(tmp_path) as results:
        assert set(results.by_id) == {"a", "b"}
    said = capsys.readouterr().err.splitlines()
    assert [line.partition(", line ")[2].partition(":")[0] for line in said] == ["1", "3", "4", "6"]


def test_results_of_before_there_were_goals_are_kept(tmp_path):
    before = {key: value for key, value in result("a").items() if key != "goal"}
    (tmp_path / RESULTS).write_text(json.dumps(before) + "\n")
    with Results(tmp_path) as results:
        assert set(results.by_id) == {"a"}


def test_where_no_line_is_a_result_the_file_stays(tmp_path):
    content = json.dumps(result("a", report="javascript:alert(1)")) + "\n"
    (tmp_path / RESULTS).write_text(content)
    with pytest.raises(BadInput, match="line 1: report must be null or 'rows/a/report.html'; choose another --out"):
        Results(tmp_path)
    assert (tmp_path / RESULTS).read_text() == content


def test_resuming_reads_every_result_once_and_copies_no_more_of_each_however_many_there_are(tmp_path, monkeypatch):
    """On a file of so many rows the bytes copied per byte, files read and lines parsed per row stay the same."""
    read, parse = jsonl_journal._all_of, jsonl_journal.entry_of
    copied, files, lines = Steps(), Steps(), Steps()

    def counted_read(descriptor):
        files.count += 1
        return CountedBytes.of(read(descriptor), copied)

    def counted_parse(line, keys):
        lines.count += 1
        return parse(line, keys)

    monkeypatch.setattr(jsonl_journal, "_all_of", counted_read)
    monkeypatch.setattr(jsonl_journal, "entry_of", counted_parse)
    for rows in (50, 800):
        copied.count = files.count = lines.count = 0
        path = tmp_path / str(rows) / RESULTS
        path.parent.mkdir()
        path.write_text("".join(json.dumps(result(f"row_{number}")) + "\n" for number in range(rows)) + '{"id": "torn')
        size = path.stat().st_size
        with Results(path.parent) as results:
            assert len(results.by_id) == rows
        assert (files.count, lines.count) == (1, rows + 1)
        assert 0 < copied.count <= 3 * size


def test_a_link_put_in_the_place_of_a_rows_folder_while_its_files_are_moved_is_not_followed(tmp_path, monkeypatch):
    out, outside = tmp_path / "out", tmp_path / "outside"
    outside.mkdir()
    (outside / "report.html").write_text("kept")
    clear = Results._clear

    def cleared_and_swapped(results, name):
        clear(results, name)
        (out / "rows" / name).symlink_to(outside)

    monkeypatch.setattr(Results, "_clear", cleared_and_swapped)
    with Results(out) as results:
        results.workplace("a").mkdir()
        (results.workplace("a") / "report.html").write_text("new")
        with pytest.raises(OSError):
            results.add(result("a"))
    assert {path.name: path.read_text() for path in outside.iterdir()} == {"report.html": "kept"}


def test_a_link_put_in_the_place_of_the_rows_or_of_the_folder_while_a_batch_works_is_not_followed(tmp_path):
    out, outside = tmp_path / "out", tmp_path / "outside"
    (outside / "a").mkdir(parents=True)
    (outside / "results.jsonl").write_text("kept")
    (outside / "a" / "report.html").write_text("kept")
    with Results(out) as results:
        results.workplace("a").mkdir()
        (results.workplace("a") / "report.html").write_text("new")
        (out / "rows").rename(tmp_path / "rows")
        (out / "rows").symlink_to(outside)
        results.add(result("a"))
        out.rename(tmp_path / "moved")
        out.symlink_to(outside)
        results.add(result("b"))
        results.arrange([result("b")])
        results.write_page("page")
    assert sorted(path.name for path in outside.rglob("*")) == ["a", "report.html", "results.jsonl"]
    assert (outside / "results.jsonl").read_text() == (outside / "a" / "report.html").read_text() == "kept"
    assert (tmp_path / "rows" / "a" / "report.html").read_text() == "new"
    assert (tmp_path / "moved" / "index.html").read_text() == "page"


def test_a_batch_that_is_killed_before_its_first_row_is_resumed(tmp_path, monkeypatch):
    def killed(*_: object) -> None:
        raise SystemExit("killed here")

    monkeypatch.setattr("agent.batch.results.check_subfolder", killed)
    with pytest.raises(SystemExit):
        Results(tmp_path)
    monkeypatch.undo()
    (tmp_path / "rows").mkdir(exist_ok=True)
    Results(tmp_path).close()

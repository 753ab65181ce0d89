"""Which folders a command may write into, and which files in them it may remove: its own alone."""

import json
import os
from pathlib import Path

import pytest

from agent.cli.app import command_line
from agent.errors import NotWritten, UsageError
from agent.event_base import RecordedEvent
from agent.rendering.image_files import Picture
from agent.reporting.replay import write_page
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import SessionWriter, run_session
from agent.runtime.output_ownership import (
    MARKER,
    check_own_folder,
    claim_folder,
    files_written,
    mark,
    own_folder,
    remove_written,
)
from grounding.atomic_files import opened

REPORT = {
    "schema_version": 2, "version": "0.1.0", "instruction": "", "options": {}, "outcome": {}, "scene": None,
    "verdict": None, "pictures": [],
}  # fmt: skip


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def listed_in(folder: Path, kind: str = "run") -> set[str]:
    with opened(folder) as place:
        return files_written(place, kind)


def marked(folder: Path, kind: str, names: list[str]) -> None:
    with opened(folder) as place:
        mark(place, kind, names)


def removed(folder: Path, kind: str) -> None:
    with opened(folder) as place:
        remove_written(place, kind)


def record_with(*names: str) -> RunRecord:
    record = RunRecord()
    for name in names:
        record.on_picture(Picture(name, "", b"RIFF"))
    return record


@pytest.mark.parametrize(
    "command", [["run", "make a line"], ["chat"], ["batch", "rows.txt"], ["evaluate", "parse"], ["evaluate", "arm"]],
    ids=" ".join,
)  # fmt: skip
def test_a_folder_of_somebody_else_is_refused_before_any_work(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("rows.txt").write_text("make a line\n")
    Path("mine").mkdir()
    (Path("mine") / "session.jsonl").write_text('{"a": 1}\n')
    before = contents(tmp_path)
    assert command_line([*command, "--out", "mine"]) == 2
    said = capsys.readouterr().err
    assert "'mine' holds files that structagent did not write" in said and "--force" in said
    assert contents(tmp_path) == before


@pytest.mark.parametrize("kind", ["run", "chat", "batch", "evaluation"])
def test_a_folder_is_taken_by_its_own_kind_alone(kind, tmp_path):
    for folder in (tmp_path / "missing", tmp_path):
        check_own_folder(folder, kind)
    marked(tmp_path, kind, ["a"])
    for other in ("run", "chat", "batch", "evaluation"):
        if other == kind:
            check_own_folder(tmp_path, other)
        else:
            with pytest.raises(UsageError, match="would mix with it; choose another --out"):
                check_own_folder(tmp_path, other)
            check_own_folder(tmp_path, other, force=True)


@pytest.mark.parametrize(
    "marker",
    ["", "[]", "{}", "[" * 20000, '{"marker_version": 2, "kind": "run", "files": []}',
     '{"marker_version": 1, "kind": "run", "files": {"a": 1}}', '{"marker_version": 1, "kind": ["run"], "files": []}'],
    ids=range(7),
)  # fmt: skip
def test_a_marker_that_is_none(marker, tmp_path):
    (tmp_path / MARKER).write_text(marker)
    with pytest.raises(UsageError, match="did not write"):
        check_own_folder(tmp_path, "run")


def test_what_a_manifest_may_not_name(tmp_path):
    outside, folder = tmp_path / "outside", tmp_path / "out"
    outside.mkdir()
    (folder / "sub").mkdir(parents=True)
    for path in (outside / "mine", folder / "sub" / "mine", folder / "notes", folder / "own"):
        path.write_text("kept")
    (folder / "link").symlink_to(outside / "mine")
    (folder / "linked").symlink_to(outside)
    names = ["../outside/mine", str(outside / "mine"), "sub/mine", "sub", "link", "linked", "linked/mine", "..", ".",
             "",
             "own", "gone", "a\0b", 7, None, MARKER]  # fmt: skip
    (folder / MARKER).write_text(json.dumps({"marker_version": 1, "kind": "run", "files": names}))
    assert listed_in(folder) == {"own"}
    removed(folder, "run")
    assert sorted(path.name for path in folder.iterdir()) == [MARKER, "link", "linked", "notes", "sub"]
    assert (outside / "mine").read_text() == (folder / "sub" / "mine").read_text() == "kept"


def test_the_next_run_removes_the_pictures_of_the_last_and_nothing_else(tmp_path):
    record_with("one", "two").write(tmp_path)
    (tmp_path / "holiday.webp").write_bytes(b"RIFF")
    record_with("two").write(tmp_path)
    assert sorted(contents(tmp_path)) == [MARKER, "holiday.webp", "report.html", "report.json", "two.webp"]
    assert listed_in(tmp_path) == {"report.html", "report.json", "two.webp"}


def test_a_report_of_an_earlier_version_is_recognised_and_its_pictures_removed(tmp_path):
    listed = [
        {"name": "one", "file": "one.webp"},
        {"name": "old", "file": "old.png"},
        {"name": "letter", "file": "letter.webp"},  # is none
        {"name": "holiday", "file": "notes.txt"},
        {"name": "up", "file": "../up.webp"},
        {"name": "deep", "file": "sub/deep.webp"},
    ]
    folder = tmp_path / "out"
    (folder / "sub").mkdir(parents=True)
    (folder / "report.json").write_text(json.dumps(REPORT | {"pictures": listed}))
    for name, content in {"one.webp": b"RIFF", "old.png": b"\x89PNG", "letter.webp": b"Dear", "notes.txt": b"",
                          "../up.webp": b"RIFF", "sub/deep.webp": b"RIFF"}.items():  # fmt: skip
        (folder / name).write_bytes(content)
    check_own_folder(folder, "run")
    record_with("new").write(folder)
    left = {"letter.webp", "notes.txt", "sub/deep.webp"}
    assert set(contents(folder)) == left | {MARKER, "new.webp", "report.json", "report.html"}
    assert (tmp_path / "up.webp").exists()


@pytest.mark.parametrize(
    "report", ["", "[]", json.dumps({"pictures": [{"file": "a.webp"}]}), json.dumps(REPORT | {"schema_version": 3})],
    ids=range(4),
)  # fmt: skip
def test_a_report_of_somebody_else(report, tmp_path):
    (tmp_path / "report.json").write_text(report)
    (tmp_path / "a.webp").write_bytes(b"RIFF")
    with pytest.raises(UsageError, match="did not write"):
        check_own_folder(tmp_path, "run")
    assert listed_in(tmp_path) == set()


def test_a_session_of_somebody_else_beside_a_report_of_ours(tmp_path):
    (tmp_path / "report.json").write_text(json.dumps(REPORT))
    (tmp_path / "session.jsonl").write_text('{"mine": 1}\n')
    with pytest.raises(UsageError, match="did not write"):
        check_own_folder(tmp_path, "run")


def test_a_chat_that_was_kept_is_not_replaced_by_a_run(tmp_path):
    SessionWriter(tmp_path / "session.jsonl", {}).close()  # as earlier versions did, without a marker
    check_own_folder(tmp_path, "chat")
    with pytest.raises(UsageError, match="did not write"):
        check_own_folder(tmp_path, "run")
    with SessionWriter(tmp_path / "session.jsonl", {}, owner="chat"):
        pass
    with pytest.raises(UsageError, match="holds the output of a chat"):
        check_own_folder(tmp_path, "run")


def test_by_force_a_folder_is_taken_and_what_is_in_it_stays(tmp_path):
    (tmp_path / "notes").write_text("mine")
    claim_folder(tmp_path, "evaluation", force=True)
    check_own_folder(tmp_path, "evaluation")
    removed(tmp_path, "evaluation")
    assert (tmp_path / "notes").read_text() == "mine"


def test_a_link_in_the_place_of_a_report_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "mine").write_text("kept")
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("report.json", "report.html", "session.jsonl", MARKER):
        (folder / name).symlink_to(tmp_path / "mine")
    claim_folder(folder, "run", force=True)
    with run_session(folder, {}) as session:
        session.on_event(RecordedEvent({"kind": "perceived"}))
        record_with().write(folder)
    assert (tmp_path / "mine").read_text() == "kept"
    assert not any(path.is_symlink() for path in folder.iterdir())


def test_a_chat_does_not_follow_a_link(tmp_path):
    SessionWriter(tmp_path / "other.jsonl", {}).close()
    before = (tmp_path / "other.jsonl").read_bytes()
    (tmp_path / "session.jsonl").symlink_to(tmp_path / "other.jsonl")
    with pytest.raises(NotWritten, match="cannot write the session"):
        SessionWriter(tmp_path / "session.jsonl", {})
    assert (tmp_path / "other.jsonl").read_bytes() == before


def no_room(descriptor: int) -> None:
    raise OSError(28, "No space left on device")


def test_a_full_disk_leaves_the_earlier_report_and_page_whole(tmp_path, monkeypatch):
    record_with("one", "two").write(tmp_path)
    session = tmp_path / "chat" / "session.jsonl"
    SessionWriter(session, {}).close()
    write_page(session, tmp_path / "page.html")
    before = contents(tmp_path)
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(NotWritten, match="cannot write the report into .*No space left on device"):
        record_with("two", "three").write(tmp_path)
    with pytest.raises(NotWritten, match="cannot write the page .*No space left on device"):
        write_page(session, tmp_path / "page.html")
    assert contents(tmp_path) == before


def test_a_session_on_a_full_disk_has_whole_lines_alone(tmp_path, monkeypatch):
    path = tmp_path / "session.jsonl"
    with SessionWriter(path, {}) as session:
        before = path.read_bytes()
        session._file = HalfFull(session._file)
        with pytest.raises(NotWritten, match="No space left on device"):
            session.on_event(RecordedEvent({"kind": "noted", "message": "x" * 100}))
        assert path.read_bytes() == before
        session.on_event(RecordedEvent({"kind": "noted", "message": "after that"}))
    assert [list(json.loads(line)) for line in path.read_text().splitlines()][1] == ["seconds", "event"]


class HalfFull:
    """A file that takes half of what it is first given, and then nothing until the next attempt."""

    def __init__(self, file):
        self._file, self._calls = file, 0

    def __getattr__(self, name):
        return getattr(self._file, name)

    def write(self, content: bytes) -> int:
        self._calls += 1
        if self._calls == 2:
            no_room(0)
        return self._file.write(content[: len(content) // 2] if self._calls == 1 else content)


def test_the_session_of_an_earlier_run_stays_where_there_is_no_room_for_a_new_one(tmp_path, monkeypatch):
    def told() -> None:
        with run_session(tmp_path, {}) as session:
            session.on_event(RecordedEvent({"kind": "perceived"}))

    told()
    before = contents(tmp_path)
    monkeypatch.setattr("agent.reporting.session_log._write", lambda file, content: no_room(0))
    with pytest.raises(NotWritten, match="cannot write the session"):
        told()
    assert contents(tmp_path) == before


def test_two_runs_in_one_folder(tmp_path):
    with run_session(tmp_path, {}) as session:
        session.on_event(RecordedEvent({"kind": "perceived"}))
        with run_session(tmp_path, {}) as second, pytest.raises(UsageError, match="another process writes the session"):
            second.on_event(RecordedEvent({"kind": "perceived"}))
        session.on_event(RecordedEvent({"kind": "noted", "message": "still mine"}))
    assert "still mine" in (tmp_path / "session.jsonl").read_text()


def foreign(folder: Path) -> dict[str, bytes]:
    """Make a folder with files of somebody else under the names of ours, and return what it contains."""
    folder.mkdir()
    for name in ("report.html", "report.json", "session.jsonl", "one.webp", "notes"):
        (folder / name).write_text("mine")
    return contents(folder)


def test_a_link_put_in_a_folders_place_between_the_check_and_the_writing_leads_nowhere(tmp_path):
    outside, out = tmp_path / "outside", tmp_path / "out"
    before = foreign(outside)
    out.mkdir()
    check_own_folder(out, "run")
    out.rmdir()
    out.symlink_to(outside)
    with run_session(out, {}) as session, pytest.raises(UsageError, match="did not write"):
        session.on_event(RecordedEvent({"kind": "perceived"}))
    with pytest.raises(UsageError, match="did not write"):
        record_with("one").write(out)
    with pytest.raises(UsageError, match="did not write"):
        SessionWriter(out / "session.jsonl", {}, owner="chat")
    assert contents(outside) == before


def test_a_link_put_in_the_place_of_a_folder_that_is_open_leads_nowhere(tmp_path):
    outside, out = tmp_path / "outside", tmp_path / "out"
    before = foreign(outside)
    with own_folder(out, "run") as place:
        out.rename(tmp_path / "moved")
        out.symlink_to(outside)
        mark(place, "run", ["one.webp"])
        place.write({"one.webp": "ours"})
        assert files_written(place, "run") == {"one.webp"}
        remove_written(place, "run")
    assert contents(outside) == before
    assert list(contents(tmp_path / "moved")) == [MARKER]

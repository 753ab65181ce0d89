"""What cannot be written is known before any work, whatever command it is for."""

import json
import os
from datetime import datetime
from pathlib import Path

import pytest

from agent.cli.app import command_line
from agent.errors import BadInput, UsageError
from agent.runtime import output_paths
from agent.runtime.output_paths import check_file, check_folder, folder_or_new, write_report


@pytest.mark.parametrize(
    "command",
    [
        ["run", "make a line"],
        ["generate"],
        ["train", "diffusion", "--data", "nowhere"],
        ["evaluate", "success"],
        ["evaluate", "parse"],
        ["evaluate", "language"],
        ["evaluate", "arm"],
        ["evaluate", "recordings"],
    ],
    ids=" ".join,
)
def test_commands_that_write_into_a_folder(command, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert command_line([*command, "--out", str(tmp_path / "file")]) == 2
    assert f"--out must be a folder, but '{tmp_path}/file' is a file" in capsys.readouterr().err
    assert command_line([*command, "--out", str(tmp_path / "file" / "out")]) == 6
    said = capsys.readouterr().err
    assert "/file/out', where nothing can be written (not a directory); legal: a folder" in said


@pytest.mark.parametrize("name", ["completion", "coverage"])
def test_evaluations_that_write_a_file(name, tmp_path, capsys):
    assert command_line(["evaluate", name, "--out", str(tmp_path)]) == 2
    assert f"--out must be a file, but '{tmp_path}' is a folder" in capsys.readouterr().err
    assert command_line(["evaluate", name, "--out", "/proc/report.json"]) == 6
    assert "--out cannot be '/proc/report.json', where nothing can be written" in capsys.readouterr().err


def test_a_name_that_no_system_takes():
    for check in (check_folder, check_file):
        with pytest.raises(BadInput, match="file name too long"):
            check(Path("x" * 300))


def test_checks_leave_nothing_behind(tmp_path):
    kept = tmp_path / "kept.json"
    kept.write_text("{}")
    check_file(kept)
    check_file(tmp_path / "new" / "report.json")
    check_folder(tmp_path / "new" / "folder")
    check_file(None)
    check_folder(None)
    assert [path.name for path in tmp_path.iterdir()] == ["kept.json"] and kept.read_text() == "{}"


def test_a_pipe_is_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    check_file(tmp_path / "pipe")
    with pytest.raises(UsageError, match="is a file"):
        check_folder(tmp_path / "pipe")


def test_a_report_is_written_into_a_new_folder(tmp_path):
    (path,) = write_report({"n": 1}, tmp_path / "new" / "report.json")
    assert json.loads(path.read_text()) == {"n": 1}


def test_a_folder_that_nobody_named_is_new_whatever_the_clock_says(tmp_path, monkeypatch):
    """As in the hour that comes twice in autumn, or for two commands that begin in one second."""
    monkeypatch.chdir(tmp_path)

    class Clock(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime(2030, 10, 27, 2, 30)

    monkeypatch.setattr(output_paths, "datetime", Clock)
    with folder_or_new(None, "seed0") as first:
        (first / "report.html").write_text("kept")
        with folder_or_new(None, "seed0") as second, folder_or_new(None, "seed0") as third:
            (third / "report.html").write_text("kept")
    names = ["20301027-023000-seed0", "20301027-023000-seed0-2", "20301027-023000-seed0-3"]
    assert [first.name, second.name, third.name] == names
    assert sorted(path.name for path in Path("out").iterdir()) == [names[0], names[2]]  # an empty one goes


def test_a_folder_that_was_named_is_taken_as_it_is(tmp_path):
    with folder_or_new(tmp_path / "new", "seed0") as folder:
        assert folder == tmp_path / "new" and not folder.exists()

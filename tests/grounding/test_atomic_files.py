"""Files are replaced completely or not at all, in the folder that was opened,
and nothing of killed processes piles up.
"""

import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from grounding import atomic_files
from grounding.atomic_files import opened, unfinished_folder, write_all_whole, write_whole


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_what_a_killed_process_was_writing_is_removed_by_the_next_that_writes_there(tmp_path):
    killed = f"""
import os, signal
from pathlib import Path
from grounding.atomic_files import opened
with opened(Path({str(tmp_path)!r})) as place:
    file, name = place.unfinished()
    file.write(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, "-c", killed]).returncode == -signal.SIGKILL
    (left,) = names(tmp_path)
    (tmp_path / ".structagent-notes.part").write_text("of somebody else")
    (tmp_path / ".structagent-0123456789abcdef.part").symlink_to(tmp_path / "elsewhere")
    write_whole(tmp_path / "a", "whole")
    assert left not in names(tmp_path)
    assert names(tmp_path) == [".structagent-0123456789abcdef.part", ".structagent-notes.part", "a"]


def test_what_another_process_is_writing_stays(tmp_path):
    with opened(tmp_path) as place:
        file, name = place.unfinished()
        with file:
            write_whole(tmp_path / "a", "whole")
            assert names(tmp_path) == sorted(["a", name])
            place.replace(name, "b")
    assert names(tmp_path) == ["a", "b"]


def test_a_file_that_was_taken_for_abandoned_before_it_was_locked_is_made_again(tmp_path, monkeypatch):
    lock, taken = fcntl.flock, []

    def locked_late(descriptor: int, how: int) -> None:
        if not taken:
            taken.extend(tmp_path.iterdir())
            taken[0].unlink()
        lock(descriptor, how)

    monkeypatch.setattr(atomic_files.fcntl, "flock", locked_late)
    write_whole(tmp_path / "a", "whole")
    assert taken and names(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "whole"


@pytest.mark.parametrize("step", ["replace", "fsync"])
def test_a_link_put_there_while_a_file_is_written_is_replaced_and_not_followed(step, tmp_path, monkeypatch):
    outside, folder = tmp_path / "outside", tmp_path / "out"
    outside.write_text("kept")
    folder.mkdir()
    does, done = getattr(os, step), []

    def swapped(*arguments, **keys):
        if not done:
            done.append((folder / "a").symlink_to(outside))
        return does(*arguments, **keys)

    monkeypatch.setattr(atomic_files.os, step, swapped)
    write_whole(folder / "a", "new")
    assert done and outside.read_text() == "kept"
    assert (folder / "a").read_text() == "new" and not (folder / "a").is_symlink()


def test_a_folder_in_an_open_folder_is_not_reached_through_a_link(tmp_path):
    (tmp_path / "outside").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "outside")
    with opened(tmp_path) as place, pytest.raises(OSError, match="link"), opened(Path("link"), place):
        raise AssertionError("it was opened")


def test_none_of_several_files_is_replaced_where_one_does_not_fit(tmp_path, monkeypatch):
    write_all_whole(tmp_path, {"a": "old", "b": "old"})
    fsync, calls = os.fsync, []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        fsync(descriptor)

    monkeypatch.setattr(atomic_files.os, "fsync", full)
    with pytest.raises(OSError, match="No space left") as refused:
        write_all_whole(tmp_path, {"a": "new", "b": "new"})
    assert refused.value.filename == str(tmp_path / "b")
    assert names(tmp_path) == ["a", "b"] and (tmp_path / "a").read_text() == "old"


def test_files_get_the_permissions_that_the_user_asks_for(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a", "")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_folder_that_a_killed_process_was_making_is_removed_by_the_next(tmp_path):
    killed = f"""
import os, signal
from pathlib import Path
from grounding.atomic_files import unfinished_folder
with unfinished_folder(Path({str(tmp_path / "model")!r})) as folder:
    (folder / "weights").write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, "-c", killed]).returncode == -signal.SIGKILL
    (tmp_path / ".other-0123abcd").mkdir()
    assert len(names(tmp_path)) == 2
    with unfinished_folder(tmp_path / "model") as one, unfinished_folder(tmp_path / "model") as other:
        (one / "weights").write_text("whole")
        assert names(tmp_path) == sorted([".other-0123abcd", one.name, other.name])
        one.rename(tmp_path / "model")
    assert names(tmp_path) == [".other-0123abcd", "model"]
    assert (tmp_path / "model" / "weights").read_text() == "whole"

"""What is said on the way: a bar on a terminal, and lines where there is none."""

import bz2
import io
import sys
import threading
from contextlib import contextmanager

import pytest
import trimesh

from agent.runtime import progress


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


def test_what_takes_long_says_that_it_goes_on(capsys):
    written = threading.Event()

    class Told(io.StringIO):
        def write(self, text):
            written.set()
            return super().write(text)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "stderr", told := Told())
        with progress.report_when_slow("reading 'a.stl'", first=0.0, then=1000.0):
            assert written.wait(60)
    assert told.getvalue() == "reading 'a.stl': 0 s so far\n"


def test_what_is_small_or_soon_done_says_nothing(capsys):
    asked = threading.Event()
    with progress.report_when_slow("reading 'a.stl'", worth=lambda: asked.set() or False, first=0.0, then=1000.0):
        assert asked.wait(60)
    with progress.report_when_slow("reading 'a.stl'", first=1000.0):
        pass
    assert capsys.readouterr().err == ""


def test_large_meshes_and_bags_are_worth_telling(tmp_path, monkeypatch):
    from agent.recordings import bag_reader
    from agent.recordings.decompression import Unpacking, UnpackingLimits
    from agent.scenes import object_placement, sources
    from agent.scenes.files import PlacedObject

    told = []

    @contextmanager
    def note(what, worth):
        told.append((what, worth()))
        yield

    for module in (object_placement, sources, bag_reader):
        monkeypatch.setattr(module, "report_when_slow", note)
    trimesh.creation.box((0.05, 0.05, 0.05)).export(tmp_path / "box.stl")
    sources.scene_source("simulated", str(tmp_path))
    monkeypatch.setattr(object_placement, "SLOW_BYTES", 100)
    object_placement.find_mesh(PlacedObject("box.stl", 0.4, 0.0), tmp_path)
    assert told == [
        (f"reading the meshes in {str(tmp_path)!r}", False),
        (f"reading the mesh '{tmp_path}/box.stl'", True),
    ]
    unpacking = Unpacking(tmp_path / "box.stl", UnpackingLimits())
    assert not unpacking.is_slow()
    for letter in b"ab":
        unpacking.piece(bz2.BZ2Decompressor, bz2.compress(bytes([letter]) * 30_000_000))
    assert unpacking.is_slow()

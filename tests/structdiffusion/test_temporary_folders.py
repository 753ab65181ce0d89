"""Temporary folders go with their process, however it ends; nothing of anybody else goes with them."""

import os
import signal
import subprocess
import sys
from multiprocessing.util import get_temp_dir
from pathlib import Path

import pytest

from structdiffusion.parallel import Lost, in_parallel
from structdiffusion.temporary_folders import TemporaryFolders

ROOT = Path(__file__).parents[2]
PREFIX = "structagent-shapes-"
HOLD = (
    "from structdiffusion.objects.rigid_body import shape_file, solid_content; import numpy as np, sys; "
    "print(shape_file(solid_content([np.eye(4)[:, :3]])), flush=True); sys.stdin.read()"
)


@pytest.fixture
def temporary(tmp_path, monkeypatch) -> Path:
    """The temporary folder of this test."""
    get_temp_dir()  # multiprocessing has one folder for the whole process: not here, where a test counts what is left
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def holding(temporary: Path) -> tuple[subprocess.Popen, Path]:
    """A process that has a folder of shapes, and waits; that folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    return process, Path(process.stdout.readline().strip()).parent


def folders() -> TemporaryFolders:
    return TemporaryFolders(PREFIX, r"[0-9a-f]{32}\.obj")


def test_what_a_killed_process_leaves_goes_and_what_a_living_one_has_stays(temporary):
    killed, abandoned = holding(temporary)
    living, held = holding(temporary)
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    assert abandoned.exists()
    folders().remove_abandoned()
    assert not abandoned.exists() and list(held.glob("*.obj"))
    living.communicate()
    assert list(temporary.iterdir()) == []


def test_a_new_folder_takes_the_place_of_abandoned_ones(temporary):
    killed, abandoned = holding(temporary)
    killed.kill()
    killed.communicate()
    after, own = holding(temporary)
    assert not abandoned.exists() and own.exists()
    after.communicate()


def _shape(_: object, job: str) -> str:
    import numpy as np

    from structdiffusion.objects.model import MassProperties  # noqa: F401 - as a worker imports it
    from structdiffusion.objects.rigid_body import shape_file, surface_content

    shape_file(surface_content(np.eye(3), np.array([[0, 1, 2]])))
    if job == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    return job


def test_workers_leave_nothing_behind(temporary):
    told = list(in_parallel(_shape, tuple, (), ["a", "die", "b"], 1))
    assert [one for one in told if not isinstance(one, Lost)] == ["a", "b"] and isinstance(told[1], Lost)
    assert list(temporary.iterdir()) == []


def test_nothing_of_anybody_else_is_removed(temporary, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    names = ("0" * 32 + ".obj", "lock")
    for folder in (elsewhere, temporary / f"{PREFIX}mine", temporary / "structagent-other-abcdefgh"):
        folder.mkdir(exist_ok=True)
        for name in names:
            (folder / name).write_text("kept")
    (temporary / f"{PREFIX}linked__").symlink_to(elsewhere)
    (temporary / f"{PREFIX}isafile_").write_text("kept")
    unlocked = temporary / f"{PREFIX}unlocked"
    unlocked.mkdir()
    (unlocked / names[0]).write_text("kept")
    mixed = temporary / f"{PREFIX}mixed123"
    mixed.mkdir()
    for name in (*names, "notes.txt"):
        (mixed / name).write_text("kept")
    (mixed / ("1" * 32 + ".obj")).symlink_to(elsewhere / names[0])
    linked_lock = temporary / f"{PREFIX}linklock"
    linked_lock.mkdir()
    (linked_lock / "lock").symlink_to(elsewhere / "lock")
    (linked_lock / names[0]).write_text("kept")
    folders().remove_abandoned()
    assert sorted(path.name for path in elsewhere.iterdir()) == sorted(names)
    assert all((temporary / f"{PREFIX}mine" / name).exists() for name in names)
    assert all((temporary / "structagent-other-abcdefgh" / name).exists() for name in names)
    assert (unlocked / names[0]).exists() and (linked_lock / names[0]).exists()
    assert (temporary / f"{PREFIX}isafile_").exists()
    assert [path.name for path in mixed.iterdir()] == ["notes.txt"]

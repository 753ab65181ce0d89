"""Temporary folders that are removed with the process that made them, even if it is killed.

A killed process cannot remove its folders. Each folder therefore has a lock that its process holds as long as it lives.
A process that makes such a folder, or ends such a process, removes the folders whose lock is no longer held.
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import os
import re
import stat
import tempfile
from pathlib import Path

_LOCK = "lock"


class TemporaryFolders:
    """The temporary folders of one purpose, one in each process.

    Args:
        prefix: begins their names.
        files: the names of the files in them, as a regular expression; nothing else is ever removed.
    """

    def __init__(self, prefix: str, files: str) -> None:
        self._prefix = prefix
        self._name = re.compile(re.escape(prefix) + r"[a-z0-9_]{8}")  # the end that `tempfile` gives
        self._file = re.compile(files)
        self._locks: dict[Path, int] = {}

    def make(self) -> Path:
        """Make a new folder, which is removed when this process ends."""
        self.remove_abandoned()
        while True:
            folder = Path(tempfile.mkdtemp(prefix=self._prefix))
            lock = _locked(folder, os.O_CREAT)
            if lock is not None and (folder / _LOCK).exists():
                break
            if lock is not None:  # another process took it for abandoned before it was locked
                os.close(lock)
        self._locks[folder] = lock
        atexit.register(self._remove_own, folder, os.getpid())
        return folder

    def remove_abandoned(self) -> None:
        """Remove the folders of processes of this user that have ended without removing them."""
        with contextlib.suppress(OSError):
            for entry in os.scandir(tempfile.gettempdir()):
                if self._name.fullmatch(entry.name) and Path(entry.path) not in self._locks:
                    self._remove_if_abandoned(Path(entry.path))

    def _remove_if_abandoned(self, folder: Path) -> None:
        try:
            found = folder.lstat()
        except OSError:
            return
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
            return
        lock = _locked(folder)
        if lock is not None:
            self._remove(folder)
            os.close(lock)

    def _remove_own(self, folder: Path, process: int) -> None:
        if os.getpid() == process:  # a fork of it leaves them alone
            self._remove(folder)
            os.close(self._locks.pop(folder))

    def _remove(self, folder: Path) -> None:
        with contextlib.suppress(OSError):
            for entry in list(os.scandir(folder)):
                if self._file.fullmatch(entry.name) and not entry.is_dir(follow_symlinks=False):
                    os.unlink(entry.path)
            os.unlink(folder / _LOCK)
            folder.rmdir()


def _locked(folder: Path, create: int = 0) -> int | None:
    """Return the folder's lock, held until it is closed; `None` if there is none, or another process holds it."""
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW | create, 0o600)
    except OSError:
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        return None
    return lock


SHAPES = TemporaryFolders("structagent-shapes-", r"[0-9a-f]{32}\.obj")

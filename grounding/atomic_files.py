"""Replace files completely or not at all: after a full disk or a killed process the earlier content remains.

Everything happens in an open folder (`OpenFolder`), not at a path: a symbolic link that takes the folder's place
meanwhile leads nowhere. A file is first written under another name, and locked as long as its process is at it. What a
killed process left there is removed by the next one that writes into the folder.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

_UNFINISHED = re.compile(r"\.structagent-[a-z0-9_]{8,16}\.part")


@dataclass(frozen=True)
class OpenFolder:
    """A folder that stays the same one, whatever its path leads to meanwhile.

    Attributes:
        path: its path when it was opened, for messages.
        descriptor: the open folder.
    """

    path: Path
    descriptor: int

    def write(self, files: Mapping[str, bytes | str]) -> None:
        """Write several files, texts as UTF-8; none is replaced before all of them fit on the disk.

        A symbolic link with the name of one is replaced, not followed.

        Args:
            files: name -> content.

        Raises:
            OSError: if one cannot be written; all files are then unchanged.
        """
        self.remove_abandoned()
        staged: dict[str, str] = {}
        try:
            for name, content in files.items():
                if self.kind(name) == stat.S_IFDIR:  # refused here, before any other file is replaced
                    raise IsADirectoryError(errno.EISDIR, "is a directory", str(self.path / name))
                staged[name] = self._staged(name, content.encode() if isinstance(content, str) else content)
            for name, unfinished in staged.items():
                self.replace(unfinished, name)
            with contextlib.suppress(OSError):  # not every file system can; a power cut may bring the old names back
                os.fsync(self.descriptor)
        finally:
            for unfinished in staged.values():
                self.remove(unfinished)

    def unfinished(self) -> tuple[BinaryIO, str]:
        """Make a new, empty, unbuffered file that is locked; return it and its name, to be replaced by another."""
        while True:
            name = f".structagent-{secrets.token_hex(8)}.part"
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
            descriptor = os.open(name, flags, 0o666, dir_fd=self.descriptor)
            with contextlib.suppress(OSError):  # a file system without locks, where nothing is removed either
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if self.kind(name) is not None:
                return os.fdopen(descriptor, "wb", buffering=0), name
            os.close(descriptor)  # another process took it for abandoned before it was locked

    def open(self, name: str, flags: int, mode: int = 0o666) -> int:
        """Open a file; symbolic links are not followed, and a pipe is not waited for.

        Raises:
            OSError: as `os.open` does, with the path of the file.
        """
        try:
            return os.open(name, flags | os.O_NOFOLLOW | os.O_NONBLOCK, mode, dir_fd=self.descriptor)
        except OSError as error:
            error.filename = str(self.path / name)
            raise

    def kind(self, name: str) -> int | None:
        """Return what a name stands for, one of `stat.S_IF...`; `None` if there is no such file."""
        try:
            return stat.S_IFMT(os.stat(name, dir_fd=self.descriptor, follow_symlinks=False).st_mode)
        except OSError:
            return None

    def replace(self, name: str, other: str, into: OpenFolder | None = None) -> None:
        """Give a file or an empty folder's place, here or in another folder, to the file or folder `name`.

        Raises:
            OSError: as `os.replace` does, with the path of what should be replaced.
        """
        into = into or self
        try:
            os.replace(name, other, src_dir_fd=self.descriptor, dst_dir_fd=into.descriptor)
        except OSError as error:
            error.filename, error.filename2 = str(into.path / other), None
            raise

    def remove(self, name: str) -> None:
        """Remove a file, if it is there and can be removed."""
        with contextlib.suppress(OSError):
            os.unlink(name, dir_fd=self.descriptor)

    def names(self) -> list[str]:
        """List the names of what is in it."""
        return os.listdir(self.descriptor)

    def remove_abandoned(self) -> None:
        """Remove the unfinished files of processes of this user that were killed."""
        for name in filter(_UNFINISHED.fullmatch, self.names()):
            with contextlib.suppress(OSError):
                descriptor = self.open(name, os.O_RDONLY)
                try:
                    found = os.fstat(descriptor)
                    if stat.S_ISREG(found.st_mode) and found.st_uid == os.getuid():
                        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        self.remove(name)
                finally:
                    os.close(descriptor)

    def _staged(self, name: str, content: bytes) -> str:
        """Write the content to a new file, force it to the disk, and return that file's name."""
        try:
            file, unfinished = self.unfinished()
            try:
                with file:
                    while content:  # a system takes part of it where the disk is nearly full
                        content = content[file.write(content) :]
                    os.fsync(file.fileno())
            except BaseException:
                self.remove(unfinished)
                raise
        except OSError as error:
            error.filename = str(self.path / name)  # the name that the user knows
            raise
        return unfinished


@contextmanager
def opened(path: Path, inside: OpenFolder | None = None) -> Iterator[OpenFolder]:
    """Open a folder that exists.

    Args:
        path: its path, which may be a symbolic link; with `inside` a plain name, which may not.
        inside: the folder that it is in.

    Raises:
        OSError: if it is no folder, or with `inside` a symbolic link.
    """
    flags = os.O_RDONLY | os.O_DIRECTORY
    if inside is None:
        descriptor = os.open(path, flags)
    else:
        descriptor, path = inside.open(path.name, flags), inside.path / path.name
    try:
        yield OpenFolder(path, descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def unfinished_folder(final: Path) -> Iterator[Path]:
    """Yield a new folder beside `final`, to be renamed to it; one that is not is removed, also after a killed process.

    Raises:
        OSError: if it cannot be made.
    """
    prefix = f".{final.name}-"
    final.parent.mkdir(parents=True, exist_ok=True)
    _remove_abandoned_folders(final.parent, re.compile(re.escape(prefix) + r"[a-z0-9_]{8}"))
    folder = Path(tempfile.mkdtemp(prefix=prefix, dir=final.parent))
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        folder.mkdir(mode=0o700, exist_ok=True)  # another process may have taken it for abandoned before it was locked
        yield folder
    finally:
        os.close(lock)
        shutil.rmtree(folder, ignore_errors=True)


def _remove_abandoned_folders(parent: Path, name: re.Pattern[str]) -> None:
    """Remove the folders of this user with such names that no process has locked."""
    for path in parent.iterdir():
        if name.fullmatch(path.name):
            with contextlib.suppress(OSError):
                lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                try:
                    if os.fstat(lock).st_uid == os.getuid():
                        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        shutil.rmtree(path, ignore_errors=True)
                finally:
                    os.close(lock)


def write_whole(path: Path, content: bytes | str) -> None:
    """Write one file, text as UTF-8; a symbolic link with its name is replaced, not followed.

    Raises:
        OSError: if it cannot be written; the file is then unchanged.
    """
    write_all_whole(path.parent, {path.name: content})


def write_all_whole(folder: Path, files: Mapping[str, bytes | str]) -> None:
    """Write several files into one folder; none is replaced before all of them fit on the disk.

    Args:
        folder: the folder; created if missing.
        files: name -> content.

    Raises:
        OSError: if one cannot be written; all files are then unchanged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with opened(folder) as place:
        place.write(files)

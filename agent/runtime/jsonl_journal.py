"""Append to a JSON-lines file while a process works, and repair a last line that a killed process left incomplete."""

from __future__ import annotations

import codecs
import fcntl
import json
import os
import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError
from agent.runtime.output_paths import check_folder
from grounding.atomic_files import OpenFolder, opened

Entry = dict[str, Any]
_LOCK = ".lock"
_FLAGS = os.O_RDWR | os.O_APPEND | os.O_CREAT


@contextmanager
def locked_folder(folder: Path, who: str) -> Iterator[OpenFolder]:
    """Open a folder of `--out`, which is created if missing, and keep other processes of this tool out of it meanwhile.

    The lock ends with the process, however that ends.

    Args:
        folder: the value of `--out`.
        who: the verb that works in it, such as "batch".

    Raises:
        UsageError: if the folder is a file, or another process has locked it.
        BadInput: if nothing can be written there.
    """
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with opened(folder) as place:
        lock = _locked(place, who)
        try:
            place.remove_abandoned()
            yield place
        finally:
            os.close(lock)


def _locked(place: OpenFolder, who: str) -> int:
    """Lock a folder until the descriptor that is returned is closed."""
    lock = place.open(_LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        message = f"another {who} is at work in {str(place.path)!r}; wait for it, or choose another --out"
        raise UsageError(message) from None
    return lock


class Journal:
    """A file of JSON lines, each forced to the disk when it is added. Close it, or use it as a context manager.

    Args:
        place: the folder, a `locked_folder`, which stays open as long as the journal.
        name: the name of the file in it; created if missing.
        keys: the keys that every entry must have.
        what: the term for an entry in messages, such as "result of a batch".
        problem: says what is wrong with an entry that has these keys. Where it is given, a line that is no entry costs
            no other: it is left out here and in the file.

    Attributes:
        entries: the entries in the order of the file; an incomplete last line is dropped here and in the file.
        left_out: a sentence for each line that was left out because of what it says.

    Raises:
        BadInput: without `problem`, if a line other than the last is not an entry; with it, if none is.
    """

    def __init__(
        self,
        place: OpenFolder,
        name: str,
        keys: set[str],
        what: str,
        problem: Callable[[Entry], str | None] | None = None,
    ) -> None:
        self.path, self._place = place.path / name, place
        self.entries: list[Entry] = []
        self.left_out: list[str] = []
        if place.kind(name) == stat.S_IFLNK:
            raise BadInput(f"{str(self.path)!r} is a symbolic link, and must be a file; choose another --out")
        self._file = place.open(name, _FLAGS)
        try:
            self._recover(keys, what, problem)
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        os.close(self._file)

    def add(self, entry: Entry) -> None:
        """Append an entry completely, or nothing if the disk has no room for it."""
        size = os.fstat(self._file).st_size
        try:
            _write_all(self._file, _line(entry))
            os.fsync(self._file)
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._file, size)
            error.filename = str(self.path)
            raise
        self.entries.append(entry)

    def arrange(self, entries: Sequence[Entry]) -> None:
        """Replace all entries with these in one step."""
        self._replace(b"".join(map(_line, entries)))
        self.entries = list(entries)

    def _recover(self, keys: set[str], what: str, problem: Callable[[Entry], str | None] | None) -> None:
        content = _all_of(self._file)
        lines = (content[len(codecs.BOM_UTF8) :] if content.startswith(codecs.BOM_UTF8) else content).split(b"\n")
        last = max((number for number, line in enumerate(lines, start=1) if line), default=0)
        whole = []
        for number, line in enumerate(lines, start=1):
            entry = entry_of(line, keys)
            wrong = None if entry is None or problem is None else problem(entry)
            if entry is not None and wrong is None:
                self.entries.append(entry)
                whole.append(line + b"\n")
            elif number < last or wrong:
                sentence = f"{str(self.path)!r}, line {number}: {wrong or f'this is not a {what}'}"
                if problem is None:
                    raise BadInput(f"{sentence}; choose another --out")
                if line.strip():
                    self.left_out.append(sentence)
        if self.left_out and not self.entries:
            raise BadInput(f"{self.left_out[0]}; choose another --out")
        kept = b"".join(whole)  # at once: bytes that grow by a line at a time are copied for every line
        if kept != content:
            self._replace(kept)

    def _replace(self, content: bytes) -> None:
        self._place.write({self.path.name: content})
        replaced = self._place.open(self.path.name, _FLAGS)
        os.close(self._file)
        self._file = replaced


def _all_of(descriptor: int) -> bytes:
    with open(descriptor, "rb", closefd=False) as file:
        return file.read()


def _line(entry: Entry) -> bytes:
    return json.dumps(entry, ensure_ascii=False, allow_nan=False).encode() + b"\n"


def entry_of(line: bytes, keys: set[str]) -> Entry | None:
    """Parse a line into an object with these keys; `None` if it is not one."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) and keys <= entry.keys() else None


def _write_all(descriptor: int, content: bytes) -> None:
    while content:
        content = content[os.write(descriptor, content) :]

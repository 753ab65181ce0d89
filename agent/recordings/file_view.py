"""Show a file that was cut short as another one: other first bytes, and another end.

The file itself is not changed: the library that reads bags reads it through a view.
"""

from __future__ import annotations

import bz2
import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from lz4.frame import LZ4FrameDecompressor

from agent.recordings.decompression import most_of_piece, zstd

_UNPACKERS = {"bz2": bz2.BZ2Decompressor, "lz4": LZ4FrameDecompressor, "zstd": zstd.ZstdDecompressor}


class NothingWhole(Exception):
    """No piece of the file is whole."""


@dataclass(frozen=True)
class RepairedFile:
    """A file with another beginning and another end, as far as the readers of bags use a path.

    Attributes:
        path: the file on the disk.
        head: replaces its first bytes.
        kept: how many of its bytes are kept, those replaced included.
        tail: follows them.
    """

    path: Path
    head: bytes
    kept: int
    tail: bytes

    @property
    def suffix(self) -> str:
        """Return the suffix of the file."""
        return self.path.suffix

    @property
    def note(self) -> str:
        """Return what was done, a sentence."""
        return f"{self.path.name} was cut short or never closed: its whole messages were read"

    def __str__(self) -> str:
        return str(self.path)

    def exists(self) -> bool:
        """Return whether the file is there."""
        return self.path.exists()

    def is_file(self) -> bool:
        """Return whether it is a file."""
        return self.path.is_file()

    def is_dir(self) -> bool:
        """Return whether it is a folder: never."""
        return False

    def open(self, mode: str = "rb") -> BinaryIO:
        """Open the view for reading."""
        return io.BufferedReader(_View(self), 1 << 16)


class _View(io.RawIOBase):
    """The bytes of a repaired file."""

    def __init__(self, repaired: RepairedFile) -> None:
        self._file = repaired.path.open("rb")
        # (begin, end, bytes or the file) of each stretch
        kept, head, tail = repaired.kept, repaired.head, repaired.tail
        self._stretches = ((0, len(head), head), (len(head), kept, None), (kept, kept + len(tail), tail))
        self._at = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        origin = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._stretches[-1][1]}[whence]
        if origin + offset < 0:
            raise OSError(22, "a position before the beginning of the file")
        self._at = origin + offset
        return self._at

    def readinto(self, buffer: Any) -> int:
        for begin, end, content in self._stretches:
            if begin <= self._at < end:
                most = min(len(buffer), end - self._at)
                if content is None:
                    self._file.seek(self._at)
                    data = self._file.read(most)
                else:
                    data = content[self._at - begin : self._at - begin + most]
                buffer[: len(data)] = data
                self._at += len(data)
                return len(data)
        return 0

    def close(self) -> None:
        self._file.close()
        super().close()


def unpacked_beginning(compression: str, data: bytes) -> bytes:
    """Unpack what can be unpacked of a piece that was cut; nothing where the compression is not known."""
    if compression in ("", "none"):
        return data
    if compression not in _UNPACKERS:
        return b""
    try:
        return _UNPACKERS[compression]().decompress(data, max_length=most_of_piece())
    except Exception:  # the libraries promise no kind of error for damaged data
        return b""

"""Unpack compressed bags within limits, independent of the sizes in their headers.

The library that reads bags unpacks whole pieces without asking how large they become. Its unpackers are replaced here,
where it looks them up, by ones that stop at the limit.
"""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

from lz4.frame import LZ4FrameDecompressor
from rosbags.rosbag1 import reader as ros1
from rosbags.rosbag2 import reader as ros2
from rosbags.rosbag2 import storage_mcap as mcap

from agent.errors import BadInput
from structdiffusion.limits import (
    BAG_FILE_BYTES,
    BAG_FILE_TIMES,
    BAG_PIECE_BYTES,
    BAG_UNPACKED_BYTES,
    BAG_UNPACKED_TIMES,
    SLOW_BAG_BYTES,
)

zstd = ros2.zstd  # in Python's own library from 3.14 on, and in a package before


@dataclass(frozen=True)
class UnpackingLimits:
    """Limits for unpacked data, bytes; see `structdiffusion.limits`."""

    piece: int = BAG_PIECE_BYTES
    all_pieces: int = BAG_UNPACKED_BYTES
    all_times: int = BAG_UNPACKED_TIMES
    files: int = BAG_FILE_BYTES
    file_times: int = BAG_FILE_TIMES


class Unpacking:
    """A count of what one open bag has unpacked so far.

    Args:
        path: the bag's file or folder; `None` if unknown.
        limits: the most that it may unpack.
    """

    def __init__(self, path: Path | None, limits: UnpackingLimits = UnpackingLimits()) -> None:
        self._path, self._limits = path or Path("a bag"), limits
        files = [path] if path is not None and path.is_file() else []
        if path is not None and path.is_dir():
            files = [file for file in path.iterdir() if file.is_file()]
        packed = sum(file.stat().st_size for file in files)
        self._size = packed
        self._all = self._left = max(limits.all_pieces, limits.all_times * packed)
        self._left_of_files = max(limits.files, limits.file_times * packed)

    def is_slow(self) -> bool:
        """Return whether the bag is, or was, so large that reading takes long."""
        return max(self._size, self._all - self._left) > SLOW_BAG_BYTES

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count the bytes that are unpacked within the context."""
        token = _CURRENT.set(self)
        try:
            yield
        finally:
            _CURRENT.reset(token)

    def piece(self, start: Callable[[], Any], data: bytes) -> bytes:
        """Unpack one packed piece.

        Args:
            start: creates an unpacker, such as `bz2.BZ2Decompressor`.
            data: the packed bytes.

        Raises:
            BadInput: if it would become too large.
            EOFError: if it is truncated.
        """
        pieces: list[bytes] = []
        most, total, rest = min(self._limits.piece, self._left), 0, data
        while rest:
            unpacker = start()
            try:
                pieces.append(unpacker.decompress(rest, max_length=most - total + 1))
            except Exception:
                if pieces:  # what follows a whole stream is no other one
                    break
                raise
            total += len(pieces[-1])
            if total > most:
                raise BadInput(
                    f"{str(self._path)!r} has a packed piece of {len(data)} bytes that becomes larger than {most} "
                    f"bytes; a piece may become {self._limits.piece}, and all that is read of this bag "
                    f"{self._left} more"
                )
            if not unpacker.eof:
                raise EOFError("a packed piece is cut short")
            rest = unpacker.unused_data or b""
        self._left -= total
        return b"".join(pieces)

    def take_of_file(self, count: int) -> None:
        """Count bytes of an unpacked file.

        Raises:
            BadInput: if it becomes too large.
        """
        self._left_of_files -= count
        if self._left_of_files < 0:
            raise BadInput(
                f"the packed files of {str(self._path)!r} become too large: temporary files of {self._limits.files} "
                f"bytes, or of {self._limits.file_times} times the folder's size, may be written"
            )


_CURRENT: ContextVar[Unpacking | None] = ContextVar("unpacking", default=None)


def _current() -> Unpacking:
    """Return the active count; if the library is used directly, a count of its own."""
    return _CURRENT.get() or Unpacking(None)


class _CountedFile:
    """A packed file that is read unpacked and counted."""

    def __init__(self, file: BinaryIO, mode: str) -> None:
        self._file = zstd.open(file, mode)

    def __enter__(self) -> _CountedFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        _current().take_of_file(len(data))
        return data


def _unpacker(start: Callable[[], Any]) -> Callable[..., bytes]:
    def unpacked(data: bytes, *_: int) -> bytes:
        return _current().piece(start, data)

    return unpacked


ros1.decompressors.update({"bz2": _unpacker(bz2.BZ2Decompressor), "lz4": _unpacker(LZ4FrameDecompressor)})
mcap.DECOMPRESSORS.update({"lz4": _unpacker(LZ4FrameDecompressor), "zstd": _unpacker(zstd.ZstdDecompressor)})
ros2.zstd = SimpleNamespace(open=_CountedFile, decompress=_unpacker(zstd.ZstdDecompressor))

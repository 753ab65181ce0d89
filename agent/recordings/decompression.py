"""Unpack compressed bags within limits, independent of the sizes in their headers.

The library that reads bags unpacks whole pieces without asking how large they become. Its unpackers are replaced here,
where it looks them up, by ones that stop at the limit.
"""

from __future__ import annotations

import bz2
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

import apsw
from lz4.frame import LZ4FrameDecompressor
from rosbags.rosbag1 import reader as ros1
from rosbags.rosbag2 import reader as ros2
from rosbags.rosbag2 import storage_mcap as mcap

from agent.errors import BadInput
from structdiffusion.limits import (
    BAG_DATABASE_STEPS,
    BAG_DATABASE_STEPS_A_BYTE,
    BAG_DENSE_RECORDS,
    BAG_FILE_BYTES,
    BAG_FILE_TIMES,
    BAG_MESSAGES,
    BAG_MESSAGES_A_BYTE,
    BAG_PIECE_BYTES,
    BAG_SMALL_PIECE_BYTES,
    BAG_UNPACKED_BYTES,
    BAG_UNPACKED_TIMES,
    SLOW_BAG_BYTES,
)

STEPS_AT_ONCE = 1_000_000
_LENGTH = struct.Struct("<Q")
zstd = ros2.zstd  # in Python's own library from 3.14 on, and in a package before


@dataclass(frozen=True)
class UnpackingLimits:
    """Limits for unpacked data, bytes; see `structdiffusion.limits`."""

    piece: int = BAG_PIECE_BYTES
    small_piece: int = BAG_SMALL_PIECE_BYTES
    all_pieces: int = BAG_UNPACKED_BYTES
    all_times: int = BAG_UNPACKED_TIMES
    files: int = BAG_FILE_BYTES
    file_times: int = BAG_FILE_TIMES
    messages: int = BAG_MESSAGES
    dense_records: int = BAG_DENSE_RECORDS
    database_steps: int = BAG_DATABASE_STEPS


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
        self.most_of_piece = min(limits.piece, max(limits.small_piece, limits.all_times * packed))
        self._seen: set[tuple[int, int]] = set()  # pieces, by length and checksum
        self._left_of_different = max(2 * self.most_of_piece, limits.all_times * packed)
        self._left_of_messages = max(limits.messages, BAG_MESSAGES_A_BYTE * packed)
        self._left_of_records = limits.dense_records
        self._left_of_steps = max(limits.database_steps, BAG_DATABASE_STEPS_A_BYTE * packed)

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
        key = len(data), zlib.crc32(data)
        different = self._left_of_different if key not in self._seen else self._left
        most, total, rest = min(self.most_of_piece, self._left, different), 0, data
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
                    f"bytes; a piece may become {self.most_of_piece}, and all that is read of this bag "
                    f"{min(self._left, different)} more"
                )
            if not unpacker.eof:
                raise EOFError("a packed piece is cut short")
            rest = unpacker.unused_data or b""
        self._left -= total
        self._left_of_different -= 0 if key in self._seen else total
        self._seen.add(key)
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)

    def take_message(self) -> None:
        """Count a message that is read.

        Raises:
            BadInput: if there were too many for the size of the bag.
        """
        self._left_of_messages -= 1
        if self._left_of_messages < 0:
            raise BadInput(
                f"{str(self._path)!r} has more messages than are read: {self._limits.messages}, or "
                f"{BAG_MESSAGES_A_BYTE} for each of its {self._size} bytes"
            )

    def take_records(self, unpacked: bytes, packed: int) -> None:
        """Count the records of an MCAP chunk that became far larger than it was.

        Raises:
            BadInput: if there were too many.
        """
        at, end = 0, len(unpacked) - 8 if len(unpacked) > self._limits.all_times * packed else 0
        while at < end:
            at += 9 + _LENGTH.unpack_from(unpacked, at + 1)[0]
            self._left_of_records -= 1
        if self._left_of_records < 0:
            raise BadInput(
                f"{str(self._path)!r} has more than {self._limits.dense_records} records in packed pieces that become "
                f"more than {self._limits.all_times} times larger"
            )

    def take_steps(self) -> bool:
        """Count `STEPS_AT_ONCE` steps of a database.

        Raises:
            BadInput: if there were too many for its size.
        """
        self._left_of_steps -= STEPS_AT_ONCE
        if self._left_of_steps < 0:
            raise BadInput(f"the database {str(self._path)!r} makes up more rows than its {self._size} bytes can have")
        return False

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

    def __init__(self, file: BinaryIO, mode: Any) -> None:
        self._file = zstd.open(file, mode)

    def __enter__(self) -> _CountedFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        _current().take_of_file(len(data))
        return data


def most_of_piece() -> int:
    """Return how large a piece of the bag that is read may become, bytes."""
    return _current().most_of_piece


def count_records(unpacked: bytes, packed: int) -> None:
    """Count the records of an unpacked MCAP chunk of the bag that is read, as `Unpacking.take_records`."""
    _current().take_records(unpacked, packed)


def _unpacker(start: Callable[[], Any]) -> Callable[..., bytes]:
    def unpacked(data: bytes, *_: int) -> bytes:
        return _current().piece(start, data)

    return unpacked


def _chunk_unpacker(start: Callable[[], Any]) -> Callable[..., bytes]:
    def unpacked(data: bytes, *_: int) -> bytes:
        chunk = _current().piece(start, data)
        count_records(chunk, len(data))
        return chunk

    return unpacked


def _limit_database(database: apsw.Connection) -> None:
    """Limit a database that is opened while a bag is: its tables can make up rows and data without an end."""
    if (unpacking := _CURRENT.get()) is not None:
        database.set_progress_handler(unpacking.take_steps, STEPS_AT_ONCE)
        database.limit(apsw.SQLITE_LIMIT_LENGTH, unpacking.most_of_piece)


ros1.decompressors.update({"bz2": _unpacker(bz2.BZ2Decompressor), "lz4": _unpacker(LZ4FrameDecompressor)})
mcap.DECOMPRESSORS.update(
    {"lz4": _chunk_unpacker(LZ4FrameDecompressor), "zstd": _chunk_unpacker(zstd.ZstdDecompressor)}
)
replaced: Any = ros2  # its module of zstd is not meant to be replaced
replaced.zstd = SimpleNamespace(open=_CountedFile, decompress=_unpacker(zstd.ZstdDecompressor))
apsw.connection_hooks.append(_limit_database)

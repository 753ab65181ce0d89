"""Show a bag that was cut short, or never closed, as the whole file that it would be without its last pieces.

A ROS 1 bag and an MCAP file end with an index; a recorder that dies does not write it, and a copy that stops loses it.
Every whole piece before the cut is kept. The file itself is not changed: the library reads it through a view with
another end, or with another beginning: an MCAP file with the profile of ROS 1 has the same records as one of ROS 2.
"""

from __future__ import annotations

import bz2
import io
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from lz4.frame import LZ4FrameDecompressor
from rosbags.rosbag1 import reader as ros1
from rosbags.interfaces import MessageDefinition
from rosbags.rosbag1.reader import Header, ReaderError, RecordType
from rosbags.rosbag2 import storage_mcap as mcap

from agent.recordings.decompression import zstd
from structdiffusion.limits import BAG_PIECE_BYTES

_MAGIC_OF_MCAP = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _CHUNK, _DATA_END = 0x01, 0x02, 0x06, 0x0F  # the opcodes of MCAP records that matter here
_BEFORE_PROFILE = 13  # bytes of the header's record before its profile: opcode, length, length of the profile
_ROS1, _ROS2 = b"ros1", b"ros2"
_UNPACKERS = {"bz2": bz2.BZ2Decompressor, "lz4": LZ4FrameDecompressor, "zstd": zstd.ZstdDecompressor}
_INDEX_RECORD = 12  # bytes: seconds, nanoseconds, offset


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

    def readinto(self, buffer: memoryview) -> int:
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


def as_ros2(path: Path) -> Path | RepairedFile:
    """Return an MCAP file with the profile of ROS 2; one with the profile of ROS 1 is shown with the other name."""
    head = _head_of_ros2(path)
    return RepairedFile(path, head, path.stat().st_size, b"") if head else path


def _head_of_ros2(path: Path) -> bytes:
    """Return the beginning of an MCAP file of ROS 1 with the name of ROS 2; empty for any other file."""
    with path.open("rb") as file:
        head = file.read(len(_MAGIC_OF_MCAP) + _BEFORE_PROFILE + len(_ROS1))
    return head[: -len(_ROS1)] + _ROS2 if head.endswith(struct.pack("<L", len(_ROS1)) + _ROS1) else b""


def repaired_mcap(path: Path) -> RepairedFile:
    """Return an MCAP file up to its last whole record, with an end that has no summary.

    Of a chunk that was cut, the whole records follow by themselves.

    Raises:
        NothingWhole: when nothing is left.
    """
    size, kept, rest = path.stat().st_size, 0, b""
    with path.open("rb") as file:
        if file.read(len(_MAGIC_OF_MCAP)) != _MAGIC_OF_MCAP:
            raise NothingWhole
        position = len(_MAGIC_OF_MCAP)
        while len(start := file.read(9)) == 9 and start[0] not in (_DATA_END, _FOOTER):
            end = position + 9 + struct.unpack("<Q", start[1:])[0]
            if end > size or (not kept and start[0] != _HEADER):
                if kept and start[0] == _CHUNK:
                    rest = _records_of_cut_chunk(file.read(BAG_PIECE_BYTES))
                break
            kept = position = file.seek(end)
    if not kept:
        raise NothingWhole
    data_end = struct.pack("<BQL", _DATA_END, 4, 0)
    footer = struct.pack("<BQQQL", _FOOTER, 20, 0, 0, 0)
    return RepairedFile(path, _head_of_ros2(path), kept, rest + data_end + footer + _MAGIC_OF_MCAP)


def _records_of_cut_chunk(data: bytes) -> bytes:
    """Return the whole records in the beginning of an MCAP chunk."""
    if len(data) < 32:
        return b""
    length = struct.unpack_from("<L", data, 28)[0]
    start = 32 + length + 8
    content = _unpacked_beginning(data[32 : 32 + length].decode("latin-1"), data[start:])
    end = 0
    while end + 9 <= len(content):
        following = end + 9 + struct.unpack_from("<Q", content, end + 1)[0]
        if following > len(content):
            break
        end = following
    return content[:end]


def _unpacked_beginning(compression: str, data: bytes) -> bytes:
    """Unpack what can be unpacked of a piece that was cut; nothing where the compression is not known."""
    if compression in ("", "none"):
        return data
    if compression not in _UNPACKERS:
        return b""
    try:
        return _UNPACKERS[compression]().decompress(data, max_length=BAG_PIECE_BYTES)
    except Exception:  # the libraries promise no kind of error for damaged data
        return b""


@dataclass(frozen=True)
class _Chunk:
    """A chunk of a ROS 1 bag.

    Attributes:
        position: where its record begins.
        counts: connection -> how many messages it has.
        first, last: when they were recorded: (2,) seconds and nanoseconds.
    """

    position: int
    counts: dict[int, int]
    first: tuple[int, int]
    last: tuple[int, int]


def repaired_ros1(path: Path) -> RepairedFile:
    """Return a ROS 1 bag up to its last whole chunk, with the index that it lacks.

    Of a chunk that was cut, the whole messages make a chunk of their own.

    Raises:
        NothingWhole: when no message is whole.
    """
    with path.open("rb") as file:
        begin = len(file.readline())
        try:
            fields = Header.read(file, RecordType.BAGHEADER)
            head_end = file.tell()
            file.seek(ros1.read_uint32(file), os.SEEK_CUR)
            chunks, kept = _whole_chunks(file, path.stat().st_size)
            records = _connection_records(file, chunks)
            rest = _content_of_cut_chunk(file, kept)
        except (ReaderError, ValueError) as error:
            raise NothingWhole from error
        file.seek(0)
        head = file.read(begin)
    more, last = _rebuilt_chunk(rest, kept, records)
    chunks = [chunk for chunk in (*chunks, *last) if set(chunk.counts) <= set(records)]
    if not chunks:
        raise NothingWhole
    fields["index_pos"] = struct.pack("<Q", kept + len(more))
    fields["conn_count"] = struct.pack("<L", len(records))
    fields["chunk_count"] = struct.pack("<L", len(chunks))
    head += _packed_header(fields)
    if len(head) != head_end:
        raise NothingWhole
    return RepairedFile(path, head, kept, b"".join((more, *records.values(), *map(_chunk_info, chunks))))


def _whole_chunks(file: BinaryIO, size: int) -> tuple[list[_Chunk], int]:
    """Return the chunks from the position of `file` on that are whole with their index records, and where they end."""
    chunks: list[_Chunk] = []
    position = file.tell()
    try:
        while position < size:
            Header.read(file, RecordType.CHUNK)
            file.seek(ros1.read_uint32(file), os.SEEK_CUR)
            counts: dict[int, int] = {}
            times: list[np.ndarray] = []
            end = file.tell()
            while end < size and (header := Header.read(file)).get_uint8("op") == RecordType.IDXDATA:
                length = ros1.read_uint32(file)
                if length > size - file.tell():
                    return chunks, position
                entries = np.frombuffer(ros1.read_bytes(file, length), "<u4").reshape(-1, _INDEX_RECORD // 4)
                counts[header.get_uint32("conn")] = len(entries)
                times.append(entries[:, :2])
                end = file.tell()
            if end > size or not counts:
                break
            chunks.append(_Chunk(position, counts, *_first_and_last(np.concatenate(times))))
            position = file.seek(end)
    except (ReaderError, ValueError, OverflowError):
        pass  # the cut
    return chunks, position


def _first_and_last(times: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the earliest and the latest of times (N, 2), seconds and nanoseconds."""
    order = np.lexsort((times[:, 1], times[:, 0]))
    first, last = times[order[0]].tolist(), times[order[-1]].tolist()
    return (first[0], first[1]), (last[0], last[1])


def _connection_records(file: BinaryIO, chunks: list[_Chunk]) -> dict[int, bytes]:
    """Return the record of each connection; it stands in the first chunk that has a message of it."""
    found: dict[int, bytes] = {}
    for chunk in chunks:
        if set(chunk.counts) <= set(found):
            continue
        file.seek(chunk.position)
        unpack = ros1.decompressors.get(Header.read(file).get_string("compression"))
        if unpack is not None:
            content = unpack(ros1.read_bytes(file, ros1.read_uint32(file)))
            found |= {number: record for kind, number, record, _ in _records(content) if kind == RecordType.CONNECTION}
    return found


def _content_of_cut_chunk(file: BinaryIO, position: int) -> bytes:
    """Return what can be unpacked of the chunk at `position`; nothing where none begins there."""
    file.seek(position)
    try:
        compression = Header.read(file, RecordType.CHUNK).get_string("compression")
        size = ros1.read_uint32(file)
    except (ReaderError, ValueError):
        return b""
    return _unpacked_beginning(compression, file.read(min(size, BAG_PIECE_BYTES)))


def _rebuilt_chunk(content: bytes, position: int, records: dict[int, bytes]) -> tuple[bytes, list[_Chunk]]:
    """Return a chunk with the whole messages of `content` and their index, packed, and described for `position`.

    Args:
        content: the beginning of an unpacked chunk.
        position: where the packed chunk will be in the file.
        records: connection -> its record; those in `content` are added.
    """
    entries: dict[int, list[tuple[int, int, int]]] = {}
    end = 0
    for kind, number, record, (offset, seconds, nanoseconds) in _records(content):
        end = offset + len(record)
        if kind == RecordType.CONNECTION:
            records.setdefault(number, record)
        elif kind == RecordType.MSGDATA:
            entries.setdefault(number, []).append((seconds, nanoseconds, offset))
    if not entries:
        return b"", []
    packed = [_record({"op": _byte(RecordType.CHUNK), "compression": b"none", "size": _number(end)}, content[:end])]
    for number, those in entries.items():
        header = {
            "op": _byte(RecordType.IDXDATA), "ver": _number(1), "conn": _number(number), "count": _number(len(those))
        }  # fmt: skip
        packed.append(_record(header, np.array(those, "<u4").tobytes()))
    times = np.array([entry[:2] for those in entries.values() for entry in those])
    counts = {number: len(those) for number, those in entries.items()}
    return b"".join(packed), [_Chunk(position, counts, *_first_and_last(times))]


def _records(content: bytes) -> Iterator[tuple[int, int, bytes, tuple[int, int, int]]]:
    """Yield the whole records of an unpacked chunk: kind, connection, its bytes, and offset and time (s, ns)."""
    source = io.BytesIO(content)
    try:
        while (start := source.tell()) < len(content):
            header = Header.read(source)
            end = source.seek(ros1.read_uint32(source), os.SEEK_CUR)
            if end > len(content):
                return
            seconds, nanoseconds = divmod(header.get_time("time"), 10**9) if "time" in header else (0, 0)
            kind, number = header.get_uint8("op"), header.get_uint32("conn")
            yield kind, number, content[start:end], (start, seconds, nanoseconds)
    except (ReaderError, ValueError):
        return  # the cut


def _chunk_info(chunk: _Chunk) -> bytes:
    """Return the record that the index of a bag has for a chunk."""
    header = {
        "op": _byte(RecordType.CHUNK_INFO),
        "ver": _number(1),
        "chunk_pos": struct.pack("<Q", chunk.position),
        "start_time": struct.pack("<LL", *chunk.first),
        "end_time": struct.pack("<LL", *chunk.last),
        "count": _number(len(chunk.counts)),
    }
    return _record(header, b"".join(struct.pack("<LL", *each) for each in chunk.counts.items()))


def _record(header: dict[str, bytes], data: bytes) -> bytes:
    return _packed_header(header) + _number(len(data)) + data


def _byte(value: int) -> bytes:
    return struct.pack("<B", value)


def _number(value: int) -> bytes:
    return struct.pack("<L", value)


def _packed_header(fields: dict[str, bytes]) -> bytes:
    """Pack the header of a ROS 1 record."""
    packed = b"".join(
        struct.pack("<L", len(name) + 1 + len(value)) + name.encode() + b"=" + value for name, value in fields.items()
    )
    return struct.pack("<L", len(packed)) + packed


def _definition(schema: mcap.Schema | None) -> MessageDefinition:
    """Return the definition of a channel's messages; one in a language that the library does not know is left out.

    Nothing is decoded by it, and other channels of the file can be read all the same.
    """
    if schema is not None and schema.encoding not in ("ros2msg", "ros2idl", "omgidl"):
        schema = None
    return _definition_of_ros2(schema)


_definition_of_ros2 = mcap.get_msgdef
mcap.get_msgdef = _definition  # where the library looks it up

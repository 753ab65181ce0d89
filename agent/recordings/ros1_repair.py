"""Read ROS 1 bags that were cut short or never closed.

A bag ends with an index; a recorder that dies does not write it, and a copy that stops loses it. Every whole chunk
before the cut is kept, and so are the whole messages of the chunk that was cut.
"""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from rosbags.rosbag1 import reader as ros1
from rosbags.rosbag1.reader import Header, ReaderError, RecordType

from agent.recordings.decompression import most_of_piece
from agent.recordings.file_view import NothingWhole, RepairedFile, unpacked_beginning

_INDEX_RECORD = 12  # bytes: seconds, nanoseconds, offset


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
    return unpacked_beginning(compression, file.read(min(size, most_of_piece())))


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

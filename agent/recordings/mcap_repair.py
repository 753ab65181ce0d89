"""Read MCAP files that were cut short or never closed, and those with the profile of ROS 1.

An MCAP file ends with an index; a recorder that dies does not write it, and a copy that stops loses it. Every whole
record before the cut is kept. A file with the profile of ROS 1 has the same records as one of ROS 2.
"""

from __future__ import annotations

import struct
from pathlib import Path

from rosbags.interfaces import MessageDefinition
from rosbags.rosbag2 import storage_mcap as mcap

from agent.recordings.decompression import count_records, most_of_piece
from agent.recordings.file_view import NothingWhole, RepairedFile, unpacked_beginning

_MAGIC_OF_MCAP = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _CHUNK, _DATA_END = 0x01, 0x02, 0x06, 0x0F  # the opcodes of MCAP records that matter here
_BEFORE_PROFILE = 13  # bytes of the header's record before its profile: opcode, length, length of the profile
_ROS1, _ROS2 = b"ros1", b"ros2"


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
                    rest = _records_of_cut_chunk(file.read(most_of_piece()))
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
    content = unpacked_beginning(data[32 : 32 + length].decode("latin-1"), data[start:])
    count_records(content, len(data))
    end = 0
    while end + 9 <= len(content):
        following = end + 9 + struct.unpack_from("<Q", content, end + 1)[0]
        if following > len(content):
            break
        end = following
    return content[:end]


def _definition(schema: mcap.Schema | None) -> MessageDefinition:
    """Return the definition of a channel's messages; one in a language that the library does not know is left out.

    Nothing is decoded by it, and other channels of the file can be read all the same.
    """
    if schema is not None and schema.encoding not in ("ros2msg", "ros2idl", "omgidl"):
        schema = None
    return _definition_of_ros2(schema)


_definition_of_ros2 = mcap.get_msgdef
mcap.get_msgdef = _definition  # where the library looks it up

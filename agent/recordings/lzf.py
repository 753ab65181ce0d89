"""Unpack LZF, the code of compressed .pcd clouds.

Packed data are a chain of pieces. A piece whose first byte is below 32 holds that many bytes and one more; any other
says how long a stretch of what is unpacked already is repeated, and how far back it begins.
"""

from __future__ import annotations

from agent.errors import BadInput

MOST_TIMES = 88  # its size that LZF can unpack to: three bytes stand for at most 264


def unpack_lzf(data: bytes, size: int) -> bytes:
    """Return the `size` bytes that `data` stands for.

    Raises:
        BadInput: if it is damaged, or stands for fewer or more bytes.
    """
    unpacked = bytearray()
    at, end = 0, len(data)
    try:
        while at < end and len(unpacked) <= size:
            first = data[at]
            at += 1
            if first < 32:
                unpacked += data[at : at + first + 1]
                at += first + 1
                continue
            length = first >> 5
            if length == 7:
                length += data[at]
                at += 1
            length += 2
            back = ((first & 31) << 8 | data[at]) + 1
            at += 1
            start = len(unpacked) - back
            if start < 0:
                raise BadInput("packed points are damaged: they repeat what is before their beginning")
            stretch = unpacked[start : start + length]
            unpacked += stretch if back >= length else (stretch * (length // back + 1))[:length]
    except IndexError as error:
        raise BadInput("packed points are cut short") from error
    if at > end or len(unpacked) != size:
        there = f"more than {size}" if len(unpacked) > size else str(len(unpacked))
        raise BadInput(f"packed points are damaged: they unpack to {there} bytes in place of {size}")
    return bytes(unpacked)

"""Read .pcd clouds in all three encodings."""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import BinaryIO

from agent.errors import BadInput
from agent.recordings.cloud_rows import (
    Columns,
    Field,
    binary_columns,
    check_fields,
    check_length,
    columns_one_after_another,
    filled_lines,
    stride,
    text_columns,
    whole_number,
)
from agent.recordings.lzf import MOST_TIMES, unpack_lzf
from agent.recordings.sizes import check_points
from structdiffusion.limits import CLOUD_UNPACKED_BYTES

_HEADER_BYTES = 65_536
_KINDS = {(kind, size): f"{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)} | {
    ("F", 4): "f4",
    ("F", 8): "f8",
}
_PADDING = "_"
_SIZES = "<II"  # of compressed points: bytes as they are, and as they become


def read_pcd(path: Path, wanted: Collection[str], needed: Sequence[str]) -> tuple[int, int, Columns]:
    """Read the rows and columns of a .pcd cloud, and the wanted fields of its points.

    Args:
        path: of a file.
        wanted: names in lower case; fields of other names, repeated fields and padding are skipped.
        needed: those of them that must be there.

    Raises:
        BadInput: for a file that is damaged, or contradicts itself; the message does not name it.
    """
    with path.open("rb") as file:
        said = _header(file)
        fields = _fields(said)
        check_fields(fields, needed)
        height, width = _shape(said)
        count, each = height * width, stride(fields)
        left = os.fstat(file.fileno()).st_size - file.tell()
        kind = " ".join(said["DATA"])
        if kind == "ascii":
            check_length(count, 2 * sum(field.count for field in fields) * count - 1, left)
            return height, width, text_columns(filled_lines(file), fields, count, wanted)
        if kind == "binary":
            check_length(count, each * count, left)
            return height, width, binary_columns(file, fields, "<", count, wanted)
        if kind == "binary_compressed":
            return height, width, _packed_columns(file, fields, count, wanted)
    raise BadInput(f"it has data {kind!r}; legal: ascii, binary, binary_compressed")


def _header(file: BinaryIO) -> dict[str, list[str]]:
    """Return the words of each line of the header by the first, and leave the file behind it."""
    said: dict[str, list[str]] = {}
    while file.tell() < _HEADER_BYTES and (line := file.readline(_HEADER_BYTES)):
        words = line.decode("latin-1").split()
        if words and words[0].isupper() and words[0].isalpha():
            said.setdefault(words[0], words[1:])
        if "DATA" in said:
            return said
    raise BadInput(f"it is not a .pcd cloud: its first {_HEADER_BYTES} bytes have no line DATA")


def _fields(said: dict[str, list[str]]) -> list[Field]:
    """Return the fields of a point."""
    names = said.get("FIELDS", said.get("COLUMNS", []))
    ones = ["1"] * len(names)
    sizes, kinds, counts = said.get("SIZE", []), said.get("TYPE", []), said.get("COUNT", ones)
    for key, words in (("SIZE", sizes), ("TYPE", kinds), ("COUNT", counts)):
        if len(words) != len(names):
            raise BadInput(f"its header is damaged: {key} has {len(words)} entries for {len(names)} fields")
    fields = []
    for name, size, kind, count in zip(names, sizes, kinds, counts, strict=True):
        usable = None if name == _PADDING else _KINDS.get((kind, whole_number("SIZE", size)))
        fields.append(Field(name.lower(), usable, whole_number("SIZE", size), whole_number("COUNT", count)))
    return fields


def _shape(said: dict[str, list[str]]) -> tuple[int, int]:
    """Return the rows and columns."""
    words = {key: said[key] for key in ("WIDTH", "HEIGHT", "POINTS") if key in said}
    if any(len(entries) != 1 for entries in words.values()) or not {"WIDTH", "POINTS"} & words.keys():
        raise BadInput("its header is damaged: it needs WIDTH, HEIGHT and POINTS with one number each")
    numbers = {key: whole_number(key, entries[0]) for key, entries in words.items()}
    height = numbers.get("HEIGHT", 1)
    width = numbers.get("WIDTH", numbers.get("POINTS", 0))
    if (points := numbers.get("POINTS", height * width)) != height * width:
        raise BadInput(f"it claims {points} points in {width} x {height} places")
    check_points(height * width)
    return height, width


def _packed_columns(file: BinaryIO, fields: list[Field], count: int, wanted: Collection[str]) -> Columns:
    """Read `count` compressed points from where the file stands."""
    packed = file.read(struct.calcsize(_SIZES))
    if len(packed) < struct.calcsize(_SIZES):
        raise BadInput("it is cut short: the sizes of its packed points are not there")
    compressed, unpacked = struct.unpack(_SIZES, packed)
    each = stride(fields)
    if unpacked != each * count:  # most writers leave the padding out
        fields = [field for field in fields if field.name != _PADDING]
    if unpacked != stride(fields) * count:
        raise BadInput(
            f"it is damaged: it says that it unpacks to {unpacked} bytes, but {count} points have {each * count}"
        )
    check_length(count, compressed, os.fstat(file.fileno()).st_size - file.tell())
    if unpacked > (most := min(CLOUD_UNPACKED_BYTES, MOST_TIMES * compressed)):
        raise BadInput(f"it claims that {compressed} bytes unpack to {unpacked}; at most {most} are read")
    return columns_one_after_another(unpack_lzf(file.read(compressed), unpacked), fields, count, wanted)

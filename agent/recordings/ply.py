"""Read the points of .ply files, as text and in both binary orders; faces and other elements are skipped."""

from __future__ import annotations

import io
import itertools
import os
import re
import struct
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from agent.errors import BadInput
from agent.recordings.cloud_rows import (
    Columns,
    Field,
    binary_columns,
    check_fields,
    check_length,
    filled_lines,
    text_columns,
    whole_number,
)
from agent.recordings.sizes import check_points
from structdiffusion.limits import CLOUD_UNPACKED_BYTES

_HEADER_BYTES = 65_536
_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q"}  # of `struct`


@dataclass(frozen=True)
class _Property(Field):
    """A value, or a list of them, whose `length` is the kind of the number before them."""

    length: str = ""


@dataclass
class _Element:
    """What a file has several of, such as vertices: their name, their number, and what each of them has."""

    name: str
    count: int
    properties: list[_Property]

    @property
    def single(self) -> list[_Property]:
        """Return the properties that are no lists."""
        return [one for one in self.properties if not one.length]


def read_ply(path: Path, wanted: Collection[str], needed: Sequence[str]) -> tuple[int, int, Columns]:
    """Read one row, its columns, and the wanted properties of the vertices of a .ply file.

    Args:
        path: of a file.
        wanted: names in lower case; the rest, repeated names and lists are skipped.
        needed: those of them that must be there.

    Raises:
        BadInput: for a file that is damaged, or contradicts itself; the message does not name it.
    """
    with path.open("rb") as file:
        order, ending, elements = _header(file)
        before = list(itertools.takewhile(lambda element: element.name != "vertex", elements))
        if len(before) == len(elements):
            raise BadInput("it has no vertices")
        vertex = elements[len(before)]
        check_fields(vertex.single, needed)
        check_points(vertex.count)
        least = sum(_least_bytes(element, order) for element in (*before, vertex))
        check_length(vertex.count, least, os.fstat(file.fileno()).st_size - file.tell())
        if order:
            return 1, vertex.count, _binary_vertices(file, order, before, vertex, wanted)
        lines = filled_lines(file.read().split(b"\r") if ending == b"\r" else file)
        for element in before:
            for _ in itertools.islice(lines, element.count if element.properties else 0):
                pass
        rows = lines if len(vertex.single) == len(vertex.properties) else _without_lists(lines, vertex.properties)
        return 1, vertex.count, text_columns(rows, vertex.single, vertex.count, wanted)


def _header(file: BinaryIO) -> tuple[str, bytes, list[_Element]]:
    """Return the order of bytes ("" for text), how lines end, and the elements; leave the file behind the header."""
    head = file.read(_HEADER_BYTES)
    first = re.match(rb"ply[ \t]*(\r?\n|\r)", head)
    if first is None:
        raise BadInput("it is not a .ply cloud: it does not begin with the line ply")
    separator = first[1][-1:]
    at, kind, elements = first.end(), None, []
    while (end := head.find(separator, at)) >= 0 or head[at:].strip() == b"end_header":
        line = head[at : end if end >= 0 else None].decode("latin-1").strip()
        at = end + 1 if end >= 0 else len(head)
        words = line.split()
        if words == ["end_header"]:
            break
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, _]:
                kind = name
            case ["element", name, count]:
                elements.append(_Element(name, whole_number("element", count), []))
            case ["property", of, name] if elements:
                elements[-1].properties.append(_property(name, of))
            case ["property", "list", length, of, name] if elements:
                elements[-1].properties.append(_property(name, of, length))
            case _:
                raise BadInput(f"its header is damaged: it has the line {line[:80]!r}")
    else:
        raise BadInput(f"it is not a .ply cloud: its first {_HEADER_BYTES} bytes have no line end_header")
    if kind not in _ORDERS:
        raise BadInput(f"its header names the format {kind!r}; legal: {', '.join(_ORDERS)}")
    file.seek(at)
    return _ORDERS[kind], first[1], elements


def _property(name: str, of: str, length: str = "") -> _Property:
    for kind in (of, length or of):
        if kind not in _KINDS:
            raise BadInput(f"its header gives {name!r} the type {kind!r}; legal: {', '.join(_KINDS)}")
    if length and _KINDS[length] not in _LETTERS:
        raise BadInput(f"its header counts the list {name!r} in {length!r}, which is not a whole number")
    return _Property(name.lower(), _KINDS[of], int(_KINDS[of][1:]), 1, _KINDS[length] if length else "")


def _least_bytes(element: _Element, order: str) -> int:
    """Return the fewest bytes that an element can have; as text a digit and a space for each value."""
    each = sum(int(one.length[1:]) if one.length else one.size for one in element.properties)
    return element.count * (each if order else 2 * len(element.properties)) - (not order)


def _binary_vertices(
    file: BinaryIO, order: str, before: Sequence[_Element], vertex: _Element, wanted: Collection[str]
) -> Columns:
    """Read the vertices, behind the other elements, from where the file stands."""
    if all(len(element.single) == len(element.properties) for element in (*before, vertex)):
        skipped = sum(element.count * sum(one.size for one in element.properties) for element in before)
        file.seek(skipped, os.SEEK_CUR)
        return binary_columns(file, vertex.single, order, vertex.count, wanted)
    data = file.read(CLOUD_UNPACKED_BYTES + 1)
    if len(data) > CLOUD_UNPACKED_BYTES:
        raise BadInput(f"it has more than {CLOUD_UNPACKED_BYTES} bytes and lists before its points")
    at, rows = 0, b""
    for element in (*before, vertex):
        rows, at = _single_values(data, at, element, order)
    return binary_columns(io.BytesIO(rows), vertex.single, order, vertex.count, wanted)


def _single_values(data: bytes, start: int, element: _Element, order: str) -> tuple[bytes, int]:
    """Return the bytes of an element from `start` on without its lists, and where it ends.

    Raises:
        BadInput: when the data end before.
    """
    try:
        if element.count == 0:
            return b"", start
        spans, lengths, end = _row(data, start, element, order)
        width = end - start
        if start + element.count * width <= len(data):  # most files have lists of one length
            rows = np.frombuffer(data, np.uint8, element.count * width, start).reshape(element.count, width)
            if all((rows[:, a - start : b - start] == rows[0, a - start : b - start]).all() for a, b in lengths):
                kept = [place - start for a, b in spans for place in range(a, b)]
                return rows[:, kept].tobytes(), start + element.count * width
        pieces, at = [], start
        for _ in range(element.count):
            spans, _, at = _row(data, at, element, order)
            pieces += [data[a:b] for a, b in spans]
    except struct.error as error:
        raise BadInput(f"it is cut short: of {element.count} of its {element.name} some are not there") from error
    return b"".join(pieces), at


def _row(
    data: bytes, at: int, element: _Element, order: str
) -> tuple[list[tuple[int, int]], list[tuple[int, int]], int]:
    """Return where the single values and the lengths of lists of one row stand, and where the row ends."""
    spans, lengths = [], []
    for one in element.properties:
        if one.length:
            size = int(one.length[1:])
            (count,) = struct.unpack_from(order + _LETTERS[one.length], data, at)
            if count < 0:
                raise BadInput(f"it is damaged: a list of its {element.name} has {count} entries")
            lengths.append((at, at + size))
            at += size + count * one.size
        else:
            spans.append((at, at + one.size))
            at += one.size
    if at > len(data):
        raise struct.error
    return spans, lengths, at


def _without_lists(lines: Iterable[bytes], properties: Sequence[_Property]) -> Iterator[bytes]:
    """Yield lines without the values of their lists."""
    for number, line in enumerate(lines, 1):
        words, kept, at = line.split(), [], 0
        try:
            for one in properties:
                if one.length:
                    at += 1 + whole_number("a list", words[at].decode("latin-1"))
                else:
                    kept.append(words[at])
                    at += 1
        except IndexError as error:
            raise BadInput(f"its point {number} has {len(words)} values, which are too few") from error
        yield b" ".join((*kept, *words[at:]))

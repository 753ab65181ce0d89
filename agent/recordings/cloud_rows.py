"""Read the points of a cloud file, binary or as text, once its header has said which values each point has."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from agent.errors import BadInput

_AT_ONCE = 50_000_000  # bytes of points that are in memory beside the values that are taken out of them
_LINES_AT_ONCE = 20_000
_MOST_BYTES = 100_000  # of one point: the longest descriptors of point libraries have 3,000

Columns = dict[str, np.ndarray]
"""Name -> (P,), or (P, K) for a field of K values. Of text they are float64 where they do not fit their kind."""


@dataclass(frozen=True)
class Field:
    """A value, or several alike, of each point.

    Attributes:
        name: in lower case.
        kind: such as "f4", without the order of its bytes; `None` for values that cannot be used.
        size: bytes of one value.
        count: how many values.
    """

    name: str
    kind: str | None
    size: int
    count: int = 1


def whole_number(key: str, word: str) -> int:
    """Return the number that a header gives.

    Raises:
        BadInput: if it is none.
    """
    if not (word.isascii() and word.isdigit() and len(word) < 19):
        raise BadInput(f"it is damaged: {key} has {word[:20]!r} where a whole number belongs")
    return int(word)


def check_length(count: int, needed: int, left: int) -> None:
    """Refuse a file that has fewer bytes after its header than its points need at least.

    Raises:
        BadInput: if so.
    """
    if needed > left:
        raise BadInput(
            f"it is cut short: it claims {count} points, which need {needed} bytes after the header, and has {left}"
        )


def check_fields(fields: Sequence[Field], needed: Sequence[str]) -> None:
    """Refuse points that lack a needed value, or have it more than once.

    Raises:
        BadInput: if so.
    """
    usable = {field.name: field for _, field in chosen(fields, needed)}
    listed = f"field {needed[0]!r}" if len(needed) == 1 else f"{', '.join(needed[:-1])} and {needed[-1]}"
    for field in fields:
        if field.kind is None and field.name in needed and field.name not in usable:
            raise BadInput(
                f"its field {field.name!r} has values of {field.size} bytes of a type that is not read; legal: whole "
                "numbers of 1, 2, 4 or 8 bytes, floating-point numbers of 4 or 8"
            )
    if set(usable) != set(needed):
        names = ", ".join(field.name for field in fields[:20]) + (", ..." if len(fields) > 20 else "")
        raise BadInput(f"it has no {listed}; its fields are: {names[:300] or 'none'}")
    for name, field in usable.items():
        if field.count != 1:
            raise BadInput(f"its field {name!r} has {field.count} values a point; legal: 1")


def stride(fields: Sequence[Field]) -> int:
    """Return the bytes of one point.

    Raises:
        BadInput: for more than any point has.
    """
    size = sum(field.size * field.count for field in fields)
    if size > _MOST_BYTES:
        raise BadInput(f"each point has {size} bytes; at most {_MOST_BYTES} are read")
    return size


def chosen(fields: Sequence[Field], wanted: Collection[str]) -> list[tuple[int, Field]]:
    """Return the place and the field of each wanted name; of several of one name, the first."""
    found: dict[str, tuple[int, Field]] = {}
    for place, field in enumerate(fields):
        if field.name in wanted and field.kind is not None and field.count > 0:
            found.setdefault(field.name, (place, field))
    return list(found.values())


def binary_columns(file: BinaryIO, fields: Sequence[Field], order: str, count: int, wanted: Collection[str]) -> Columns:
    """Read `count` binary points from where the file stands.

    Args:
        order: "<" or ">".

    Raises:
        BadInput: when the file ends before.
    """
    size, taken = stride(fields), chosen(fields, wanted)
    offsets = list(itertools.accumulate((field.size * field.count for field in fields), initial=0))
    layout = np.dtype(
        {
            "names": [field.name for _, field in taken],
            "formats": [_shaped(field, order) for _, field in taken],
            "offsets": [offsets[place] for place, _ in taken],
            "itemsize": size,
        }
    )
    columns = {name: np.empty((count, *layout[name].shape), layout[name].base) for name in layout.names or ()}
    at_once = max(1, _AT_ONCE // max(size, 1))
    for start in range(0, count, at_once):
        stop = min(count, start + at_once)
        data = file.read((stop - start) * size)
        if len(data) < (stop - start) * size:
            raise BadInput(f"it is cut short: of {count} points {start + len(data) // size} are there")
        points = np.frombuffer(data, layout)
        for name, column in columns.items():
            column[start:stop] = points[name]
    return columns


def _shaped(field: Field, order: str) -> tuple[str, tuple[int, ...]] | str:
    kind = f"{order}{field.kind}"
    return kind if field.count == 1 else (kind, (field.count,))


def columns_one_after_another(data: bytes, fields: Sequence[Field], count: int, wanted: Collection[str]) -> Columns:
    """Take the columns out of data that have the first field of all points first, then the second, and so on."""
    columns = {}
    offsets = list(itertools.accumulate((count * field.size * field.count for field in fields), initial=0))
    for place, field in chosen(fields, wanted):
        values = np.frombuffer(data, f"<{field.kind}", count * field.count, offsets[place])
        columns[field.name] = values if field.count == 1 else values.reshape(count, field.count)
    return columns


def filled_lines(file: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the lines that are not empty."""
    return (line for line in file if line.strip())


def text_columns(lines: Iterator[bytes], fields: Sequence[Field], count: int, wanted: Collection[str]) -> Columns:
    """Read `count` points, one a line.

    Raises:
        BadInput: when there are fewer, or a line has another number of values, or no numbers.
    """
    stride(fields)
    taken = chosen(fields, wanted)
    offsets = list(itertools.accumulate((field.count for field in fields), initial=0))
    places = [offsets[place] + k for place, field in taken for k in range(field.count)]
    values = np.empty((count, len(places)))
    for start in range(0, count, _LINES_AT_ONCE):
        some = list(itertools.islice(lines, min(_LINES_AT_ONCE, count - start)))
        if len(some) < min(_LINES_AT_ONCE, count - start):
            raise BadInput(f"it is cut short: of {count} points {start + len(some)} are there")
        values[start : start + len(some)] = _numbers(some, offsets[-1], places, start)
    columns, at = {}, 0
    for _, field in taken:
        column = values[:, at] if field.count == 1 else values[:, at : at + field.count]
        columns[field.name] = _as_declared(column, field)
        at += field.count
    return columns


def _as_declared(column: np.ndarray, field: Field) -> np.ndarray:
    """Return values with the kind that the header gives them, if it is of whole numbers and holds them."""
    if str(field.kind).startswith("f") or field.size == 8:
        return column
    legal = np.iinfo(str(field.kind))
    with np.errstate(invalid="ignore"):
        fits = ((column >= legal.min) & (column <= legal.max) & (np.floor(column) == column)).all()
    return column.astype(field.kind) if fits else column


def _numbers(lines: list[bytes], columns: int, places: Sequence[int], before: int) -> np.ndarray:
    """Return the values (L, K) at the `places` of lines that have `columns` values each."""
    rows = [line.split() for line in lines]
    for number, row in enumerate(rows, before + 1):
        if len(row) != columns:
            raise BadInput(f"its point {number} has {len(row)} values in place of {columns}")
    words = [row[place] for row in rows for place in places]
    try:
        numbers = np.fromiter(map(float, words), np.float64, len(words))
    except ValueError as error:
        place, word = next((k, word) for k, word in enumerate(words) if not _is_number(word))
        comma = "; write decimals with a point" if b"," in word else ""
        raise BadInput(
            f"its point {before + 1 + place // len(places)} has {word[:20].decode('latin-1')!r} where a number belongs"
            f"{comma}"
        ) from error
    return numbers.reshape(len(rows), len(places))


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True

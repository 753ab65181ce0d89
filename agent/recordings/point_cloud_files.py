"""Read clouds from .ply and .pcd files, whose headers are checked before they are used."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.recordings.decimal_commas import check_ascii_cloud
from agent.recordings.depth_units import in_metres
from agent.recordings.message_decoding import without_nothing
from agent.recordings.point_count import MOST_READ

SUFFIXES = (".ply", ".pcd")
_HEADER_BYTES = 65_536
_PLY_BYTES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2, "int": 4, "uint": 4,
    "int32": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8,
}  # fmt: skip


@dataclass(frozen=True)
class _Header:
    """The header of a cloud file.

    Attributes:
        height, width: rows and columns of its points.
        needed: the least size of the whole file, bytes.
        lines: the number of text lines with points after the header; 0 for binary points.
        length: the length of the header, bytes.
    """

    height: int
    width: int
    needed: int
    lines: int
    length: int


def read_cloud(
    path: Path, unit: float | None = None
) -> tuple[np.ndarray, np.ndarray | None, tuple[str, ...]]:
    """Read points (H, W, 3) float32, metres, colours (H, W, 3) uint8 or `None`, and assumptions, a sentence each.

    An organised .pcd keeps its rows and columns; any other cloud is one row.

    Args:
        path: the file.
        unit: metres per unit of its coordinates; by default metres, unless what is seen contradicts that.

    Raises:
        BadInput: for a file that is not there, damaged, empty, or without coordinates, or whose unit is not certain.
    """
    if not path.is_file():
        raise BadInput(f"there is no cloud {str(path)!r}")
    check_ascii_cloud(path)
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
    header = _pcd_header(path, head) if path.suffix.lower() == ".pcd" else _ply_header(path, head)
    count = header.height * header.width
    if count == 0:
        raise BadInput(f"the cloud {str(path)!r} is empty")
    if count > MOST_READ:
        raise BadInput(
            f"the cloud {str(path)!r} claims {count} points; at most {MOST_READ} are read: thin it, for example to one "
            "point in each cube of 2 mm"
        )
    if header.needed > size:
        raise BadInput(
            f"the cloud {str(path)!r} is cut short: it claims {count} points, which need {header.needed} bytes, "
            f"and has {size}"
        )
    if header.lines and (lines := _lines_after(path, header.length)) < header.lines:
        raise BadInput(f"the cloud {str(path)!r} is damaged: of {count} points {lines} are there")
    points, colors = _read(path, count)
    points[~np.isfinite(points).all(axis=1)] = np.nan
    points, notes = in_metres(points, unit, f"the coordinates in {str(path)!r}")
    points = without_nothing(points)
    if not np.isfinite(points).any():
        raise BadInput(f"the cloud {str(path)!r} has no point that measures anything")
    shape = (header.height, header.width, 3)
    return points.reshape(shape), None if colors is None else colors.reshape(shape), notes


def _lines_after(path: Path, offset: int) -> int:
    """Count the non-empty lines after the first `offset` bytes."""
    with path.open("rb") as file:
        file.seek(offset)
        return sum(not line.isspace() for line in file)


def _read(path: Path, count: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Read points (P, 3) float32 and colours (P, 3) uint8 of a file whose header has been checked."""
    import open3d

    # The library reports errors only in its log, and gives what it has.
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        try:
            cloud = open3d.t.io.read_point_cloud(str(path))
        except (RuntimeError, ValueError) as error:  # the latter where its message is no text
            raise BadInput(f"the cloud {str(path)!r} is damaged") from error
    if "positions" not in cloud.point or len(cloud.point.positions) != count:
        there = len(cloud.point.positions) if "positions" in cloud.point else 0
        raise BadInput(f"the cloud {str(path)!r} is damaged: of {count} points {there} can be read")
    points = cloud.point.positions.numpy().astype(np.float32)
    if "colors" not in cloud.point:
        return points, None
    colors = cloud.point.colors.numpy()
    if colors.dtype.kind == "f":
        colors = np.rint(255 * np.clip(colors, 0.0, 1.0))
    return points, colors.astype(np.uint8)


def _pcd_header(path: Path, head: bytes) -> _Header:
    """Read the header of a .pcd file."""
    said: dict[str, list[str]] = {}
    length = 0
    for line in head.splitlines(keepends=True):
        length += len(line)
        words = line.decode("latin-1").split()
        if words and words[0].isupper() and words[0].isalpha():
            said[words[0]] = words[1:]
        if words[:1] == ["DATA"]:
            break
    else:
        raise BadInput(f"the file {str(path)!r} is not a .pcd cloud: it has no line DATA")
    fields, kind = said.get("FIELDS", []), "".join(said["DATA"])
    if not {"x", "y", "z"} <= set(fields):
        raise BadInput(f"the cloud {str(path)!r} has no x, y and z; its fields are: {', '.join(fields) or 'none'}")
    try:
        sizes = [int(word) for word in said["SIZE"]]
        counts = [int(word) for word in said.get("COUNT", ["1"] * len(fields))]
        (width,), (height,) = ([int(word) for word in said[key]] for key in ("WIDTH", "HEIGHT"))
        each = sum(size * count for size, count in zip(sizes, counts, strict=True))
        if len(fields) != len(sizes) or min(width, height) < 0 or each < 12:
            raise ValueError
    except (KeyError, ValueError) as error:
        raise BadInput(f"the header of the cloud {str(path)!r} is damaged") from error
    count = width * height
    if said.get("POINTS", [str(count)]) != [str(count)]:
        raise BadInput(f"the cloud {str(path)!r} claims {' '.join(said['POINTS'])} points in {width} x {height} places")
    if kind == "ascii":
        return _Header(height, width, length, count, length)
    if kind == "binary":
        return _Header(height, width, length + each * count, 0, length)
    if kind != "binary_compressed":
        raise BadInput(f"the cloud {str(path)!r} has data {kind!r}; legal: ascii, binary, binary_compressed")
    packed = head[length : length + 8]
    compressed, unpacked = struct.unpack("<II", packed) if len(packed) == 8 else (0, 0)
    if unpacked != each * count:
        raise BadInput(f"the cloud {str(path)!r} unpacks to {unpacked} bytes, and {count} points have {each * count}")
    return _Header(height, width, length + len(packed) + compressed, 0, length)


def _ply_header(path: Path, head: bytes) -> _Header:
    """Read the header of a .ply file."""
    ending = re.search(rb"^end_header\r?\n?", head, re.MULTILINE)
    text = head[: ending.end() if ending else 0].decode("latin-1").replace("\r\n", "\n")
    kind = re.search(r"^format (ascii|binary_little_endian|binary_big_endian) ", text, re.MULTILINE)
    if not text.startswith("ply") or ending is None or kind is None:
        raise BadInput(f"the file {str(path)!r} is not a .ply cloud: it has no header of a .ply file")
    vertex = re.search(r"^element vertex (\d+) *$((?:\n(?:property|comment) .*$)*)", text, re.MULTILINE)
    if vertex is None:
        raise BadInput(f"the cloud {str(path)!r} has no vertices")
    properties = re.findall(r"^property (\w+) (\w+) *$", vertex[2], re.MULTILINE)
    names, count, length = [name for _, name in properties], int(vertex[1]), ending.end()
    if not {"x", "y", "z"} <= set(names):
        raise BadInput(f"the cloud {str(path)!r} has no x, y and z; its properties are: {', '.join(names) or 'none'}")
    if kind[1] == "ascii":
        return _Header(1, count, length, count, length)
    return _Header(1, count, length + count * sum(_PLY_BYTES.get(of, 1) for of, _ in properties), 0, length)

"""Clouds on disk: .ply and .pcd files, whose headers are checked before anything is believed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import BadInput

SUFFIXES = (".ply", ".pcd")
_MOST_POINTS = 50_000_000
_HEADER_BYTES = 65_536
_FARTHEST = 20.0  # m, of the median: a table is nearer, and numbers of this size are millimetres
_PLY_BYTES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2, "int": 4, "uint": 4,
    "int32": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8,
}  # fmt: skip


@dataclass(frozen=True)
class _Header:
    """What a file says of itself: rows and columns of its points, and the fewest bytes that they can take."""

    height: int
    width: int
    fewest_bytes: int


def read_cloud(path: Path) -> tuple[np.ndarray, np.ndarray | None, tuple[str, ...]]:
    """Points (H, W, 3) float32, metres, colours (H, W, 3) uint8 or `None`, and what was assumed, a sentence each.

    An organised .pcd keeps its rows and columns, anything else is one row.

    Raises:
        BadInput: for a file that is not there, damaged, empty, or without coordinates.
    """
    if not path.is_file():
        raise BadInput(f"there is no cloud {str(path)!r}")
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
    header = _pcd_header(path, head) if path.suffix.lower() == ".pcd" else _ply_header(path, head)
    count = header.height * header.width
    if count == 0:
        raise BadInput(f"the cloud {str(path)!r} is empty")
    if count > _MOST_POINTS or header.fewest_bytes > size:
        raise BadInput(
            f"the cloud {str(path)!r} claims {count} points and has {size} bytes; at most {_MOST_POINTS} are read, and "
            f"these need {header.fewest_bytes}"
        )
    points, colors = _read(path, count)
    shape = (header.height, header.width, 3)
    points[~np.isfinite(points).all(axis=1) | (points == 0.0).all(axis=1)] = np.nan
    distances = np.linalg.norm(points, axis=1)
    if np.isnan(distances).all():
        raise BadInput(f"the cloud {str(path)!r} has no point but NaN and the camera's own place")
    notes = ("the cloud was taken to be in the camera's optical frame: z forward, x right, y down",)
    median = float(np.nanmedian(distances))
    if median > _FARTHEST:
        points = points * np.float32(0.001)
        notes = (*notes, f"the cloud was taken to be in millimetres: half its points lie beyond {median:.0f}")
    return points.reshape(shape), None if colors is None else colors.reshape(shape), notes


def _read(path: Path, count: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Points (P, 3) float32 and colours (P, 3) uint8 of a file whose header has been checked."""
    import open3d

    # The library says what is wrong only where nobody listens, and gives what it has.
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        try:
            cloud = open3d.t.io.read_point_cloud(str(path))
        except RuntimeError as error:
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
    """The header of a .pcd file."""
    said: dict[str, list[str]] = {}
    for line in head.split(b"\n"):
        words = line.decode("latin-1").split()
        if words and words[0].isupper() and words[0].isalpha():
            said[words[0]] = words[1:]
        if words[:1] == ["DATA"]:
            break
    else:
        raise BadInput(f"the file {str(path)!r} is no .pcd cloud: it has no line DATA")
    fields, kind = said.get("FIELDS", []), "".join(said["DATA"])
    if not {"x", "y", "z"} <= set(fields):
        raise BadInput(f"the cloud {str(path)!r} has no x, y and z; its fields are: {', '.join(fields) or 'none'}")
    if kind not in ("ascii", "binary", "binary_compressed"):
        raise BadInput(f"the cloud {str(path)!r} has data {kind!r}; legal: ascii, binary, binary_compressed")
    try:
        sizes = [int(word) for word in said["SIZE"]]
        counts = [int(word) for word in said.get("COUNT", ["1"] * len(fields))]
        (width,), (height,) = ([int(word) for word in said[key]] for key in ("WIDTH", "HEIGHT"))
        each = sum(size * count for size, count in zip(sizes, counts, strict=True))
        if len(fields) != len(sizes) or min(width, height) < 0 or each < 12:
            raise ValueError
        if (total := int(said.get("POINTS", [str(width * height)])[0])) != width * height:
            raise BadInput(f"the cloud {str(path)!r} claims {total} points in {width} x {height} places")
    except (KeyError, ValueError, IndexError) as error:
        raise BadInput(f"the header of the cloud {str(path)!r} is damaged") from error
    # A number in text takes two bytes, and the packing of compressed clouds turns at most 264 bytes into three.
    shortest = {"ascii": 2 * sum(counts), "binary": each, "binary_compressed": each * 3 / 264}[kind]
    return _Header(height, width, int(shortest * width * height))


def _ply_header(path: Path, head: bytes) -> _Header:
    """The header of a .ply file."""
    text, ended, _ = head.decode("latin-1").partition("end_header")
    kind = re.search(r"^format (ascii|binary_little_endian|binary_big_endian) ", text, re.MULTILINE)
    if not text.startswith("ply") or not ended or kind is None:
        raise BadInput(f"the file {str(path)!r} is no .ply cloud: it has no header of one")
    vertex = re.search(r"^element vertex (\d+)\s*$((?:\s*^(?:property|comment) .*$)*)", text, re.MULTILINE)
    if vertex is None:
        raise BadInput(f"the cloud {str(path)!r} has no vertices")
    properties = re.findall(r"^\s*property (\w+) (\w+)\s*$", vertex[2], re.MULTILINE)
    names = [name for _, name in properties]
    if not {"x", "y", "z"} <= set(names):
        raise BadInput(f"the cloud {str(path)!r} has no x, y and z; its properties are: {', '.join(names) or 'none'}")
    each = 2 * len(names) if kind[1] == "ascii" else sum(_PLY_BYTES.get(of, 1) for of, _ in properties)
    return _Header(1, int(vertex[1]), each * int(vertex[1]))

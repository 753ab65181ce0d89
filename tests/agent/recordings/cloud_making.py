"""Clouds in the ways in which point libraries, scanners and people write them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

Column = tuple[str, str, np.ndarray]
"""A field: its name, its kind such as "f4", and its values (P,) or (P, K)."""


def as_lzf(data: bytes) -> bytes:
    """Data in LZF, with literal runs and with repeats near and far."""
    packed, literal, seen, at = bytearray(), bytearray(), {}, 0

    def flush() -> None:
        for start in range(0, len(literal), 32):
            piece = literal[start : start + 32]
            packed.append(len(piece) - 1)
            packed.extend(piece)
        literal.clear()

    while at < len(data):
        key = data[at : at + 3]
        before = seen.get(key, -1)
        seen[key] = at
        back = at - before - 1
        if before < 0 or back >= 8192 or len(key) < 3:
            literal.append(data[at])
            at += 1
            continue
        length = 3
        while length < 264 and at + length < len(data) and data[before + length] == data[at + length]:
            length += 1
        flush()
        if length < 9:
            packed += bytes(((length - 2) << 5 | back >> 8, back & 255))
        else:
            packed += bytes((7 << 5 | back >> 8, length - 9, back & 255))
        at += length
    flush()
    return bytes(packed)


def records(columns: list[Column], order: str = "<") -> np.ndarray:
    """The points as a structured array without names that repeat."""
    kinds = [(str(k), f"{order}{kind}", values.shape[1:]) for k, (_, kind, values) in enumerate(columns)]
    found = np.zeros(len(columns[0][2]), kinds)
    for k, (_, _, values) in enumerate(columns):
        found[str(k)] = values
    return found


def text_rows(columns: list[Column]) -> str:
    """The points as lines of text."""
    flat = [values.reshape(len(values), -1).tolist() for _, _, values in columns]
    return "".join(" ".join(str(value) for part in row for value in part) + "\n" for row in zip(*flat, strict=True))


def pcd_bytes(columns: list[Column], kind: str = "binary", size: tuple[int, int] | None = None, **said: str) -> bytes:
    """A .pcd file; `said` replaces lines of its header."""
    count = len(columns[0][2])
    width, height = size or (count, 1)
    header = {
        "VERSION": "0.7",
        "FIELDS": " ".join(name for name, _, _ in columns),
        "SIZE": " ".join(of[1:] for _, of, _ in columns),
        "TYPE": " ".join(of[0].upper() for _, of, _ in columns),
        "COUNT": " ".join(str(values[0].size) for _, _, values in columns),
        "WIDTH": str(width),
        "HEIGHT": str(height),
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(count),
        "DATA": kind,
    } | said
    text = "# .PCD v0.7 - Point Cloud Data file format\n" + "".join(f"{key} {word}\n" for key, word in header.items())
    if kind == "ascii":
        return (text + text_rows(columns)).encode()
    if kind == "binary":
        return text.encode() + records(columns).tobytes()
    raw = b"".join(values.astype(f"<{of}").tobytes() for _, of, values in columns)
    packed = as_lzf(raw)
    return text.encode() + struct.pack("<II", len(packed), len(raw)) + packed


PLY_TYPES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float", "f8": "double"
}  # fmt: skip


def ply_bytes(columns: list[Column], kind: str = "binary_little_endian", before: str = "", rows: bytes = b"") -> bytes:
    """A .ply file; `before` are lines of its header before the vertices, and `rows` what they stand for."""
    header = f"ply\nformat {kind} 1.0\ncomment made for a test\n{before}element vertex {len(columns[0][2])}\n"
    header += "".join(f"property {PLY_TYPES[of]} {name}\n" for name, of, _ in columns)
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    if kind == "ascii":
        return header.encode() + rows + text_rows(columns).encode() + b"3 0 1 2\n"
    order = ">" if "big" in kind else "<"
    return header.encode() + rows + records(columns, order).tobytes() + struct.pack(f"{order}Biii", 3, 0, 1, 2)


def axes(points: np.ndarray, kind: str = "f4") -> list[Column]:
    """The columns x, y and z of points (P, 3)."""
    return [(axis, kind, points[:, k].astype(kind)) for k, axis in enumerate("xyz")]


def written(path: Path, content: bytes) -> Path:
    """The path, after writing the content."""
    path.write_bytes(content)
    return path

"""Say what the chunks of an instruction ask for: shapes, relations, places, and the keys of structures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from grounding.goal_reading.chunk import Chunk

# What implies a shape besides its noun: verbs, keys and other words.
_VERB_SHAPES: Mapping[str, tuple[str, ...]] = {
    "stack": ("tower", "pyramid"), "line": ("line",), "cluster": ("cluster",), "sort": ("cluster", "line"),
    "surround": ("circle", "arc"), "circle": ("circle",), "spread": ("line", "grid", "circle"),
}  # fmt: skip
_CHUNK_SHAPES: Mapping[str, tuple[str, ...]] = {
    "stacked": ("tower",), "side by side": ("line", "cluster"), "grid": ("grid",), "rows": ("grid", "line"),
    "columns": ("grid",),
    "table "
    "setting": ("table setting",), "together": ("cluster",), "group": ("cluster",), "order": ("line", "tower", "arc"),
    "order end": ("line", "tower", "arc"), "along": ("line",), "length of": ("line",), "radius": ("circle", "arc"),
    "diameter": ("circle", "arc"), "direction": ("line", "tower"), "listed": ("line", "tower"),
    "beside each other": ("line",),
    "gap": ("line", "cluster"),
}  # fmt: skip
SIDES = {"left of": ("x_position", "left"), "right of": ("x_position", "right"), "behind": ("y_position", "top"),
         "in front of": ("y_position", "bottom")}  # fmt: skip


def named_shapes(chunks: Sequence[Chunk]) -> list[str]:
    """List the shapes that are asked for by their names, each once."""
    shapes = [c.value.name for c in chunks if c.kind == "shape" and not c.value.definite]
    return list(dict.fromkeys([*shapes, *("table setting" for c in chunks if c.kind == "table setting")]))


def implied_shapes(chunks: Sequence[Chunk]) -> set[str]:
    """Return the shapes that a goal of these chunks may have."""
    implied = {c.value.name for c in chunks if c.kind == "shape"}
    for chunk in chunks:
        implied.update(_CHUNK_SHAPES.get(chunk.kind, ()))
        implied.update(_VERB_SHAPES.get(chunk.value, ()) if chunk.kind == "verb" else ())
        implied.update(("circle", "arc") if chunk.kind == "relation" and chunk.value == "around" else ())
        implied.update(("table setting",) if chunk.kind == "table setting" else ())
    return implied


def said_relations(chunks: Sequence[Chunk]) -> Counter[str]:
    """Count the relations that are said, moves aside."""
    return Counter(c.value for c in chunks if c.kind in ("relation", "relation it", "apart"))


def said_places(chunks: Sequence[Chunk]) -> set[tuple[str, str]]:
    """Return the places on the table that are said: ("x_position", "left") and so on."""
    return {
        (key, value)
        for c in chunks
        if c.kind == "place"
        for key in ("x_position", "y_position")
        if (value := getattr(c.value, key)) is not None
    }


def said_keys(chunks: Sequence[Chunk]) -> dict[str, set[Any]]:
    """Return the values of a structure's keys that are said, for each key but places, lengths and orders."""
    shapes = [chunk.value for chunk in chunks if chunk.kind == "shape"]
    said: dict[str, set[Any]] = {
        "size": {c.value for c in chunks if c.kind == "size"} | {shape.size for shape in shapes if shape.size},
        "rotation": {c.value for c in chunks if c.kind == "rotation"}
        | {shape.rotation for shape in shapes if shape.rotation},
        "along": {chunk.value for chunk in chunks if chunk.kind == "along"},
        "group_by": {chunk.value for chunk in chunks if chunk.kind == "group"},
        "rows": {c.value[0] for c in chunks if c.kind == "grid"}
        | {c.value for c in chunks if c.kind == "rows" and c.value > 1},
        "columns": {c.value[1] for c in chunks if c.kind == "grid"}
        | {c.value for c in chunks if c.kind == "columns" and c.value > 1},
    }  # fmt: skip
    said["rows"] |= {shape.grid[0] for shape in shapes if shape.grid[0]}
    said["columns"] |= {shape.grid[1] for shape in shapes if shape.grid[1]}
    return said


def said_order_keys(chunks: Sequence[Chunk]) -> set[str]:
    """Return by what objects are to be ordered."""
    return {c.value["by"] for c in chunks if c.kind in ("order", "order end") and "by" in c.value}

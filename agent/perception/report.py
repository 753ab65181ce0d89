"""Report what perception found, as a table and as JSON. Lengths are metres in the world frame, angles degrees."""

from __future__ import annotations

import math
from typing import Any, TextIO

import numpy as np

from agent.perception.segments import ARM, Segment, Segments
from agent.rendering.text import with_indefinite_article
from structdiffusion.geometry import yaw_of
from structdiffusion.observation import Table

_COLUMNS = (("x", 6), ("y", 7), ("yaw", 5), ("length", 8), ("width", 7), ("height", 8), ("points", 8))


def print_objects(segments: Segments, results: TextIO) -> None:
    """Print the objects, one per line, the table, and what was assumed."""
    if segments.objects:
        wide = max(len(found.display_name) for found in segments.objects)
        print(" " * wide + "".join(f"{title:>{width}}" for title, width in _COLUMNS), file=results)
    for found in segments.objects:
        x, y = found.world_from_box[:2, 3]
        length, width, height = found.sides
        print(
            f"{found.display_name:<{wide}}{x:6.3f}{y:7.3f}{_degrees(found.world_from_box):5.0f}"
            f"{length:8.3f}{width:7.3f}{height:8.3f}{len(found.points):8d}",
            file=results,
        )
    for found in segments.objects:
        if found.noun:
            print(taken_for(found), file=results)
    for found in segments.objects:
        if found.rests_on:
            print(
                f"{found.name} {'rests' if found.support_seen else 'seems to rest'} on {found.rests_on}", file=results
            )
    many = len(segments.objects)
    objects = f"{many or 'no'} object{'' if many == 1 else 's'}"
    print(f"{objects} on a table that was seen {_rectangle_in_words(segments.surface)}", file=results)
    print(f"structures are built {_rectangle_in_words(segments.table)}", file=results)
    arm = int((segments.labels == ARM).sum())
    if arm:
        print(f"{arm} points are the arm's own", file=results)
    for note in segments.notes:
        print(f"note: {note}", file=results)


def taken_for(found: Segment) -> str:
    """Say what an object is taken for, and how surely: "object 2 is taken for a mug (0.93)"."""
    return f"{found.name} is taken for {with_indefinite_article(found.noun)} ({found.confidence:.2f})"


def objects_json(segments: Segments) -> dict[str, Any]:
    """Return the same as JSON values: every number in metres or degrees, transforms as rows."""
    return {
        "objects": [
            {
                "name": found.name,
                "called": found.display_name,
                "noun": found.noun or None,
                "confidence": None if found.confidence is None else _round(found.confidence, 2),
                "x": _round(found.world_from_box[0, 3]),
                "y": _round(found.world_from_box[1, 3]),
                "yaw": _round(_degrees(found.world_from_box), 1),
                "length": _round(found.sides[0]),
                "width": _round(found.sides[1]),
                "height": _round(found.sides[2]),
                "rests_on": found.rests_on or None,
                "support_seen": found.support_seen if found.rests_on else None,
                "bottom": _round(found.bottom),
                "points": len(found.points),
                "color": None if found.colors is None else np.median(found.colors, axis=0).astype(int).tolist(),
                "color_names": [{"name": each.word, "share": _round(each.share, 2)} for each in found.color_names],
                "world_from_box": _rows(found.world_from_box),
            }
            for found in segments.objects
        ],
        "table": _rectangle(segments.table),
        "surface": _rectangle(segments.surface),
        "world_from_camera": _rows(segments.world_from_camera),
        "world_from_base": _rows(segments.world_from_base),
        "arm_points": int((segments.labels == ARM).sum()),
        "notes": list(segments.notes),
    }


def _degrees(pose: np.ndarray) -> float:
    """Return the yaw of a box's longer side in [0, 180): a box has no front."""
    return math.degrees(yaw_of(pose)) % 180.0


def _rectangle_in_words(table: Table) -> str:
    return f"from x {table.x_min:.2f} to {table.x_max:.2f} and from y {table.y_min:.2f} to {table.y_max:.2f} m"


def _rectangle(table: Table) -> dict[str, float]:
    return {key: _round(getattr(table, key)) for key in ("x_min", "x_max", "y_min", "y_max")}


def _rows(pose: np.ndarray) -> list[list[float]]:
    return [[_round(value, 6) for value in row] for row in pose]


def _round(value: float, digits: int = 4) -> float:
    return round(float(value), digits)

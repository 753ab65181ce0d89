"""Show a scene file as a table or as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from agent.scenes.validation import StandingObject
from structdiffusion.geometry import transform_points

SCHEMA_VERSION = 1
_HEADINGS = ("name", "noun", "mesh", "x", "y", "z", "yaw", "roll", "pitch", "span x × y × z")


def scene_report(path: Path, standing: Sequence[StandingObject]) -> dict[str, Any]:
    """Return the place of every object as JSON values: metres and degrees, world frame."""
    return {
        "schema_version": SCHEMA_VERSION,
        "file": str(path),
        "objects": [
            {
                "name": entry.name,
                "noun": entry.model.category,
                "mesh": entry.placed.mesh,
                "line": entry.placed.line,
                "position": [entry.placed.x, entry.placed.y, entry.placed.z],
                "yaw": entry.placed.yaw,
                "roll": entry.placed.roll,
                "pitch": entry.placed.pitch,
                "span": [round(length, 4) for length in _span(entry)],
                "mass_kg": round(entry.model.mass, 4),
                "color": [round(part, 3) for part in entry.model.color],
            }
            for entry in standing
        ],
    }


def print_scene(standing: Sequence[StandingObject], out: TextIO) -> None:
    """Print the same as a table, one object per line; roll and pitch only if something is tilted."""
    rows: list[tuple[str, ...]] = [_HEADINGS]
    for entry in standing:
        placed = entry.placed
        rows.append(
            (
                entry.name,
                entry.model.category,
                placed.mesh,
                *(f"{length:.3f}" for length in (placed.x, placed.y, placed.z)),
                *(f"{angle:.1f}" for angle in (placed.yaw, placed.roll, placed.pitch)),
                " × ".join(f"{length:.3f}" for length in _span(entry)),
            )
        )
    if not any(entry.placed.roll or entry.placed.pitch for entry in standing):
        rows = [(*row[:7], row[9]) for row in rows]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        cells = [cell.ljust(width) if k < 3 else cell.rjust(width) for k, (cell, width) in enumerate(zip(row, widths))]
        print("  ".join(cells).rstrip(), file=out)


def _span(entry: StandingObject) -> list[float]:
    """Return the object's extent along the world's axes, metres."""
    points = transform_points(entry.world_from_object, np.concatenate(entry.model.hulls))
    return np.ptp(points, axis=0).tolist()

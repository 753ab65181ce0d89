"""Parse the conditions of evaluation scenes: "8-10" objects, a "0.40x0.60" table, the side of the camera."""

from __future__ import annotations

import re

from agent.errors import UsageError
from structdiffusion.benchmark.scenes import CAMERA_SIDES, Conditions, camera_beside
from structdiffusion.observation import Table

FEWEST, MOST = 2, 12  # objects in a scene: a structure has two, and the models have places for twelve
SHORTEST, LONGEST = 0.20, 2.00  # m, a side of a table
_NUMBER = r"\d+(?:\.\d+)?"


def conditions_of(objects_per_scene: str | None, table: str | None, camera: str) -> Conditions:
    """Return the conditions for option values; `None`, and the side "robot", mean the conditions of training.

    Args:
        objects_per_scene: as for `parsed_count`.
        table: as for `parsed_table`.
        camera: one of `CAMERA_SIDES`.

    Raises:
        UsageError: for an illegal value.
    """
    if camera not in CAMERA_SIDES:
        raise UsageError(f"--camera cannot be {camera!r}; legal values: {', '.join(CAMERA_SIDES)}")
    top = Table() if table is None else parsed_table(table)
    objects = None if objects_per_scene is None else parsed_count(objects_per_scene)
    return Conditions(top, objects, camera_beside(camera, top))


def parsed_count(text: str) -> tuple[int, int]:
    """Return the smallest and the largest number of "8-10", or of "8" alone.

    Raises:
        UsageError: for any other text.
    """
    found = re.fullmatch(r"(\d+)(?:-(\d+))?", text.strip())
    low, high = (int(found[1]), int(found[2] or found[1])) if found else (0, 0)
    if not FEWEST <= low <= high <= MOST:
        raise UsageError(
            f"--objects-per-scene cannot be {text!r}; legal: a number from {FEWEST} to {MOST}, or two of them, the "
            "smaller first, such as 8-10"
        )
    return low, high


def parsed_table(text: str) -> Table:
    """Return the table of "0.40x0.60": its depth, away from the robot, and its breadth, metres, about the usual centre.

    Raises:
        UsageError: for any other text.
    """
    found = re.fullmatch(rf"({_NUMBER})\s*[xX×]\s*({_NUMBER})", text.strip())
    depth, breadth = (float(found[1]), float(found[2])) if found else (0.0, 0.0)
    if not (SHORTEST <= depth <= LONGEST and SHORTEST <= breadth <= LONGEST):
        raise UsageError(
            f"--table cannot be {text!r}; legal: depth x breadth in metres, each from {SHORTEST:g} to {LONGEST:g}, "
            "such as 0.40x0.60"
        )
    usual = Table()
    x, y = (usual.x_min + usual.x_max) / 2, (usual.y_min + usual.y_max) / 2
    return Table(x - depth / 2, x + depth / 2, y - breadth / 2, y + breadth / 2)

"""Read an arrangement that somebody made by hand, "cup 1: 0.40, 0.10, 30; cup 2: 0.50, -0.10", as a figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely

from agent.chat.commands import ARRANGEMENT
from agent.errors import UsageError
from agent.figures.examples import example_of_clouds
from grounding.figures.figure import Figure
from structdiffusion.completion.estimate import estimate
from structdiffusion.figures.example import figure_of
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.models.strokes.reading import read_strokes
from structdiffusion.observation import ObjectCloud, Scene, Table

_OVER = 1e-4  # m2 that outlines may share, because they are only known from the visible side


def arranged_figure(text: str, scene: Scene) -> Figure:
    """Return the figure that objects show where a text puts them.

    Args:
        text: as in `ARRANGEMENT`: where the middle of what is seen of each object goes, metres in the world frame, and
            by how many degrees it is turned about it; without a turn by 0. All stand on the table.
        scene: the objects as they stand now.

    Raises:
        UsageError: for a text in another form, an unknown name, a place beside the table, and objects that overlap.
        FigureError: for what is no figure.
    """
    clouds, motions = _arranged(text, (*scene.objects, *scene.distractors), scene.table)
    _check_apart(clouds, motions)
    return figure_of(example_of_clouds(clouds, np.array(motions)), "example", ("example",), read_strokes)


def _arranged(text: str, seen: Sequence[ObjectCloud], table: Table) -> tuple[list[ObjectCloud], list[np.ndarray]]:
    """Return the clouds that are named, and their motions (4, 4), world frame."""
    known = {cloud.name: cloud for cloud in seen}
    clouds, motions = list[ObjectCloud](), list[np.ndarray]()
    for entry in filter(str.strip, text.split(";")):
        name, _, numbers = (each.strip() for each in entry.rpartition(":"))
        if name not in known:
            raise UsageError(
                f"/arrange: there is no {name or entry.strip()!r}; legal: {', '.join(known)}, as in {ARRANGEMENT}"
            )
        if any(cloud.name == name for cloud in clouds):
            raise UsageError(f"/arrange: {name} has two places")
        x, y, turn = _numbers(name, numbers)
        if not (table.x_min <= x <= table.x_max and table.y_min <= y <= table.y_max):
            reach = f"x {table.x_min:g} to {table.x_max:g}, y {table.y_min:g} to {table.y_max:g}"
            raise UsageError(f"/arrange: {name} at {x:g}, {y:g} is beside the table; legal: {reach}")
        middle = known[name].points.mean(axis=0)
        motion = pose_from_xyz_yaw(x, y, -known[name].bottom, math.radians(turn))  # on the table, whatever it stood on
        motion[:2, 3] -= motion[:2, :2] @ middle[:2]
        clouds.append(known[name])
        motions.append(motion)
    if len(clouds) < 2:
        raise UsageError(f"/arrange needs two objects or more, got {len(clouds)}, as in {ARRANGEMENT}")
    return clouds, motions


def _numbers(name: str, text: str) -> tuple[float, float, float]:
    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not np.isfinite(numbers).all():
        raise UsageError(f"/arrange: {name} needs two or three numbers, X, Y and TURN, got {text!r}")
    return numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 0.0


def _check_apart(clouds: Sequence[ObjectCloud], motions: Sequence[np.ndarray]) -> None:
    outlines = [
        shapely.Polygon(estimate(cloud).outline_after(motion)) for cloud, motion in zip(clouds, motions, strict=True)
    ]
    for i, j in combinations(range(len(clouds)), 2):
        if outlines[i].intersection(outlines[j]).area > _OVER:
            raise UsageError(f"/arrange: {clouds[i].name} and {clouds[j].name} overlap")

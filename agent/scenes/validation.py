"""Check the places of a scene file's objects, and report all problems at once, except consequences of others.

An object whose line is wrong elsewhere is judged by what is known of it. Whatever it may hold up is not judged: that
would seem to fall only because the object is left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.scenes.files import PlacedObject, Problem
from grounding.resolve.object_names import read_name
from structdiffusion.geometry import tilt_between, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld

_TOUCHING = 0.001  # m: what physics has set on something, or beside it, sinks in by less
_LYING = 0.002  # m: what is higher than this above the table is held up by something else
_LOOK_SECONDS = 1.0  # s of physics in which what does not stand falls
_MOST_MOVED, _MOST_TILTED = 0.02, math.radians(15.0)
_POSE = frozenset(("x", "y", "z", "yaw", "roll", "pitch"))
_LARGEST = 0.2  # m: how far from its place an object may reach of which nothing is known
_BESIDE = 0.01  # m: what is as near as this may lean on it


def problems_of_places(found: Sequence[StandingObject], missing: Sequence[PlacedObject], table: Table) -> list[Problem]:
    """Return the problems of objects that are off the table, inside each other, or would fall.

    Args:
        found: the objects whose meshes are known, wherever they stand.
        missing: those whose meshes are not.
        table: the table.
    """
    posed = [entry for entry in found if not entry.placed.unread & _POSE]
    doubtful = [entry for entry in found if entry.placed.unread & _POSE]
    off = _off_table(posed, table)
    overlaps, overlapping = _in_each_other(posed, table)
    lines_off = {problem.line for problem in off}
    out_of_place = {k for k, entry in enumerate(posed) if entry.placed.line in lines_off or k in overlapping}
    in_place = [entry for k, entry in enumerate(posed) if k not in out_of_place]
    areas = [_Area.of(posed[k]) for k in out_of_place]
    areas += [_Area.around(entry.placed, _radius(entry)) for entry in doubtful]
    areas += [_Area.around(placed, _LARGEST) for placed in missing]
    unsure = [(entry.name, entry.placed) for entry in doubtful] + [(one.name or one.mesh, one) for one in missing]
    off += _places_off_table(unsure, table)
    return [*off, *overlaps, *_falling(_independent(in_place, areas), table)]


@dataclass(frozen=True)
class _Area:
    """A rectangle of the table that an object may take up: its lowest and highest x and y, m."""

    low: tuple[float, float]
    high: tuple[float, float]

    @classmethod
    def of(cls, entry: StandingObject) -> _Area:
        points = _points(entry)[:, :2]
        return cls(tuple(points.min(axis=0) - _BESIDE), tuple(points.max(axis=0) + _BESIDE))

    @classmethod
    def around(cls, placed: PlacedObject, radius: float) -> _Area:
        """Return the area of an object that extends no farther than the radius from its place, as far as that is
        known.
        """
        low, high = zip(
            *(
                (-math.inf, math.inf) if key in placed.unread else (value - radius, value + radius)
                for key, value in (("x", placed.x), ("y", placed.y))
            ),
            strict=True,
        )
        return cls(low, high)

    def meets(self, other: _Area) -> bool:
        return all(a <= d and c <= b for a, b, c, d in zip(self.low, self.high, other.low, other.high, strict=True))


def _independent(entries: Sequence[StandingObject], left_out: Sequence[_Area]) -> list[StandingObject]:
    """Return the objects that are supported by nothing uncertain in these areas."""
    entries, left_out = list(entries), list(left_out)
    while True:
        held = [not _lies(entry) and any(_Area.of(entry).meets(area) for area in left_out) for entry in entries]
        if not any(held):
            return entries
        left_out += [_Area.of(entry) for entry, is_held in zip(entries, held, strict=True) if is_held]
        entries = [entry for entry, is_held in zip(entries, held, strict=True) if not is_held]


def _lies(entry: StandingObject) -> bool:
    """Return whether an object is upright on the table."""
    return entry.placed.roll == entry.placed.pitch == 0.0 and _points(entry)[:, 2].min() <= _LYING


def _points(entry: StandingObject) -> np.ndarray:
    return transform_points(entry.world_from_object, np.concatenate(entry.model.hulls))


def _radius(entry: StandingObject) -> float:
    """Return how far an object extends from its origin in any rotation, m."""
    return float(np.linalg.norm(np.concatenate(entry.model.hulls), axis=1).max())


def _off_table(standing: Sequence[StandingObject], table: Table) -> list[Problem]:
    problems = []
    for entry in standing:
        points = _points(entry)[:, :2]
        over = table.overhang(points)
        if over > _TOUCHING:
            low, high = points.min(axis=0), points.max(axis=0)
            message = (
                f"{entry.name!r} is off the table by {_length(over)}: it spans x {low[0]:.3f} to {high[0]:.3f} and "
                f"y {low[1]:.3f} to {high[1]:.3f}; {_legal(table)}"
            )
            problems.append(Problem(entry.placed.line, message))
    return problems


def _places_off_table(named: Sequence[tuple[str, PlacedObject]], table: Table) -> list[Problem]:
    """Return the places off the table among objects of which only the place is known."""
    problems = []
    for name, placed in named:
        known = {key for key in "xy" if key not in placed.unread}
        x = placed.x if "x" in known else table.x_min
        y = placed.y if "y" in known else table.y_min
        over = table.overhang(np.array([[x, y]]))
        if over > _TOUCHING:
            place = " and ".join(f"{key} {value:.3f}" for key, value in (("x", x), ("y", y)) if key in known)
            display_name = repr(name) if name else "the object"
            message = f"{display_name} is off the table by {_length(over)}, at {place}; {_legal(table)}"
            problems.append(Problem(placed.line, message))
    return problems


def _in_each_other(standing: Sequence[StandingObject], table: Table) -> tuple[list[Problem], set[int]]:
    """Return the overlaps as problems, each with its objects."""
    problems, which = [], set()
    with TabletopWorld([e.model for e in standing], [e.world_from_object for e in standing], table) as world:
        for k, entry in enumerate(standing):
            for other, clearance in sorted(world.clearances(k, _TOUCHING, range(k)).items()):
                if clearance < -_TOUCHING:
                    neighbour = standing[other]
                    message = (
                        f"{entry.name!r} overlaps {neighbour.name!r} of line {neighbour.placed.line} "
                        f"by {_length(-clearance)}"
                    )
                    problems.append(Problem(entry.placed.line, message))
                    which |= {k, other}
    return problems, which


def _falling(standing: Sequence[StandingObject], table: Table) -> list[Problem]:
    """Return the problems of objects that do not stay in place during a second of physics."""
    problems = []
    with TabletopWorld([e.model for e in standing], [e.world_from_object for e in standing], table) as world:
        world.settle(_LOOK_SECONDS)
        for entry, pose in zip(standing, world.poses(), strict=True):
            moved = float(np.linalg.norm(pose[:3, 3] - entry.world_from_object[:3, 3]))
            tilted = tilt_between(pose, entry.world_from_object)
            if moved > _MOST_MOVED or tilted > _MOST_TILTED:
                message = (
                    f"{entry.name!r} does not stay where it is put: within {_LOOK_SECONDS:.0f} s it moves "
                    f"{_length(moved)} and tilts {math.degrees(tilted):.0f} degrees"
                )
                problems.append(Problem(entry.placed.line, message))
    return problems


def _legal(table: Table) -> str:
    return f"legal: x {table.x_min} to {table.x_max}, y {table.y_min} to {table.y_max}"


def _length(metres: float) -> str:
    return f"{metres * 1000:.0f} mm"


@dataclass(frozen=True)
class StandingObject:
    """One object of a scene file, found and placed.

    Attributes:
        placed: what the file says.
        name: what it is called, unique.
        model: the object, with the noun and colour that the file gives it.
        world_from_object: (4, 4) its pose.
        source: "LIBRARY/OBJECT" as the file says it, or the mesh's path.
    """

    placed: PlacedObject
    name: str
    model: ObjectModel
    world_from_object: np.ndarray
    source: str | Path

    @property
    def display_name(self) -> str:
        """Return its name in instructions, with its noun and colour if they add information."""
        first, _, rest = self.name.partition(",")
        if read_name(first).head != read_name(self.model.category).head:
            words, number = re.fullmatch(r"(.*?)(\s*\d*)", first, re.DOTALL).groups()  # type: ignore[union-attr]
            first = f"{words} {self.model.category}{number if number[:1] in ('', ' ') else f' {number}'}"
        color = self.placed.color or ""
        color = "" if color.startswith("#") or color in first.lower().split() else color
        return " ".join(part for part in (color, f"{first},{rest}" if rest else first) if part)

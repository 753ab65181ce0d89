"""Structures made by hand, and the checks that they fail."""

import math
from dataclasses import replace

import numpy as np

from structdiffusion.footprints import overlap_depths, turned
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures.bodies import PlacedBody

HEADINGS = {"north": 0.0, "west": 90.0, "south": 180.0, "east": -90.0}
TABLE = Table()


def body(x, y, radius=0.03, category="can", yaw=0.0, z=0.0, rests_on=(), outline=None):
    outline = circle_outline(radius, 60) if outline is None else turned(outline, yaw)
    return PlacedBody(category, category, outline + (x, y), np.array([x, y]), z, z + 0.05, yaw, rests_on)


def moved(thing: PlacedBody, dx: float = 0.0, dy: float = 0.0) -> PlacedBody:
    return replace(thing, footprint=thing.footprint + (dx, dy), centroid=thing.centroid + (dx, dy))


def failures(bodies, spec, table=TABLE) -> list[str]:
    return [check.name for check in check_structure(bodies, spec, table) if not check.passed]


def ring(radius=0.085, degrees=range(0, 360, 60)):
    return [body(0.45 + radius * math.cos(a), radius * math.sin(a)) for a in np.radians(list(degrees))]


def row(gap=0.02, count=4, degrees=0.0):
    """Squares of 6 cm side along y, as a row that faces +x turned by `degrees`; the leftmost first."""
    square = 0.03 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    yaw, places = math.radians(degrees), (0.06 + gap) * (np.arange(count) - (count - 1) / 2)
    right = np.array([math.sin(yaw), -math.cos(yaw)])
    return [body(*((0.45, 0.0) + place * right), yaw=yaw, outline=square) for place in places]


def setting(degrees=180.0, **shifts):
    """A plate with everything for a diner who sits toward the heading `degrees`.

    `shifts` move a thing by (right, away) metres in the diner's view, and turn it by degrees.
    """
    facing = math.radians(degrees)
    away = -np.array([math.cos(facing), math.sin(facing)])
    right = np.array([away[1], -away[0]])
    long = np.array([[-0.07, -0.008], [0.07, -0.008], [0.07, 0.008], [-0.07, 0.008]])
    places = {
        "plate": (0.0, 0.0),
        "fork": (-0.13, 0.0),
        "knife": (0.13, 0.0),
        "spoon": (0.16, 0.0),
        "cup": (0.10, 0.14),
        "bowl": (-0.10, 0.15),
    }
    bodies = []
    for noun, place in places.items():
        dx, dy, turn = (*shifts.get(noun, (0.0, 0.0)), 0.0)[:3]
        at = np.array([0.45, 0.0]) + (place[0] + dx) * right + (place[1] + dy) * away
        yaw = math.atan2(away[1], away[0]) + math.radians(turn)
        radius = {"plate": 0.11, "cup": 0.04}.get(noun, 0.06)
        bodies.append(body(*at, radius, noun, yaw, outline=long if noun in ("fork", "knife", "spoon") else None))
    return bodies


def tower():
    """Three round objects, each on the one below, the broadest lowest."""
    second, third = body(0.45, 0.01, 0.04, z=0.05, rests_on=(0,)), body(0.46, 0, z=0.1, rests_on=(1,))
    return [body(0.45, 0, 0.05), second, third]


def carriers(index, outlines, bottoms, tops):
    """Return which of some objects carry one: those that it overlaps, and whose tops are where it begins."""
    return tuple(
        j
        for j, (outline, top) in enumerate(zip(outlines, tops))
        if j != index
        and abs(bottoms[index] - top) < 0.011
        and overlap_depths(outlines[index][None], outline[None])[0] > 0.002
    )


def at_places(places, radius=0.03):
    """Round objects at places (x, y) about the middle of the table, metres."""
    return [body(0.45 + x, y, radius) for x, y in places]


def cluster():
    """A round object with three others about it, 1 cm apart."""
    return at_places([(0, 0), *(0.07 * np.array([(math.cos(a), math.sin(a)) for a in np.radians([0, 60, 120])]))])


def rectangle(a=0.24, b=0.12, yaw=0.0):
    """Six round objects: corners of a rectangle with sides a (along x) and b,
    and one in the middle of each longer side.
    """
    places = [(-a / 2, -b / 2), (0, -b / 2), (a / 2, -b / 2), (a / 2, b / 2), (0, b / 2), (-a / 2, b / 2)]
    return at_places(turned(np.array(places), yaw))


def square(a=0.2):
    """Four round objects at the corners of a square."""
    return rectangle(a, a)[::3] + rectangle(a, a)[2::3]


def triangle(side=0.2, degrees=0.0, apex=60.0):
    """Six round objects: the corners of an isosceles triangle of equal legs, the first toward `degrees`,
    and the middles.
    """
    half = math.radians(apex) / 2
    corners = side * np.array([(0, 0), (-math.cos(half), math.sin(half)), (-math.cos(half), -math.sin(half))])
    corners -= corners.mean(axis=0)
    places = np.concatenate((corners, (corners + np.roll(corners, -1, axis=0)) / 2))
    return at_places(turned(places, math.radians(degrees)))


def arc(radius=0.12, span=180.0, count=5, degrees=0.0):
    """Round objects on an arc that is open toward `degrees`."""
    return ring_at(radius, degrees + 180.0 + np.linspace(-span / 2, span / 2, count))


def ring_at(radius, degrees):
    return at_places(radius * np.column_stack((np.cos(np.radians(degrees)), np.sin(np.radians(degrees)))))


def grid(rows=2, columns=3, pitch=(0.09, 0.08), missing=0):
    """Round objects row by row from the far left; the last row lacks some."""
    places = [(-pitch[0] * r, -pitch[1] * c) for r in range(rows) for c in range(columns)]
    return at_places(np.array(places[: rows * columns - missing]) - np.mean(places, axis=0))


def cross(step=0.09, degrees=90.0):
    """Six round objects: one at the crossing, one on each arm, a second one on the first arm; lines at an angle."""
    other = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    return at_places([(0, 0), (step, 0), step * other, (-step, 0), -step * other, (2 * step, 0)])


def pyramid():
    """Six blocks of 6 cm, 4 mm apart: three, two and one, in a wall along y."""
    block, bodies = 0.03 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]), []
    for level, count in enumerate((3, 2, 1)):
        for k in range(count):
            below = len(bodies) - (count + 1)
            carriers = (below, below + 1) if level else ()
            y = 0.064 * (k - (count - 1) / 2)
            bodies.append(body(0.45, y, outline=block, z=0.05 * level, rests_on=carriers))
    return bodies

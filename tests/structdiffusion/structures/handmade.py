"""Structures made by hand, and the checks that they fail."""

import math
from dataclasses import replace

import numpy as np

from structdiffusion.footprints import turned
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
        "plate": (0.0, 0.0), "fork": (-0.13, 0.0), "knife": (0.13, 0.0), "spoon": (0.16, 0.0),
        "cup": (0.10, 0.14), "bowl": (-0.10, 0.15),
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

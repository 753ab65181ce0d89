"""Round, thin-walled, studded and light objects for validation: shapes that the training kinds do not have.

Towers and rows fail first if an object rocks, rolls, or sinks into another, which boxes and cans never do. No model is
trained on these objects; ranking, refinement and physics rollouts are tuned on them, so that real scans stay unseen.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.objects.decomposition import few_vertices
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import Kind, Parts, Range, made
from structdiffusion.objects.solids import box, frustum, shell

_AROUND, _ALONG = 36, 21  # vertices of bodies of revolution, around and along the axis
_VERTICES = 64  # number of them that a hull keeps, as for a scan
_UNIT, _STUD, _STUD_HEIGHT = 0.016, 0.0047, 0.0045  # m: pitch, radius and height of the studs of large toy bricks


def _turned(profile: Callable[[np.ndarray], np.ndarray], length: float) -> np.ndarray:
    """Return vertices of a body of revolution about the x axis, with radius (A,) as a function of position
    in [0, 1].
    """
    at = 0.5 - 0.5 * np.cos(np.linspace(0.06, math.pi - 0.06, _ALONG))  # denser at the ends, which are more curved
    angle = np.arange(_AROUND) * 2 * math.pi / _AROUND + math.pi / 2
    radius = profile(at)
    rings = np.broadcast_arrays(length * at[:, None], radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle))
    return np.stack(rings, axis=-1).reshape(-1, 3)


def _cut_below(body: np.ndarray, depth: float) -> np.ndarray:
    """Flatten the lowest few millimetres of the vertices: the base on which a fruit or ball stands."""
    flat = body.copy()
    flat[:, 2] = np.maximum(flat[:, 2], flat[:, 2].min() + depth)
    return few_vertices(flat[ConvexHull(flat).vertices], _VERTICES)


def _ellipse(at: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(0.0, 1 - (2 * at - 1) ** 2))


def _ball(r: Range) -> Parts:
    radius = r.uniform(0.018, 0.055)
    return [_cut_below(_turned(lambda at: radius * _ellipse(at), 2 * radius), 0.0004)]


def _apple(r: Range) -> Parts:
    radius, squash = r.uniform(0.024, 0.04), r.uniform(0.85, 1.05)
    body = _turned(lambda at: radius * _ellipse(at), 2 * radius)
    return [_cut_below(body * (1, 1, squash), r.uniform(0.001, 0.005))]


def _pear(r: Range) -> Parts:
    radius, length, neck = r.uniform(0.026, 0.036), r.uniform(0.075, 0.105), r.uniform(0.35, 0.6)
    # A body at one end and a neck at the other: an ellipse whose radius shrinks along its length.
    body = _turned(lambda at: radius * _ellipse(at) * (1 - (1 - neck) * at**1.5), length)
    return [_cut_below(body, r.uniform(0.001, 0.005))]


def _lemon(r: Range) -> Parts:
    radius = r.uniform(0.02, 0.03)
    return [_cut_below(_turned(lambda at: radius * _ellipse(at), radius * r.uniform(2.5, 3.2)), 0.0005)]


def _marker(r: Range) -> Parts:
    radius, length, cap = r.uniform(0.007, 0.012), r.uniform(0.10, 0.15), r.uniform(0.25, 0.4)
    taper = r.uniform(0.85, 1.0)
    return [_cut_below(_turned(lambda at: np.where(at < cap, radius, taper * radius), length), 0.0002)]


def _beaker(r: Range) -> Parts:
    """Return a thin-walled cup of a nesting set."""
    radius = r.uniform(0.026, 0.054)
    height, foot, wall = 0.045 + 0.6 * radius, r.uniform(0.8, 0.92), r.uniform(0.0016, 0.0026)
    base = r.uniform(0.002, 0.004)
    return [frustum(foot * radius, foot * radius, 0, base), *shell([(foot * radius, 0.0), (radius, height)], wall, 18)]


def _studded(r: Range) -> Parts:
    along, across, height = int(r.integers(2, 5)), 2, r.choice([0.0192, 0.0384])
    length, width = along * _UNIT, across * _UNIT
    parts = [box(length, width, 0, height)]
    if r.random() < 0.6:  # open at the bottom, like real ones
        lid, wall = 0.004, r.uniform(0.0015, 0.003)
        sides = [box(length, wall, 0, height - lid, y=y * (width - wall) / 2) for y in (-1, 1)]
        ends = [box(wall, width, 0, height - lid, x=x * (length - wall) / 2) for x in (-1, 1)]
        parts = [box(length, width, height - lid, height), *sides, *ends]
    for i in range(along):
        for j in range(across):
            middle = _UNIT * (np.array([i, j]) - 0.5 * (np.array([along, across]) - 1))
            parts.append(frustum(_STUD, _STUD, height, height + _STUD_HEIGHT, 10) + np.append(middle, 0.0))
    return parts


def _foam(r: Range) -> Parts:
    return [box(r.uniform(0.06, 0.10), r.uniform(0.04, 0.06), 0, r.uniform(0.03, 0.06))]


def _peg(r: Range) -> Parts:
    """Return a bit, socket or chess piece: much higher than wide, some with a narrower top."""
    radius, height = r.uniform(0.008, 0.017), r.uniform(0.035, 0.07)
    waist = height * r.uniform(0.4, 0.7)
    top = radius * r.choice([1.0, 1.0, 0.6])
    return [frustum(radius, radius, 0, waist, 12), frustum(top, top, waist, height, 12)]


def _die(r: Range) -> Parts:
    side = r.uniform(0.014, 0.03)
    return [box(side, side, 0, side)]


KINDS: dict[str, Kind] = {
    "ball": (_ball, 400, (0.5, 0.7)),
    "apple": (_apple, 350, (0.5, 0.7)),
    "pear": (_pear, 350, (0.5, 0.7)),
    "lemon": (_lemon, 350, (0.5, 0.7)),
    "marker": (_marker, 500, (0.4, 0.6)),
    "beaker": (_beaker, 1000, (0.4, 0.6)),
    "studded brick": (_studded, 500, (0.4, 0.6)),
    "foam brick": (_foam, 130, (0.7, 0.9)),
    "die": (_die, 900, (0.4, 0.6)),
    "peg": (_peg, 800, (0.4, 0.6)),
}
# The noun of a kind, if it is not the kind's name.
_CATEGORIES = {"beaker": "cup", "studded brick": "block", "foam brick": "brick", "die": "dice", "peg": "bit"}
# A nesting set has many cups; of other kinds a scene rarely has two.
_MANY = {"beaker": 3, "studded brick": 2}


def everyday_objects(count: int = 6, seed: int = 0) -> list[ObjectModel]:
    """Return `count` objects of each kind, and more of cups and bricks. The same seed gives the same objects."""
    return [_everyday_object(kind, index, seed) for kind in KINDS for index in range(count * _MANY.get(kind, 1))]


def _everyday_object(kind: str, index: int, seed: int) -> ObjectModel:
    rng = np.random.default_rng((seed, list(KINDS).index(kind), index))
    return made(f"{kind.replace(' ', '_')}_{seed}_{index:03d}", _CATEGORIES.get(kind, kind), KINDS[kind], rng)

"""Generate procedural household objects for training: seventeen kinds with realistic sizes, masses and friction.

The front of each object is +x (see `objects.model`): the tines, blade or bowl of cutlery, and the side of mugs and pans
away from the handle.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable

import numpy as np

from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.solids import assemble, box, circle_outline, frustum, prism, shell

Parts = list[np.ndarray]
Range = np.random.Generator
# The builder, the density of the parts in kg/m3, and the range of sliding friction.
Kind = tuple[Callable[[Range], Parts], float, tuple[float, float]]


def _box(r: Range) -> Parts:
    return [box(r.uniform(0.05, 0.17), r.uniform(0.035, 0.10), 0, r.uniform(0.03, 0.21))]


def _block(r: Range) -> Parts:
    side = r.uniform(0.03, 0.08)
    return [box(side * r.uniform(0.8, 1.2), side, 0, side * r.uniform(0.8, 1.2))]


def _book(r: Range) -> Parts:
    return [box(r.uniform(0.12, 0.20), r.uniform(0.09, 0.14), 0, r.uniform(0.015, 0.045))]


def _can(r: Range) -> Parts:
    radius = r.uniform(0.025, 0.055)
    return [frustum(radius, radius, 0, r.uniform(0.03, 0.15))]


def _jar(r: Range) -> Parts:
    radius, height = r.uniform(0.03, 0.05), r.uniform(0.06, 0.12)
    lid = radius * r.uniform(0.75, 1.0)
    sides = int(r.choice([6, 8, 24]))
    return [frustum(radius, radius, 0, height, sides), frustum(lid, lid, height, height + r.uniform(0.01, 0.02))]


def _bottle(r: Range) -> Parts:
    radius, body = r.uniform(0.025, 0.048), r.uniform(0.08, 0.15)
    neck, shoulder = radius * r.uniform(0.3, 0.5), r.uniform(0.02, 0.04)
    top = body + shoulder
    squash = r.uniform(0.6, 1.0)  # detergent bottles are flat
    parts = [
        frustum(radius, radius, 0, body),
        frustum(radius, neck, body, top),
        frustum(neck, neck, top, top + r.uniform(0.015, 0.05)),
    ]
    return [part * (1, squash, 1) for part in parts]


def _bowl(r: Range) -> Parts:
    rim, height, base = r.uniform(0.055, 0.09), r.uniform(0.035, 0.065), r.uniform(0.4, 0.65)
    thickness, middle = r.uniform(0.004, 0.007), r.uniform(0.78, 0.9)
    profile = [(base * rim, 0.0), (middle * rim, 0.45 * height), (rim, height)]
    return [frustum(base * rim, base * rim, 0, thickness)] + shell(profile, thickness)


def _plate(r: Range) -> Parts:
    rim, height, base = r.uniform(0.08, 0.14), r.uniform(0.012, 0.03), r.uniform(0.5, 0.75)
    thickness = r.uniform(0.004, 0.006)
    return [frustum(base * rim, base * rim, 0, thickness)] + shell([(base * rim, 0.0), (rim, height)], thickness, 20)


def _vessel(r: Range, radius: float, height: float) -> Parts:
    thickness, flare = r.uniform(0.003, 0.006), r.uniform(0.7, 1.05)
    profile = [(flare * radius, 0.0), (radius, height)]
    return [frustum(flare * radius, flare * radius, 0, thickness)] + shell(profile, thickness)


def _cup(r: Range) -> Parts:
    radius = r.uniform(0.024, 0.048)
    return _vessel(r, radius, radius * r.uniform(1.4, 2.6))


def _mug(r: Range) -> Parts:
    radius, height = r.uniform(0.034, 0.05), r.uniform(0.07, 0.11)
    reach, bar, width = r.uniform(0.022, 0.036), r.uniform(0.007, 0.011), r.uniform(0.009, 0.016)
    low, high = height * r.uniform(0.12, 0.25), height * r.uniform(0.75, 0.9)
    inner = -0.93 * radius
    handle = [
        box(reach, width, z - bar / 2, z + bar / 2, x=inner - reach / 2 + 0.01) for z in (low + bar / 2, high - bar / 2)
    ]
    handle.append(box(bar, width, low, high, x=inner - reach + 0.01))
    return _vessel(r, radius, height) + handle


def _pan(r: Range) -> Parts:
    rim, height, grip = r.uniform(0.07, 0.11), r.uniform(0.03, 0.05), r.uniform(0.10, 0.16)
    thickness = 0.005
    parts = [frustum(0.85 * rim, 0.85 * rim, 0, thickness)]
    parts += shell([(0.85 * rim, 0.0), (rim, height)], thickness, 18)
    parts.append(box(grip, r.uniform(0.018, 0.028), height - 0.016, height - 0.003, x=-rim * 0.97 - grip / 2 + 0.004))
    return parts


def _handle(r: Range, length: float) -> tuple[Parts, float, float]:
    """Return a cutlery handle that ends at x = 0, with its width and thickness, metres."""
    width, thick = r.uniform(0.009, 0.022), r.uniform(0.005, 0.012)
    return [box(length, width, 0, thick, x=-length / 2)], width, thick


def _fork(r: Range) -> Parts:
    parts, width, thick = _handle(r, r.uniform(0.09, 0.15))
    head, spread = r.uniform(0.022, 0.03), r.uniform(0.022, 0.028)
    parts.append(box(head, spread, 0, thick * 0.8, x=head / 2 - 0.002))
    tine, count = r.uniform(0.03, 0.045), int(r.choice([3, 4]))
    parts += [
        box(tine, 0.55 * spread / count, 0, thick * 0.7, x=head + tine / 2 - 0.004, y=y)
        for y in np.linspace(-0.42, 0.42, count) * spread
    ]
    return parts


def _knife(r: Range) -> Parts:
    parts, width, thick = _handle(r, r.uniform(0.08, 0.12))
    blade, broad = r.uniform(0.09, 0.13), r.uniform(0.014, 0.026)
    outline = np.array(
        [
            [-0.003, -broad / 2],
            [0.75 * blade, -broad / 2],
            [blade, broad * 0.3],
            [blade * 0.95, broad / 2],
            [-0.003, broad / 2],
        ]
    )
    return parts + [prism(outline, 0, thick * 0.6)]


def _spoon(r: Range) -> Parts:
    parts, width, thick = _handle(r, r.uniform(0.09, 0.17))
    length, broad = r.uniform(0.045, 0.065), r.uniform(0.030, 0.042)
    outline = circle_outline(1.0, 14) * (length / 2, broad / 2) + (length / 2 - 0.004, 0)
    return parts + [prism(outline, 0, thick * 0.9 + 0.004)]


def _spatula(r: Range) -> Parts:
    parts, width, thick = _handle(r, r.uniform(0.13, 0.18))
    blade = r.uniform(0.06, 0.09)
    return parts + [box(blade, r.uniform(0.05, 0.075), 0, 0.5 * thick, x=blade / 2 - 0.003)]


def _candle(r: Range) -> Parts:
    radius = r.uniform(0.02, 0.035)
    return [frustum(radius, radius, 0, r.uniform(0.04, 0.13), int(r.choice([6, 24])))]


def _pitcher(r: Range) -> Parts:
    radius, height = r.uniform(0.045, 0.06), r.uniform(0.13, 0.19)
    handle = [box(0.03, 0.014, z, z + 0.014, x=-radius - 0.01) for z in (0.25 * height, 0.8 * height)]
    handle.append(box(0.014, 0.014, 0.25 * height, 0.8 * height + 0.014, x=-radius - 0.025))
    return _vessel(r, radius, height) + handle


KINDS: dict[str, Kind] = {
    "box": (_box, 350, (0.5, 0.8)),
    "block": (_block, 650, (0.5, 0.8)),
    "book": (_book, 700, (0.4, 0.7)),
    "can": (_can, 900, (0.4, 0.7)),
    "jar": (_jar, 800, (0.4, 0.7)),
    "bottle": (_bottle, 600, (0.4, 0.7)),
    "bowl": (_bowl, 2000, (0.4, 0.7)),
    "plate": (_plate, 2000, (0.4, 0.7)),
    "cup": (_cup, 1500, (0.4, 0.7)),
    "mug": (_mug, 2000, (0.4, 0.7)),
    "pan": (_pan, 2500, (0.4, 0.7)),
    "fork": (_fork, 2500, (0.4, 0.7)),
    "knife": (_knife, 2500, (0.4, 0.7)),
    "spoon": (_spoon, 2500, (0.4, 0.7)),
    "spatula": (_spatula, 1200, (0.4, 0.7)),
    "candle": (_candle, 900, (0.5, 0.8)),
    "pitcher": (_pitcher, 1500, (0.4, 0.7)),
}


def procedural_objects(count: int = 680, seed: int = 0, first: int = 0) -> list[ObjectModel]:
    """Return `count` objects but those before `first`, cycling through the kinds, so that every prefix is balanced.

    Same seed, same objects.
    """
    kinds = list(KINDS)
    return [procedural_object(kinds[i % len(kinds)], i // len(kinds), seed) for i in range(first, count)]


def procedural_object(kind: str, index: int, seed: int = 0) -> ObjectModel:
    """Return the object number `index` of a kind.

    Raises:
        KeyError: for an unknown kind; `KINDS` lists them.
    """
    entry = KINDS[kind]
    rng = np.random.default_rng((seed, list(KINDS).index(kind), index))
    return made(f"{kind}_{seed}_{index:03d}", kind, entry, rng)


def made(name: str, category: str, kind: Kind, rng: Range) -> ObjectModel:
    """Build an object of a kind; everything that the kind leaves open is drawn at random."""
    builder, density, (slippery, rough) = kind
    hulls = builder(rng)
    return assemble(
        name,
        category,
        hulls,
        density=density,
        friction=float(rng.uniform(slippery, rough)),
        color=colorsys.hsv_to_rgb(rng.random(), rng.uniform(0.35, 0.8), rng.uniform(0.6, 0.95)),
        source="procedural",
        rng=rng,
    )

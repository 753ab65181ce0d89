"""Copies to the millimetre: the places that an example shows, and how far objects are from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from grounding.figures.figure import MOST_COPIED, ON_TABLE, Figure, FigureError, FigurePlace
from structdiffusion.figures.curves import similarity
from structdiffusion.figures.example import Example
from structdiffusion.footprints import turned

_ROUND = 0.88  # of its box, that an outline covers which looks the same from all sides; a disc covers 0.79
_SQUARE = 0.004  # m by which the sides of a box differ whose quarter turns look the same
_TURNS = 36  # headings from which the best one is sought
_ROUNDS = 4  # of giving objects to places, and laying the copy over the example


@dataclass(frozen=True)
class Fit:
    """How objects stand in the places of an exact copy.

    Attributes:
        order: (N,) the object in each place.
        heading: by which the example is turned, rad.
        off: (N,) m by which each place is missed, in space.
        turned: (N,) rad by which each object is turned otherwise; 0 for what is round.
    """

    order: np.ndarray
    heading: float
    off: np.ndarray
    turned: np.ndarray


def box_of(outline: np.ndarray) -> tuple[float, float, float | None]:
    """Return the length and width (m) of the box of a convex outline (K, 2), and the angle (rad) of its length.

    The angle is `None` for an outline that looks the same from all sides.
    """
    box = np.array(shapely.oriented_envelope(shapely.Polygon(outline)).exterior.coords)[:4]
    sides = np.diff(box[:3], axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    long = int(lengths.argmax())
    length, width = float(lengths[long]), float(lengths[1 - long])
    if length - width < _SQUARE + 0.1 * length and shapely.Polygon(outline).area < _ROUND * length * width:
        return length, width, None
    return length, width, math.atan2(sides[long][1], sides[long][0])


def copy_of(example: Example, name: str, nouns: Sequence[str]) -> Figure:
    """Return the figure with the very places that an example shows.

    Raises:
        FigureError: for an example whose heights are not known, too many objects, or one that stands on nothing.
    """
    if example.tops is None:
        raise FigureError("it does not say how high its objects stand, so it cannot be copied exactly")
    if len(example.middles) > MOST_COPIED:
        raise FigureError(f"it has {len(example.middles)} objects; an exact copy can have at most {MOST_COPIED}")
    low = min(0.0, float(example.bottoms.min()))
    middle = example.middles.mean(axis=0)
    places = []
    for outline, at, bottom, top, carriers in zip(
        example.outlines,
        example.middles - middle,
        example.bottoms - low,
        example.tops - low,
        example.rests_on,
        strict=True,
    ):
        if bottom > ON_TABLE and not carriers:
            raise FigureError(f"an object stands {bottom * 1000:.0f} mm above the table on nothing")
        length, width, turn = box_of(outline)
        size = (round(length, 4), round(width, 4), round(float(top - bottom), 4))
        degrees = None if turn is None else round(math.degrees(turn) % 180.0, 1)
        z = round(float(bottom), 4) if bottom > ON_TABLE else 0.0
        places.append(FigurePlace(round(float(at[0]), 4), round(float(at[1]), 4), z, size, degrees))
    return Figure(name, tuple(nouns), places=tuple(places), least=len(places))


def carriers_of(places: Sequence[FigurePlace]) -> list[list[int]]:
    """Return for each place those that carry it: where tops meet its bottom below it; [] is the table."""
    boxes = [shapely.Polygon(box_outline(place)) for place in places]
    found: list[list[int]] = []
    for k, place in enumerate(places):
        under = [
            j
            for j, other in enumerate(places)
            if place.z > ON_TABLE and other.z < place.z - ON_TABLE and boxes[k].intersection(boxes[j]).area > 1e-5
        ]
        highest = max((places[j].z + places[j].size[2] for j in under), default=0.0)
        found.append([j for j in under if places[j].z + places[j].size[2] > highest - ON_TABLE])
    return found


def box_outline(place: FigurePlace) -> np.ndarray:
    """Return the corners (4, 2) of a place's box."""
    length, width, _ = place.size
    corners = np.array([[length, width], [-length, width], [-length, -width], [length, -width]]) / 2
    return turned(corners, math.radians(place.turn or 0.0)) + (place.x, place.y)


def alike(sizes: np.ndarray, places: Sequence[FigurePlace]) -> np.ndarray:
    """Return how unlike (m) boxes (N, 3) are to those of places: (P, N), the largest difference of a side."""
    wanted = np.array([place.size for place in places])
    return np.abs(wanted[:, None] - sizes[None]).max(axis=2)


def fit(
    middles: np.ndarray,
    bottoms: np.ndarray,
    boxes: Sequence[tuple[float, float, float | None]],
    heights: np.ndarray,
    places: Sequence[FigurePlace],
    heading: float | None = None,
) -> Fit:
    """Lay a copy over its example, and return how far everything is off.

    Args:
        middles: (N, 2) of the objects' outlines, in any frame.
        bottoms: (N,) above the table.
        boxes: of their outlines.
        heights: (N,).
        places: N of them.
        heading: by which the example is turned, about; `None` if it may be turned anyhow.
    """
    from scipy.optimize import linear_sum_assignment

    drawn = np.array([(place.x, place.y) for place in places])
    unlike = alike(np.column_stack(([box[:2] for box in boxes], heights)), places)
    high = np.array([place.z for place in places])[:, None] - bottoms[None]
    best: Fit | None = None
    starts = [heading] if heading is not None else np.arange(_TURNS) * 2 * math.pi / _TURNS
    for start in starts:
        angle, shift = start, middles.mean(axis=0) - turned(drawn.mean(axis=0)[None], start)[0]
        for _ in range(_ROUNDS):
            there = turned(drawn, angle) + shift
            cost = ((there[:, None] - middles[None]) ** 2).sum(axis=2) + high**2 + unlike**2
            order = linear_sum_assignment(cost)[1]
            _, angle, _ = similarity(drawn, middles[order])
            shift = middles.mean(axis=0) - turned(drawn.mean(axis=0)[None], angle)[0]
        there = turned(drawn, angle) + shift
        off = np.sqrt(((there - middles[order]) ** 2).sum(axis=1) + high[np.arange(len(order)), order] ** 2)
        one = Fit(order, angle, off, np.array([_turn_off(places[k], boxes[i], angle) for k, i in enumerate(order)]))
        if best is None or _worst(one) < _worst(best):
            best = one
    assert best is not None
    return best


def turn_to(place: FigurePlace, box: tuple[float, float, float | None], heading: float) -> float:
    """Return the smallest turn (rad) that brings a box along a place, if the example is turned by a heading (rad)."""
    if place.turn is None or box[2] is None:
        return 0.0
    same = math.pi / 2 if box[0] - box[1] < _SQUARE else math.pi  # turns by which the box looks the same
    off = math.radians(place.turn) + heading - box[2]
    return off - same * round(off / same)


def _turn_off(place: FigurePlace, box: tuple[float, float, float | None], heading: float) -> float:
    return abs(turn_to(place, box, heading))


def _worst(one: Fit) -> float:
    """Return how bad a fit is, m: turns count as far as they move the side of an object of 5 cm."""
    return float((one.off + 0.05 * one.turned).max())

"""What flat structures of part two share: places that are scaled until their objects clear each other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.footprints import tightest_scale, turned
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.sizes import clip_to_size, draw_size_ratio
from structdiffusion.structures.structure import Draft, Structure, Traits, choose_first

# A drawn scene takes the narrowest of so many times as many objects: broad ones fit in small sizes only.
_NARROWEST_OF = 2
_KEPT = 0.004  # m off its exact place at which a sampled object stays; a grid's pitches may differ by four times that
_LITTLE = 0.04  # m: an object that is farther off was not meant for that place, and stays too


class SpreadStructure(Structure):
    """A flat structure whose size is the ratio of its extent to that of the same arrangement drawn together."""

    smaller_to_fit = True

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose the narrowest of the first candidates, unless their nouns were given.

        Raises:
            LayoutError: if there are too few of them.
        """
        if not named:
            some = candidates[: _NARROWEST_OF * wanted]
            narrow = set(map(id, sorted(some, key=lambda one: one.radius)[:wanted]))
            candidates = [one for one in some if id(one) in narrow]
        return choose_first(candidates, wanted, self.name, self.least)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether it can carry a rotation, and there are objects enough for one."""
        return "rotation" in self.slots and len(bodies) >= self.least

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves: near its exact place, then into the size's band.

        Where an object stands on another, none moves.
        """
        if len(bodies) < self.least or any(body.rests_on for body in bodies):
            return super().corrections(bodies, size)
        points = np.array([body.centroid for body in bodies])
        nearer = _nearer(points, self.exact_places(points))
        if size is not None:
            centre = self.centre(bodies)
            ratio = _ratio([body.local_footprint for body in bodies], nearer)
            nearer = centre + clip_to_size(ratio, 1.0, size) / ratio * (nearer - centre)
        return nearer - points

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return where centroids (N, 2) of `least` or more objects would be in the exact structure that is nearest.

        By default they stay: every place is as good.
        """
        return points


def spread_ratio(bodies: Sequence[PlacedBody]) -> float:
    """Return extent over tightest extent: the inverse of the factor at which the bodies would clear
    each other by 1 cm.
    """
    return _ratio([body.local_footprint for body in bodies], np.array([body.centroid for body in bodies]))


def _ratio(outlines: Sequence[np.ndarray], places: np.ndarray) -> float:
    return 1.0 / max(tightest_scale(outlines, places - places.mean(axis=0)), 1e-9)


def _nearer(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return points (N, 2), of which those that miss their places (N, 2) by little are moved nearer to them."""
    off = points - places
    length = np.linalg.norm(off, axis=1, keepdims=True)
    share = np.minimum(1.0, _KEPT / np.maximum(length, 1e-12))
    return places + off * np.where(length > _LITTLE, 1.0, share)


def draft_on_places(
    items: Sequence[LayoutItem],
    places: np.ndarray,
    axes: Sequence[float],
    spec: StructureSpec,
    heading: float,
    rng: np.random.Generator,
) -> Draft:
    """Draw a flat structure: item i on place i, all places scaled to the requested size.

    Args:
        items: the objects.
        places: (N, 2) about the centre, of any scale, in the world's directions.
        axes: the heading (rad) along which a long object lies, for each place.
        spec: the requested structure.
        heading: of the structure frame, radians.
        rng: of an open size.
    """
    turns = np.array([item.turn_to_axis(axis) for item, axis in zip(items, axes, strict=True)])
    outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
    scale = draw_size_ratio(spec, rng) * tightest_scale(outlines, places)
    return Draft(tuple(range(len(items))), scale * places, np.zeros(len(items)), turns, heading)


def outward_axes(places: np.ndarray) -> list[float]:
    """Return the heading (rad) from the centre to each place (N, 2)."""
    return [math.atan2(y, x) for x, y in places]


def rotated(places: np.ndarray, heading: float) -> np.ndarray:
    """Return places (N, 2) of a structure frame in the world's directions."""
    return turned(places, heading)

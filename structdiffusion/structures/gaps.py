"""Lay out structures with equal clear gaps between neighbours, for objects of any sizes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import CLEARANCE, SIZE_BANDS, max_gap_off
from structdiffusion.footprints import separation_along, tightest_scale, turned
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.structure import Draft, LayoutError, a_structure

KEPT = 0.7  # of what the evaluation protocol lets gaps, lengths and radii be off, that layouts keep
_ROUNDS = 8  # of turning objects to where they stand, and measuring their gaps there
_NARROWER = 0.003  # m by which a gap may be narrower than a requested one of less than 1 cm
TRIES = 150  # orders of the objects that are tried where their sizes have to match


def require_size(name: str, size: str | None, ratio: float, why: str) -> None:
    """Raise a `LayoutError` if a key forces another size than the requested one."""
    if size is None:
        return
    low, high = SIZE_BANDS[size]
    if not low <= ratio < high:
        raise LayoutError(
            f"{a_structure(f'{size} {name}')} cannot have {why} with these objects: it would be {ratio:.2f} "
            "times as wide as the "
            f"tightest one; {size} is {low:g}{f' to {high:g}' if math.isfinite(high) else ' or more'}"
        )


def require_clear(name: str, outlines: Sequence[np.ndarray], offsets: np.ndarray, why: str, gap: float) -> None:
    """Raise a `LayoutError` where objects come closer than 1 cm, or than about a narrower requested gap."""
    clearance = min(CLEARANCE, max(gap - _NARROWER, 0.0))
    scale = tightest_scale(outlines, offsets, clearance)
    if scale > 1.0 + 1e-6:
        raise LayoutError(
            f"{a_structure(name)} of these objects cannot have {why}: some would come closer to each other than "
            f"{clearance * 100:.1f} cm; it would have to be {scale:.2f} times as wide"
        )


def draft_with_gap(
    name: str,
    spec: StructureSpec,
    order: Sequence[int],
    outlines: Sequence[np.ndarray],
    offsets: np.ndarray,
    turns: np.ndarray,
    heading: float,
    gap: float,
    why: str = "",
) -> Draft:
    """Make the draft of objects that were placed with a clear gap, if they clear each other and have the requested
    size.

    Args:
        name: of the structure.
        spec: the requested structure.
        order: (N,) item indices, place by place.
        outlines: of the objects as they are turned, by place.
        offsets: (N, 2) of the places from the centre, metres.
        turns: (N,) by place, radians.
        heading: of the structure frame, radians.
        gap: the requested one, metres.
        why: what forces the places, for messages; by default the gap.

    Raises:
        LayoutError: if objects come too close to each other, or the size is another.
    """
    why = why or f"gaps of {gap:.3g} m"
    require_clear(name, outlines, offsets, why, gap)
    require_size(name, spec.size, 1.0 / tightest_scale(outlines, offsets), why)
    return Draft(tuple(order), offsets, np.zeros(len(offsets)), turns, heading)


def ring_angles(
    items: Sequence[LayoutItem],
    gap: float,
    start: Callable[[np.ndarray], float],
    span: Callable[[np.ndarray], float],
    radius: float | None = None,
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return where objects stand on a circle with one clear gap between neighbours.

    Args:
        items: by place, counter-clockwise.
        gap: between each and the next, metres.
        start: the angle (rad) of the first, as a function of the angles (N,) from each to the next, and from the last
            to the first, at which these are neighbours.
        span: the sum (rad) that these angles have to have, as a function of them, because an opening depends on the
            others.
        radius: a given one (m); the span then follows from it.

    Returns:
        The angles (N,) and the radius (m), and the turns (N,) of the objects, whose long axes lie along the radius.

    Raises:
        LayoutError: for a radius at which these objects do not fit side by side.
    """
    count = len(items)
    steps = np.full(count, 2 * math.pi / count)
    angles = start(steps) + steps[0] * np.arange(count)
    found = radius or 0.0
    for _ in range(_ROUNDS):
        turns = np.array([item.turn_to_axis(angle) for item, angle in zip(items, angles)])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        directions = np.column_stack((np.cos(angles), np.sin(angles)))
        chords = np.roll(directions, -1, axis=0) - directions
        lengths = np.array(
            [
                separation_along(outlines[i], outlines[(i + 1) % count], chord / np.linalg.norm(chord), gap)
                for i, chord in enumerate(chords)
            ]
        )
        least = lengths.max() / 2

        def steps_at(r: float, lengths: np.ndarray = lengths) -> np.ndarray:
            return 2 * np.arcsin(np.minimum(lengths / (2 * r), 1.0))

        if radius is None:
            from scipy.optimize import brentq  # takes longer to import than all structures

            def excess(r: float) -> float:
                steps = steps_at(r)
                return float(steps.sum()) - span(steps)

            found = least if excess(least) <= 0 else float(brentq(excess, least, 100 * least))
        elif radius < least:
            raise LayoutError(f"objects {lengths.max():.3f} m apart do not fit on a radius of {radius:.3g} m")
        steps = steps_at(found)
        angles = start(steps) + np.concatenate(([0.0], np.cumsum(steps[:-1])))
    return angles, found, turns


def separations(outlines: Sequence[np.ndarray], direction: np.ndarray, gap: float) -> np.ndarray:
    """Return the distances (N, N), metres, from outline i to j along a direction (2,) at which they leave a gap."""
    count = len(outlines)
    return np.array(
        [
            [separation_along(outlines[i], outlines[j], direction, gap) if i != j else 0.0 for j in range(count)]
            for i in range(count)
        ]
    )


def chain(matrix: np.ndarray, members: Sequence[int]) -> np.ndarray:
    """Return the distances from each member of a chain to the next, of a matrix of `separations`."""
    return matrix[list(members[:-1]), list(members[1:])]


def best_order(
    count: int, error: Callable[[Sequence[int]], float], gap: float, name: str, rng: np.random.Generator
) -> tuple[int, ...]:
    """Return the order of the objects whose gaps are nearest to the requested one.

    Args:
        count: of the objects.
        error: how far (m) the gaps are off, for an order; infinite for one that is impossible.
        gap: the requested one, metres.
        name: of the structure, for messages.
        rng: of the orders that are tried.

    Raises:
        LayoutError: if none is near enough.
    """
    best, least = tuple(range(count)), math.inf
    for _ in range(TRIES):
        order = tuple(int(i) for i in rng.permutation(count))
        if (off := error(order)) < least:
            best, least = order, off
        if least <= 0.2 * max_gap_off(gap):
            break
    if least > KEPT * max_gap_off(gap):
        reason = f"their gaps would be up to {least:.3f} m off" if math.isfinite(least) else "their sizes do not match"
        raise LayoutError(
            f"{a_structure(name)} of these objects cannot have even gaps of {gap:.3g} m: {reason}; "
            f"legal: {max_gap_off(gap):.3f} m"
        )
    return best

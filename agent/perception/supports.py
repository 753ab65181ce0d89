"""Find out which objects stand on others, and how high."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

_LIFTED = 0.02  # m: what begins lower stands on the table, unless it lies within another object
_OVER, _WITHIN = 0.3, 0.7  # of its outline, seen from above, lies over what carries it; or within it
_INSIDE = 0.9  # of its outline lies within that of what carries it, of which it covers less than `_OVER`
_BESIDE = 0.025  # m about its outline, where the surface that carries it is seen
_HIGHER, _LOWER = 0.012, 0.03  # m above and below an object's lower end at which that surface is seen
_LOW_END = 2  # percent of its points lie below its lower end
_CROSSES, _TOP_END = 0.05, 98  # share of its outline over what it seems to stand on; percent of whose points are lower
_SAME = 0.01  # m: what carries an object begins lower than the object by more


@dataclass(frozen=True)
class Support:
    """What an object stands on.

    Attributes:
        carrier: index of the object that carries it; `None` for the table.
        bottom: metres above the table at which it stands.
        seen: whether the surface that carries it was seen beside it; else it seems to stand on what ends where it
            begins.
    """

    carrier: int | None = None
    bottom: float = 0.0
    seen: bool = True


def supports_of(clouds: Sequence[np.ndarray]) -> list[Support]:
    """Return what each object stands on.

    Args:
        clouds: (P, 3) the points of each object, metres, z = 0 on the table.
    """
    outlines = [shapely.linestrings(points[:, :2]).convex_hull for points in clouds]
    ends = [float(np.percentile(points[:, 2], _LOW_END)) for points in clouds]
    return [_support(index, clouds, outlines, ends) for index in range(len(clouds))]


def _support(
    index: int, clouds: Sequence[np.ndarray], outlines: Sequence[shapely.Geometry], ends: Sequence[float]
) -> Support:
    end, outline = ends[index], outlines[index]
    near = outline.buffer(_BESIDE)
    best = Support()
    for other, points in enumerate(clouds):
        shared = outline.intersection(outlines[other]).area
        share = shared / max(outline.area, 1e-9)
        # A spoon on a plate begins hardly higher than the plate.
        higher = 0.0 if share > _INSIDE and shared < _OVER * outlines[other].area else _SAME
        if other == index or share < (_OVER if end > _LIFTED else _WITHIN) or ends[other] >= end - higher:
            continue
        # Seen about its foot: the surface itself is hidden by what stands on it.
        about = points[shapely.contains_xy(near, points[:, 0], points[:, 1]), 2]
        level = about[(about < end + _HIGHER) & (about > end - _LOWER)]
        if len(level) and (best.carrier is None or level.max() > best.bottom):
            best = Support(other, float(min(end, np.percentile(level, 90))))
    return best if best.carrier is not None or end < _LIFTED else _hidden(index, clouds, outlines, ends)


def _hidden(
    index: int, clouds: Sequence[np.ndarray], outlines: Sequence[shapely.Geometry], ends: Sequence[float]
) -> Support:
    """Return what an object seems to stand on that hides all of the surface below it, or is seen from the front alone:
    that crosses its outline and ends where it begins.
    """
    best = Support()
    for other, points in enumerate(clouds):
        shared = outlines[index].intersection(outlines[other]).area
        if other == index or shared < _CROSSES * outlines[index].area or ends[other] >= ends[index] - _SAME:
            continue
        top = float(np.percentile(points[:, 2], _TOP_END))
        if ends[index] - _LOWER < top < ends[index] + _HIGHER and top > best.bottom:
            best = Support(other, min(ends[index], top), False)
    return best

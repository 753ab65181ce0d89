"""Find flat things by their colour: patches that differ from the table around them and end in a step above it.

The errors of a camera are as high as a book of 5 mm, but they are smooth, and a shadow or a stain is no step. How high
a step noise alone makes is measured on the bare table around, with the same outline at other places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from structdiffusion.geometry import lengths

_CONTRAST = 4.0  # standard deviations of the table's colour
_HIGHEST = 0.015  # m above or below the table's surface
_LOW = 0.012  # m: objects that were found by their height and are lower may be a part of a flat thing
_LEAST_PIXELS, _LEAST_AREA, _NARROWEST, _LONGEST = 150, 0.0012, 0.010, 0.4  # m2 and m of a patch
_MOST = 12  # patches that are looked at, the largest first
_RING = 0.015  # m on both sides of the patch's border, where the step is measured
_RING_PIXELS = 4, 14
_SOME = 1200  # pixels of each side are enough
_SHIFTS = 16  # of the outline each way over the picture
_ENOUGH, _BARE = 8, 0.97  # places of the outline on bare table, and the share of it there
_LEAST_STEP = 0.002  # m
_SIGMAS, _OVER_HIGHEST = 4.0, 1.25  # times the steps that noise makes
_EDGE = 0.015  # m from the edge of the table: its side looks like a patch
_GAP, _LONG = 3, 0.2  # pixels of a patch's border, and the share of it that another colour of the same thing takes
_AWAY = 8  # pixels between two pieces in line: the fringe of what is higher is left out
_THIN, _AS_WIDE = 2.5, 1.3  # times as long as wide are two pieces of a fork, and times as wide as one of them
_THICK = 0.02  # m, of the handle of a knife
_OWN = 0.5  # of a low object lies in the patch: it is a part of it; or of the patch in the object


@dataclass(frozen=True)
class TableView:
    """P points about a table, as a camera sees them.

    Attributes:
        level: (P, 3) in the frame of the table's plane, metres.
        heights: (P,) above the table, metres.
        contrast: (P,) how many standard deviations of the table's colour each point is away from it.
        pixels: (P,) the place of each point in the flattened picture.
        shape: (H, W) of the picture.
        eye: (3,) where the camera is.
        outline: of the table.
    """

    level: np.ndarray
    heights: np.ndarray
    contrast: np.ndarray
    pixels: np.ndarray
    shape: tuple[int, int]
    eye: np.ndarray
    outline: shapely.Polygon


@dataclass(frozen=True)
class _Picture:
    """What is known of each pixel (H, W); heights and places are NaN where nothing was measured.

    Attributes:
        heights, places, distances: metres above the table, (H, W, 2) on it, and from the camera.
        labels: the objects, -1 for none.
        candidates: what may be a flat thing; low objects may be parts of one.
        bare: the table.
        low: low objects.
    """

    heights: np.ndarray
    places: np.ndarray
    distances: np.ndarray
    labels: np.ndarray
    candidates: np.ndarray
    bare: np.ndarray
    low: np.ndarray


def with_flat_things(labels: np.ndarray, view: TableView) -> np.ndarray:
    """Return the objects' labels with those of flat things added, or grown where a part of them was known.

    Args:
        labels: (P,) the object of each point, counted from 0; -1 where there is none.
        view: the points.
    """
    picture = _picture(labels, view)
    patches, count = ndimage.label(ndimage.binary_opening(picture.candidates))
    sizes = np.bincount(patches.ravel(), minlength=count + 1)
    found, known = picture.labels.copy(), int(labels.max(initial=-1)) + 1
    for index in [k for k in np.argsort(-sizes[1:]) + 1 if sizes[k] >= _LEAST_PIXELS][:_MOST]:
        patch = ndimage.binary_fill_holes(patches == index) & picture.candidates
        if not _could_be(patch, picture, view.outline) or not _is_step(patch, picture):
            continue
        inside = np.unique(picture.labels[patch & (picture.labels >= 0)])
        own = [k for k in inside if (picture.labels[patch] == k).sum() > _OWN * (picture.labels == k).sum()]
        if any((picture.labels[patch] == k).sum() > _OWN * patch.sum() for k in inside if k not in own):
            continue  # a piece of what is known: something hides its middle
        own += [k for k in _continued(patch, found, picture) if k not in own]
        if own and sum((picture.labels == k).sum() for k in own) > 0.8 * patch.sum():
            continue  # it is known already
        found[patch | np.isin(found, own)] = known
        known += 1
    named = found.ravel()[view.pixels]
    kept = np.unique(named[named >= 0])
    return np.where(named >= 0, np.searchsorted(kept, named), -1)


def _continued(patch: np.ndarray, found: np.ndarray, picture: _Picture) -> list[int]:
    """Return the low objects of which a patch is a part in another colour: they have a long border, or are in line.

    Args:
        patch: (H, W).
        found: (H, W) the objects, with the flat things found so far.
        picture: of the table.
    """
    around = ndimage.binary_dilation(patch, iterations=_GAP) & ~patch
    new = (found >= 0) & (found != picture.labels)
    border = np.bincount(found[around & (picture.low | new)], minlength=1)
    continued = np.flatnonzero(border > _LONG * around.sum()).tolist()
    near = np.unique(found[ndimage.binary_dilation(patch, iterations=_AWAY) & (found >= 0)])
    return continued + [k for k in near if k not in continued and _in_line(patch, found == k, picture)]


def _in_line(patch: np.ndarray, other: np.ndarray, picture: _Picture) -> bool:
    """Return whether two pieces (H, W) follow each other along one thin thing, such as a fork."""
    if np.nanpercentile(picture.heights[other], 95) > _THICK:
        return False
    widths = [_sides(each, picture)[0] for each in (patch, other)]
    wide, long = _sides(patch | other, picture)
    return bool(long > _THIN * wide and wide < _AS_WIDE * max(widths))


def _sides(patch: np.ndarray, picture: _Picture) -> np.ndarray:
    """Return the shorter and the longer side (2,), metres, of the box around a patch (H, W) on the table."""
    places = picture.places[patch]
    around = shapely.multipoints(places[np.isfinite(places).all(axis=1)]).minimum_rotated_rectangle
    if around.geom_type != "Polygon":
        return np.zeros(2)
    corners = np.array(around.exterior.coords)
    return np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))


def _picture(labels: np.ndarray, view: TableView) -> _Picture:
    def spread(values: np.ndarray, other: float) -> np.ndarray:
        size = view.shape[0] * view.shape[1]
        whole = np.full((size, *values.shape[1:]), other, dtype=np.result_type(values, type(other)))
        whole[view.pixels] = values
        return whole.reshape(*view.shape, *values.shape[1:])

    level, heights = view.level, view.heights
    low = np.array([np.percentile(heights[labels == k], 95) < _LOW for k in range(int(labels.max(initial=-1)) + 1)])
    free = (labels < 0) | (np.append(low, False)[labels] if len(low) else True)
    near = np.abs(heights) < _HIGHEST
    near[near] = shapely.contains_xy(view.outline, level[near, 0], level[near, 1])
    there = spread(near & free, False)
    colored = spread(near & free & (view.contrast > _CONTRAST), False)
    # The fringe of an object is neither table nor a thing.
    fringe = ndimage.binary_dilation(spread(~free, False), iterations=_RING_PIXELS[0])
    return _Picture(
        heights=spread(heights, np.nan),
        places=spread(level[:, :2], np.nan),
        distances=spread(lengths(level - view.eye), np.nan),
        labels=spread(labels, -1),
        candidates=colored & ~fringe,
        bare=there & ~fringe & ~ndimage.binary_dilation(colored, iterations=2),
        low=spread(free & (labels >= 0), False),
    )


def _could_be(patch: np.ndarray, picture: _Picture, outline: shapely.Polygon) -> bool:
    """Return whether a patch has the size of a thing and lies on the table, away from its edge."""
    if patch.sum() < _LEAST_PIXELS:
        return False
    around = shapely.multipoints(picture.places[patch]).minimum_rotated_rectangle
    if around.geom_type != "Polygon" or around.area < _LEAST_AREA:
        return False
    corners = np.array(around.exterior.coords)
    sides = np.linalg.norm(np.diff(corners[:3], axis=0), axis=1)
    return bool(sides.min() > _NARROWEST and sides.max() < _LONGEST and outline.exterior.distance(around) > _EDGE)


def _is_step(patch: np.ndarray, picture: _Picture) -> bool:
    """Return whether a patch is higher than the table around it, by more than noise makes it anywhere else."""
    inner, outer = _rings(patch, picture)
    if min(len(inner), len(outer)) < _LEAST_PIXELS // 3:
        return False
    step = _step(inner, outer, picture)
    if step < _LEAST_STEP:
        return False
    own = float(np.median(picture.distances[inner[:, 0], inner[:, 1]]))
    both, size = np.vstack((inner, outer)), np.array(patch.shape)
    others = []
    for down in np.linspace(-1.0, 1.0, 2 * _SHIFTS + 1):
        for across in np.linspace(-1.0, 1.0, 2 * _SHIFTS + 1):
            shift = np.rint((down, across) * size).astype(int)
            moved = both + shift
            if (moved < 0).any() or (moved >= size).any():
                continue
            if picture.bare[moved[:, 0], moved[:, 1]].mean() < _BARE:
                continue
            away = float(np.nanmedian(picture.distances[moved[:, 0], moved[:, 1]]))
            # What a disparity's error makes of the depth grows with the square of the distance.
            others.append(abs(_step(inner + shift, outer + shift, picture)) * (own / away) ** 2)
    if len(others) < _ENOUGH:
        return False
    noise = np.array(others)
    return step > max(_SIGMAS * float(np.sqrt((noise**2).mean())), _OVER_HIGHEST * float(noise.max()))


def _rings(patch: np.ndarray, picture: _Picture) -> tuple[np.ndarray, np.ndarray]:
    """Return pixels (K, 2) on the inner side of a patch's border, and on the table around it."""
    width = int(np.clip(_RING / np.sqrt(_area_of_pixel(patch, picture)), *_RING_PIXELS))
    thick = int(ndimage.distance_transform_cdt(patch).max())
    margin = 2 if thick > 5 else 1
    core = ndimage.binary_erosion(patch, iterations=margin)
    inner = core & ~ndimage.binary_erosion(core, iterations=width)
    outer = ndimage.binary_dilation(patch, iterations=3 + width) & ~ndimage.binary_dilation(patch, iterations=3)
    chosen = [np.argwhere(ring & np.isfinite(picture.heights)) for ring in (inner, outer & picture.bare)]
    inside, outside = (ring[:: len(ring) // _SOME + 1] for ring in chosen)
    return inside, outside


def _area_of_pixel(patch: np.ndarray, picture: _Picture) -> float:
    """Return the area, m2, of the table that a pixel of a patch shows."""
    outline = shapely.multipoints(picture.places[patch]).convex_hull
    rows, columns = np.nonzero(patch)
    seen = shapely.multipoints(np.column_stack((rows, columns))).convex_hull
    return float(outline.area / max(seen.area, 1.0))


def _step(inner: np.ndarray, outer: np.ndarray, picture: _Picture) -> float:
    """Return how much higher, metres, pixels (K, 2) are than others around them, on a plane through both."""
    both = np.vstack((inner, outer))
    z = picture.heights[both[:, 0], both[:, 1]]
    places = both - both.mean(axis=0)
    terms = np.column_stack((np.arange(len(both)) < len(inner), np.ones(len(both)), places / 100.0))
    known = np.isfinite(z)
    return float(np.linalg.lstsq(terms[known], z[known], rcond=None)[0][0])

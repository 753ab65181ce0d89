"""Find the objects among the points above the table: connected regions that stand on it.

Points more than a centimetre high are clustered first, then lower ones: a table's waves are never that high, and the
low points between two objects would join them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from agent.perception.arbitration import DEFAULT, decided, masks_of_voxels
from agent.perception.clustering import Voxels, clusters, gather, normals, strays
from agent.perception.color_regions import divided_by_regions
from agent.perception.height_map import Relief
from agent.perception.masks import Masks
from agent.perception.merging import flat_things_joined, joined
from agent.perception.occlusion import rejoined
from agent.perception.pieces import Proposals, Surface
from agent.perception.splitting import split

_SEED, _GROW = 3.0, 1.5  # sigma above the table: an object holds points of the first kind, and ends with the second
_LEAST_SEED, _LEAST_GROW = 0.0025, 0.0012  # m
_RISEN = 0.010  # m
_NEAR_TABLE = 0.03  # m: up to there the neighbours' mean gives the height
_TALLEST = 0.6  # m above the table; a person stands there, or the arm
_ASIDE = 0.15  # m beyond the table, within which clusters are followed
_EDGE = 0.02  # m that things may stand over the table's edge, as far as it is seen
_FOOT = 0.008  # m from what has risen: the lower points that belong to it
_WHOLE = 100  # voxels of 4 mm make an object; so much is what a cube of 2.5 cm shows
_FLAT = 40  # are enough for one that is low: a knife shows little more
_SMALL = 20  # are enough where most of them are prominent: a die shows no more
_SPLINTER = 0.015  # m from another object: something small there is a piece of it
_PROMINENT = 12.0  # sigma above the table, and in a colour that is none of the table's
_QUITE_DIFFERENT = 8.0  # standard deviations of the table's colour
_CLEAR = 4.0  # sigma that half of an object is above the table at least
# And times the table's waves: more for what looks like the table, as does what a camera makes up between two surfaces,
# less for what looks quite different.
_WAVES = 6.0
_CONTRASTS, _WAVES_AT = (3.0, 4.0, _QUITE_DIFFERENT), (14.0, 6.0, 4.0)
_CONTRAST = 3.0  # standard deviations of the table's colour: what differs by less looks like the table
_CUT = 0.04  # of an object's voxels lie at the picture's border: most of it may be outside
_DISTINCT = 0.7  # of an object's upper points differ from the table: then its colour shows where it ends
_SKIRT = 0.02  # m: up to there a camera's depth runs from an object over into the table
_RING_CELL, _RING_LOW = 0.006, 0.02  # m, seen from above; and m above the table of a bottom
WIDEST = 0.5  # m: more is a wall, a person, or the edge of something else
_WIDEST_OF_SEVERAL = 1.0  # m: what is wider is not even several objects that touch
_SUPPORTED = 0.7  # of an object's voxels lie over the table


@dataclass(frozen=True)
class Found:
    """The objects among P points.

    Attributes:
        labels: (P,) the object of each point, counted from 0; -1 where there is none.
        count: how many objects.
        left_out: (K, 4) x, y, width and height, level frame, metres, of clusters that are too wide for one object.
    """

    labels: np.ndarray
    count: int
    left_out: np.ndarray


@dataclass(frozen=True)
class Tint:
    """The colours of P points.

    Attributes:
        lab: (P, 3) in CIELAB.
        contrast: (P,) how many standard deviations of the table's colour each is away from it.
    """

    lab: np.ndarray
    contrast: np.ndarray


@dataclass(frozen=True)
class Points:
    """Measured points in the frame of the table's plane, without the arm's.

    Attributes:
        level: (P, 3) metres, z the height above the table.
        eye: (3,) where the camera is.
        relief: their heights.
        steep: (P,) points that may join separate objects; assigned to objects only at the end.
        border: (P,) points at the picture's border.
        tint: their colours, or `None`.
        masks: what the segmentation network sees, or `None`.
    """

    level: np.ndarray
    eye: np.ndarray
    relief: Relief
    steep: np.ndarray
    border: np.ndarray
    tint: Tint | None = None
    masks: Masks | None = None


@dataclass(frozen=True)
class Evidence:
    """What is known of the points above the table before it is decided what is one object.

    Attributes:
        above: (P,) which points these are.
        solid: (P,) those of them that are gathered into voxels.
        voxels: of these.
        tall, itself, sigma, waves: (V,) their heights, smoothed near the table and not, and the table's noise, metres.
        contrast: (V,) their colours' distance from the table's, or `None`.
        left_out: (K, 4) what is too wide, as `Found` has it.
        surface, proposals: what objects are decided from.
    """

    above: np.ndarray
    solid: np.ndarray
    voxels: Voxels
    tall: np.ndarray
    itself: np.ndarray
    sigma: np.ndarray
    waves: np.ndarray
    contrast: np.ndarray | None
    left_out: np.ndarray
    surface: Surface
    proposals: Proposals


def find_objects(points: Points, method: str = DEFAULT) -> Found:
    """Find the objects on the table.

    Args:
        points: what was measured.
        method: who tells objects apart, one of `METHODS`.
    """
    level, relief, tint = points.level, points.relief, points.tint
    labels = np.full(len(level), -1)
    seen = evidence_of(points)
    if seen is None:
        return Found(labels, 0, np.empty((0, 4)))
    voxels = seen.voxels
    of_voxel = decided(seen.surface, seen.proposals, method)
    of_voxel = np.where(_clear(of_voxel, seen.itself, seen.sigma, seen.waves, seen.contrast), of_voxel, -1)
    prominent = seen.tall > _PROMINENT * seen.sigma
    prominent &= seen.contrast is not None and seen.contrast > _QUITE_DIFFERENT
    cut = voxels.mean(points.border[seen.solid].astype(np.float64)) > 0
    of_voxel, too_wide = _without_the_wide(of_voxel, voxels.positions, WIDEST)
    of_voxel = _objects(of_voxel, voxels, seen.tall, prominent, cut, relief.outline)
    known = of_voxel >= 0
    if known.any():
        above = seen.above
        _, nearest = cKDTree(voxels.positions[known]).query(level[above], distance_upper_bound=voxels.reach)
        labels[above] = np.append(of_voxel[known], -1)[nearest]
        if tint is not None:
            labels[_table_colored(labels, relief.heights, tint.contrast)] = -1
        labels = _rings_filled(labels, level, relief.heights)
    wide = np.vstack((seen.left_out, too_wide))
    # A wall behind the table was never expected on it.
    return Found(labels, int(of_voxel.max()) + 1, wide[shapely.contains_xy(relief.outline, wide[:, 0], wide[:, 1])])


def evidence_of(points: Points) -> Evidence | None:
    """Gather the points above the table into voxels and connected parts, and propose objects; `None` for too few."""
    level, relief, tint = points.level, points.relief, points.tint
    height = np.where(relief.heights > _NEAR_TABLE, relief.heights, relief.smooth)
    above = (height > np.maximum(_GROW * relief.sigma, _LEAST_GROW)) & (relief.heights < _TALLEST)
    above[above] = shapely.contains_xy(relief.outline.buffer(_ASIDE), level[above, 0], level[above, 1])
    solid = above & ~points.steep
    if solid.sum() < _FLAT:
        return None
    voxels = gather(level[solid])
    tall, sigma, waves = map(voxels.mean, (height[solid], relief.sigma[solid], relief.waves[solid]))
    lab, contrast = (None, None) if tint is None else (voxels.mean(tint.lab[solid]), voxels.mean(tint.contrast[solid]))
    connected, left_out = _without_the_wide(_parts(voxels, tall, sigma), voxels.positions, _WIDEST_OF_SEVERAL)
    # Not the smoothed heights: about a plate's rim these are high where there is table.
    itself = voxels.mean(relief.heights[solid])
    if contrast is not None:  # the table about a plate would be joined to it, and to the spoon beside it
        like_table = _median_of_part(connected, contrast) < _CONTRAST
        connected[like_table & ~_clear(connected, itself, sigma, waves, contrast)] = -1
    places = np.column_stack((voxels.positions[:, :2], tall))
    surface = Surface(places, normals(places, points.eye), lab, points.eye, voxels.reach)
    shapes = grouped(connected, places, surface.normals, lab, points.eye, voxels.reach)
    regions = shapes
    if lab is not None and contrast is not None:
        fringe: np.ndarray = contrast < _CONTRAST
        regions = divided_by_regions(shapes, places, surface.normals, lab, fringe, points.eye, voxels.reach)
    masks = None if points.masks is None else masks_of_voxels(points.masks, voxels, solid, connected)
    return Evidence(
        above, solid, voxels, tall, itself, sigma, waves, contrast, left_out, surface, Proposals(shapes, regions, masks)
    )


def grouped(
    part: np.ndarray, places: np.ndarray, facing: np.ndarray, lab: np.ndarray | None, eye: np.ndarray, reach: float
) -> np.ndarray:
    """Return the object (V,) of each voxel: parts are split into objects, and parts of one object are joined.

    Args:
        part: (V,) the connected part of each voxel, -1 for none.
        places: (V, 3) level frame, z above the table, metres.
        facing: (V, 3) unit normals, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """
    part = flat_things_joined(part, places, reach)
    part = split(part, places, facing, lab, eye, reach)
    part = joined(part, places, facing, lab)
    return rejoined(part, places, facing, lab, eye)


def _median_of_part(part: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the median (V,) of a value over the part of each voxel; NaN where there is none."""
    medians = np.full(len(part), np.nan)
    for index in np.unique(part[part >= 0]):
        medians[part == index] = np.median(values[part == index])
    return medians


def _table_colored(labels: np.ndarray, heights: np.ndarray, contrast: np.ndarray) -> np.ndarray:
    """Return the low points (P,) of objects that look like the table while the rest of the object does not."""
    plain = np.zeros(len(labels), dtype=bool)
    for index in range(int(labels.max()) + 1):
        own = labels == index
        rest = own & (heights > np.median(heights[own]))
        if (contrast[rest] > _CONTRAST).mean() > _DISTINCT:
            plain |= own & (heights < _SKIRT) & (contrast < _CONTRAST)
    return plain


def _rings_filled(labels: np.ndarray, level: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Give the low points within an object's outline to it: the bottom of a bowl may be no higher than noise."""
    labels = labels.copy()
    low = np.flatnonzero((labels < 0) & (np.abs(heights) < _RING_LOW))
    for index in range(int(labels.max()) + 1):
        own = level[labels == index, :2]
        corner = own.min(axis=0) - 2 * _RING_CELL
        cells = np.zeros(((own.max(axis=0) - corner) / _RING_CELL).astype(int) + 3, dtype=bool)
        cells[tuple(((own - corner) / _RING_CELL).astype(int).T)] = True
        holes = ndimage.binary_fill_holes(ndimage.binary_closing(cells)) & ~cells
        if not holes.any():
            continue
        row, column = ((level[low, :2] - corner) / _RING_CELL).T
        inside = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1]) & (labels[low] < 0)
        labels[low[inside][holes[row[inside].astype(int), column[inside].astype(int)]]] = index
    return labels


def _parts(voxels: Voxels, tall: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return the part (V,) of each voxel, -1 for none: first high parts with their feet, then low ones."""
    part = np.full(len(tall), -1)
    risen = (tall > np.maximum(_RISEN, _SEED * sigma)) & ~strays(voxels)
    if risen.any():
        part[risen] = clusters(voxels.positions[risen], voxels.reach)
        risen = part >= 0
    if risen.any() and not risen.all():
        reach = max(_FOOT, voxels.reach)
        _, nearest = cKDTree(voxels.positions[risen]).query(voxels.positions[~risen], distance_upper_bound=reach)
        part[~risen] = np.append(part[risen], -1)[nearest]
    low = (part < 0) & (tall > np.maximum(_LEAST_SEED, _SEED * sigma))
    if low.any():
        found = clusters(voxels.positions[low], voxels.reach)
        part[low] = np.where(found >= 0, found + part.max() + 1, -1)
    return part


def _clear(
    part: np.ndarray, tall: np.ndarray, sigma: np.ndarray, waves: np.ndarray, contrast: np.ndarray | None
) -> np.ndarray:
    """Return the voxels (V,) of parts that stand out from the table's noise, with a higher limit for those coloured
    like the table.
    """
    clear = np.zeros(len(part), dtype=bool)
    for index in np.unique(part[part >= 0]):
        own = part == index
        times = _WAVES
        if contrast is not None:
            times = float(np.interp(np.median(contrast[own]), _CONTRASTS, _WAVES_AT))
        clear[own] = np.median(tall[own] / np.maximum(_CLEAR * sigma[own], times * waves[own])) > 1.0
    return clear


def _objects(
    part: np.ndarray,
    voxels: Voxels,
    tall: np.ndarray,
    prominent: np.ndarray,
    cut: np.ndarray,
    outline: shapely.Polygon,
) -> np.ndarray:
    """Select the parts that are objects, and number them again from 0."""
    of_voxel = np.full(len(part), -1)
    supported = shapely.contains_xy(outline.buffer(_EDGE), voxels.positions[:, 0], voxels.positions[:, 1])
    for index in np.unique(part[part >= 0]):
        members = part == index
        enough = _WHOLE if np.percentile(tall[members], 90) > _RISEN else _FLAT
        if prominent[members].mean() > 0.5 and _by_itself(members, part, voxels.positions, tall):
            enough = _SMALL
        if members.sum() < enough or supported[members].mean() < _SUPPORTED or cut[members].mean() > _CUT:
            continue
        of_voxel[members] = of_voxel.max() + 1
    return of_voxel


def _by_itself(members: np.ndarray, part: np.ndarray, positions: np.ndarray, tall: np.ndarray) -> bool:
    """Return whether something small stands on the table and is not a fragment of its neighbour."""
    others = (part >= 0) & ~members
    if tall[members].min() > _RISEN:
        return False
    # From the few to the many: a tree of the others would take longer than the question.
    return not others.any() or bool(
        cKDTree(positions[members]).query(positions[others], distance_upper_bound=_SPLINTER)[0].min() > _SPLINTER
    )


def _without_the_wide(part: np.ndarray, positions: np.ndarray, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Remove the parts that are too wide; return the rest, and x, y, width and height (K, 4) of those."""
    part, wide = part.copy(), []
    for index in np.unique(part[part >= 0]):
        own = positions[part == index]
        width = float(np.ptp(own[:, :2], axis=0).max())
        if width > widest:
            wide.append((*own[:, :2].mean(axis=0), width, own[:, 2].max()))
            part[part == index] = -1
    return part, np.array(wide).reshape(-1, 4)

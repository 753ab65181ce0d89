"""Describe the pieces that all proposals of objects agree about, alone and in pairs.

Geometry, colours and the segmentation network each divide what stands on the table. A piece is what none of them
divides. Whether two pieces are of one object is decided from what is said of them here (`piece_merging`). Valleys of
the surface only describe: with pieces between valleys, which are many and small, more objects were merged wrongly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from agent.perception.color_division import shadeless
from agent.perception.convexity import convex_pieces
from agent.perception.masks import VoxelMasks

_LEAST, _LEAST_SHARE = 25, 0.05  # voxels of each object that a mask divides a region into, and of the region's
_CERTAIN = 0.87  # masks that divide a region
_ACROSS_VALLEY = 0.8  # of the reach within which voxels are neighbours
_SAMPLE = 120  # voxels of a piece that distances are measured from
_PLAIN = 12.0  # from the median colour
_LEAST_CONTACTS = 3  # pairs of voxels at which two pieces meet
_FARTHEST, _TOGETHER = 0.12, 0.25  # m between pieces that do not meet, and share that a proposal has together
_UNKNOWN = 3.0  # of votes, where one of the pieces has none
_MOST = 4.0  # of values without an upper limit


@dataclass(frozen=True)
class Surface:
    """The voxels of what stands on the table.

    Attributes:
        positions: (V, 3) level frame, z above the table, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """

    positions: np.ndarray
    normals: np.ndarray
    lab: np.ndarray | None
    eye: np.ndarray
    reach: float


@dataclass(frozen=True)
class Proposals:
    """Who divides the voxels how.

    Attributes:
        shapes: (V,) geometry's object of each voxel, -1 for none.
        regions: (V,) the same, divided further where plain colours differ.
        masks: what the segmentation network sees, or `None`.
    """

    shapes: np.ndarray
    regions: np.ndarray
    masks: VoxelMasks | None


@dataclass(frozen=True)
class Piece:
    """What is known of one piece.

    Attributes:
        own: (K,) its voxels.
        sample: (S, 3) positions of some of them.
        levels: (3,) its lower end, middle and upper end above the table, metres.
        sides: (2,) of the box around its outline, metres.
        outline: seen from above.
        facing: (3,) mean normal.
        shade, light, plain: (3,) its colour without shade, its lightness, and the share of its voxels in that colour.
        shapes, regions, valleys, mask: share of its voxels in each object of the proposals; the last is none.
        place, vote: (3,) its middle and the mean vote, in the frame of the votes.
        scatter: of the votes, metres.
        share: mean probability to be of an object.
    """

    own: np.ndarray
    sample: np.ndarray
    levels: np.ndarray
    sides: np.ndarray
    outline: shapely.Geometry
    facing: np.ndarray
    shade: np.ndarray
    light: float
    plain: float
    shapes: np.ndarray
    regions: np.ndarray
    valleys: np.ndarray
    mask: np.ndarray
    place: np.ndarray
    vote: np.ndarray
    scatter: float
    share: float


class Pieces:
    """Divides voxels into pieces, and describes them and pairs of them.

    Args:
        surface: all voxels.
        proposals: of objects; `masks` is not `None`.

    Attributes:
        of_voxel: (V,) the piece of each voxel, counted from 0; -1 where geometry has no object.
    """

    def __init__(self, surface: Surface, proposals: Proposals) -> None:
        assert proposals.masks is not None
        self.surface, self._masks = surface, proposals.masks
        self._shades = None if surface.lab is None else shadeless(surface.lab)
        valleys = _between_valleys(surface, proposals.shapes)
        self._proposals = (proposals.shapes, proposals.regions, valleys, self._masks.of_voxel)
        counts = [int(array.max(initial=-1)) + 2 for array in self._proposals[:3]]
        self._counts = [*counts, len(self._masks.certainty) + 1]
        self.of_voxel = _divided(proposals, self._masks, surface.positions)
        # Where single objects have several colours, another colour is no other object.
        seen = self._masks.of_voxel
        own = [np.flatnonzero(seen == k) for k in range(len(self._masks.certainty))]
        plain = [self._color(voxels)[2] for voxels in own if len(voxels) >= _LEAST]
        self._scene = {
            "plain objects": float(np.mean(plain)) if plain else 0.0,
            "plain object in the middle": float(np.median(plain)) if plain else 0.0,
        }

    def contacts(self) -> dict[tuple[int, int], np.ndarray]:
        """Return the pairs (C, 2) of neighbouring voxels of every two pieces (first, second) that meet."""
        pairs = cKDTree(self.surface.positions).query_pairs(self.surface.reach, output_type="ndarray")
        both = self.of_voxel[pairs]
        across = (both[:, 0] != both[:, 1]) & (both >= 0).all(axis=1)
        pairs, both = pairs[across], both[across]
        if not len(both):
            return {}
        swapped = both[:, 0] > both[:, 1]
        pairs[swapped], both[swapped] = pairs[swapped, ::-1], both[swapped, ::-1]
        order = np.lexsort((both[:, 1], both[:, 0]))
        pairs, both = pairs[order], both[order]
        starts = np.flatnonzero((np.diff(both, axis=0, prepend=-1) != 0).any(axis=1))
        return {
            (int(both[at, 0]), int(both[at, 1])): part
            for at, part in zip(starts, np.split(pairs, starts[1:]), strict=True)
        }

    def describe(self, own: np.ndarray) -> Piece:
        """Describe the piece of some voxels (K,)."""
        positions, votes = self.surface.positions[own], self._masks.votes[own]
        outline = shapely.multipoints(positions[:, :2]).convex_hull.buffer(0.002)
        corners = np.array(outline.minimum_rotated_rectangle.exterior.coords)
        shapes, regions, valleys, mask = (
            np.bincount(array[own] % count, minlength=count) / len(own)  # -1 is the last one
            for array, count in zip(self._proposals, self._counts, strict=True)
        )
        shade, light, plain = self._color(own)
        return Piece(
            own, positions[:: max(1, len(own) // _SAMPLE)], _quantiles(positions[:, 2], (0.05, 0.5, 0.95)),
            np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1)), outline,
            self.surface.normals[own].mean(axis=0), shade, light, plain,
            shapes, regions, valleys, mask,
            self._masks.places[own].mean(axis=0), votes.mean(axis=0),
            float(np.sqrt(votes.var(axis=0).sum())), float(self._masks.share[own].mean()),
        )  # fmt: skip

    def _color(self, own: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Return the colour (3,) of some voxels (K,), their lightness, and the share of them in that colour; 0 where no
        colours are known.
        """
        if self._shades is None or self.surface.lab is None:
            return np.zeros(3), 0.0, 0.0
        shade = np.median(self._shades[own], axis=0)
        plain = float((np.linalg.norm(self._shades[own] - shade, axis=1) < _PLAIN).mean())
        return shade, float(np.median(self.surface.lab[own, 0])), plain

    def may_be_one(self, one: Piece, other: Piece, contacts: int) -> bool:
        """Return whether two pieces could be of one object: they meet, or are near and a proposal says so."""
        if contacts >= _LEAST_CONTACTS:
            return True
        together = one.shapes @ other.shapes + one.mask[:-1] @ other.mask[:-1]
        return bool(together > _TOGETHER and _gap(one, other) < _FARTHEST)

    def features(self, one: Piece, other: Piece, contacts: np.ndarray) -> dict[str, float]:
        """Describe two pieces with `contacts` (C, 2), pairs of neighbouring voxels, between them."""
        if len(one.own) > len(other.own):
            one, other, contacts = other, one, contacts[:, ::-1]
        shared = float(one.outline.intersection(other.outline).area)
        hull = float(one.outline.union(other.outline).convex_hull.area)
        small, large = len(one.own), len(other.own)
        return {
            "voxels of the smaller": np.log(small) / 5,
            "voxels of the larger": np.log(large) / 5,
            "ratio of voxels": small / large,
            "gap": min(_gap(one, other) / 0.02, _MOST),
            "one shape": float(one.shapes @ other.shapes),
            "one region": float(one.regions @ other.regions),
            "no valley": float(one.valleys @ other.valleys),
            **self._of_masks(one, other),
            **self._of_colors(one, other, contacts),
            **{f"{name} of the smaller": v / 0.1 for name, v in zip(_LEVELS, one.levels, strict=True)},
            **{f"{name} of the larger": v / 0.1 for name, v in zip(_LEVELS, other.levels, strict=True)},
            **{f"{name} side of the smaller": v / 0.1 for name, v in zip(_SIDES, one.sides, strict=True)},
            **{f"{name} side of the larger": v / 0.1 for name, v in zip(_SIDES, other.sides, strict=True)},
            "overlap from above": shared / float(one.outline.area),
            "convexity from above": (float(one.outline.area) + float(other.outline.area) - shared) / hull,
            "cosine of normals": float(one.facing @ other.facing),
            "upward normal of the smaller": float(one.facing[2]),
            "upward normal of the larger": float(other.facing[2]),
            **self._of_border(one, contacts),
            **self._scene,
        }

    def _of_masks(self, one: Piece, other: Piece) -> dict[str, float]:
        """Describe what the network says: hard masks, and the votes that these are made of."""
        seen, masks = self._masks, (one.mask[:-1], other.mask[:-1])
        best = [int(mask.argmax()) if mask.max(initial=0.0) > 0 else -1 for mask in masks]
        sure = [0.0 if k < 0 else float(seen.certainty[k]) for k in best]
        apart = _UNKNOWN
        if min(best) >= 0:
            between = float(np.linalg.norm(seen.centres[best[0]] - seen.centres[best[1]]))
            apart = between / max(float(seen.spreads[best[0]] + seen.spreads[best[1]]), 1e-6)
        voted, placed = (float(np.linalg.norm(a - b)) for a, b in ((one.vote, other.vote), (one.place, other.place)))
        return {
            "one mask": float(masks[0] @ masks[1]),
            "one certain mask": float((masks[0] * seen.certainty) @ masks[1]),
            "same main mask": float(best[0] == best[1] and best[0] >= 0),
            "main mask of the smaller": float(masks[0].max(initial=0.0)),
            "main mask of the larger": float(masks[1].max(initial=0.0)),
            "no mask of the smaller": float(one.mask[-1]),
            "no mask of the larger": float(other.mask[-1]),
            "certainty of the smaller": sure[0],
            "certainty of the larger": sure[1],
            "masks apart": min(apart, _MOST),
            "votes apart": min(voted / 0.05, _MOST),
            "votes as far apart as places": min(voted / (placed + 0.01), 2.0),
            "votes apart beyond their scatter": min(voted / (one.scatter + other.scatter + 0.005), _MOST),
            "object at the smaller": one.share,
            "object at the larger": other.share,
        }

    def _of_colors(self, one: Piece, other: Piece, contacts: np.ndarray) -> dict[str, float]:
        known = self._shades is not None
        across = 0.0
        if self._shades is not None and len(contacts):
            across = float(
                np.median(np.linalg.norm(self._shades[contacts[:, 0]] - self._shades[contacts[:, 1]], axis=1))
            )
        return {
            "colours known": float(known),
            "colours apart": min(float(np.linalg.norm(one.shade - other.shade)) / 20, _MOST),
            "lighter": (one.light - other.light) / 30,
            "plain smaller": one.plain,
            "plain larger": other.plain,
            "colours apart at the border": min(across / 20, _MOST),
        }

    def _of_border(self, one: Piece, contacts: np.ndarray) -> dict[str, float]:
        """Describe how long the border is, and how the surfaces lean and step there."""
        if not len(contacts):
            return dict.fromkeys(_BORDER, 0.0)
        positions, normals = self.surface.positions, self.surface.normals
        first, second = contacts.T
        across = positions[first] - positions[second]
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
        lean = ((normals[first] - normals[second]) * across).sum(axis=1)
        joint = normals[first] + normals[second]
        joint /= np.maximum(np.linalg.norm(joint, axis=1, keepdims=True), 1e-9)
        step = np.abs((joint * across).sum(axis=1))
        away = [np.linalg.norm(positions[index] - self.surface.eye, axis=1) for index in (first, second)]
        values = (
            np.log1p(len(contacts)) / 5, len(np.unique(first)) / len(one.own), float(lean.mean()),
            float(_quantiles(lean, (0.25,))[0]), float(step.mean()), float((away[0] - away[1]).mean()) / 0.01,
        )  # fmt: skip
        return dict(zip(_BORDER, values, strict=True))


_LEVELS, _SIDES = ("lower end", "middle", "upper end"), ("short", "long")
_BORDER = ("contacts", "share at the border", "lean", "least lean", "step", "farther")


def _between_valleys(surface: Surface, shapes: np.ndarray) -> np.ndarray:
    """Return the part (V,) of each voxel, -1 for none: geometry's objects, divided at every valley."""
    valleys = np.full(len(shapes), -1)
    for index in np.unique(shapes[shapes >= 0]):
        own = np.flatnonzero(shapes == index)
        shades = None if surface.lab is None else surface.lab[own]
        pieces = convex_pieces(surface.positions[own], surface.normals[own], _ACROSS_VALLEY * surface.reach, shades)
        valleys[own] = pieces + valleys.max() + 1
    return valleys


def _divided(proposals: Proposals, masks: VoxelMasks, positions: np.ndarray) -> np.ndarray:
    """Return the pieces (V,): the regions, divided where the network is certain of several objects
    that are no slivers.
    """
    piece = proposals.regions.copy()
    for index in np.unique(piece[piece >= 0]):
        own = np.flatnonzero(piece == index)
        mask = masks.of_voxel[own]
        count = np.bincount(mask[mask >= 0], minlength=len(masks.certainty))
        several = np.flatnonzero((count >= max(_LEAST, _LEAST_SHARE * len(own))) & (masks.certainty >= _CERTAIN))
        if len(several) < 2:
            continue
        known = np.isin(mask, several)
        if not known.all():
            nearest = cKDTree(positions[own[known]]).query(positions[own[~known]])[1]
            mask[~known] = mask[known][nearest]
        for number in several[1:]:
            piece[own[mask == number]] = piece.max() + 1
    known = piece >= 0
    piece[known] = np.unique(piece[known], return_inverse=True)[1]
    return piece


def _gap(one: Piece, other: Piece) -> float:
    """Return about how far two pieces are apart, metres."""
    return float(cdist(one.sample, other.sample).min())


def _quantiles(values: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
    """Return the values that such shares of all are below; numpy's quantiles take ten times as long for a few."""
    return np.sort(values)[(np.array(shares) * (len(values) - 1)).round().astype(int)]

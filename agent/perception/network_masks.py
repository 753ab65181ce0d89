"""Turn what the segmentation network says about pixels into masks: one for each object that it sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.perception.masks import Masks
from agent.segmentation_network.features import WIDTH, chosen_of_blocks, features
from agent.segmentation_network.network import Seen, SegmentationNetwork
from structdiffusion.geometry import lengths

_MEMBER = 0.5  # of a vote to belong to an object, where 1 is the object's mean vote
_POSSIBLE = 0.02  # of a vote that belongs to no object: still the likeliest one's
_LEAST_SEED = 0.4  # of the vote that an object is found by
_LEAST = 25  # pixels of the picture of 160 x 120: what is smaller is left to geometry
_NEW = 0.5  # of the votes about a seed belong to no object yet
_MOST = 80  # objects
_OBJECT = 0.5  # probability of a pixel that votes


@dataclass(frozen=True)
class Sight:
    """An organised measurement in the frame of the table.

    Attributes:
        level: (P, 3) points, z up, x the camera's direction of view, metres.
        heights: (P,) above the table.
        eye: (3,) where the camera is.
        pixels: (P,) the place of each in the flattened picture.
        shape: of the picture.
        pitch: tangent of the angle between neighbouring pixels.
        lab: (P, 3) colours in CIELAB, or `None`.
    """

    level: np.ndarray
    heights: np.ndarray
    eye: np.ndarray
    pixels: np.ndarray
    shape: tuple[int, int]
    pitch: float
    lab: np.ndarray | None


def pixel_pitch(points: np.ndarray) -> float:
    """Return the tangent of the angle between neighbouring pixels of an organised cloud (H, W, 3) in a camera frame."""
    with np.errstate(invalid="ignore", divide="ignore"):
        across = points[..., 0] / points[..., 2]
        steps = np.abs(np.diff(across[:: max(1, len(across) // 60)], axis=1))
    return float(np.median(steps[np.isfinite(steps)]))


def network_masks(sight: Sight, network: SegmentationNetwork) -> Masks:
    """Let the network look at a measurement and return the objects that it sees."""
    height, width = sight.shape
    size = max(1, round(width / WIDTH))
    place = np.full(height * width, -1)
    place[sight.pixels] = np.arange(len(sight.pixels))
    distance = np.full(height * width, np.nan)
    distance[sight.pixels] = lengths(sight.level - sight.eye)
    chosen = place[chosen_of_blocks(distance.reshape(height, width), size)]
    rows, columns = chosen.shape
    chosen = np.pad(chosen, ((0, rows % 2), (0, columns % 2)), constant_values=-1)
    known = chosen >= 0
    level = np.where(known[..., None], sight.level[chosen], np.nan)
    shades = None if sight.lab is None else sight.lab[chosen]
    seen = network(features(level, sight.heights[chosen], sight.eye, size * sight.pitch, shades))
    labels, centres, spreads, certainty = decoded(seen, level, known)
    block = _nearest_block(sight, size, level)
    votes = (np.where(known[..., None], level, 0.0) + seen.votes.transpose(1, 2, 0)).reshape(-1, 3)[block]
    share = np.where(known, seen.classes[2], 0.0).ravel()[block]
    return Masks(labels.ravel()[block], share, certainty, centres, spreads, votes)


def decoded(seen: Seen, level: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Gather votes into objects, from the surest one on.

    Args:
        seen: the network's answer.
        level: (H, W, 3) the points.
        known: (H, W) which of them were measured.

    Returns:
        The object (H, W) of each pixel, -1 for none; the objects' mean votes (M, 3), spreads (M,) and certainties (M,).
    """
    inside = np.flatnonzero((known & (seen.classes[2] > _OBJECT)).ravel())
    votes = (level.transpose(2, 0, 1) + seen.votes).reshape(3, -1)[:, inside].T
    seeds, spread = seen.seeds.ravel()[inside], seen.spread.ravel()[inside]
    own = np.full(len(inside), -1)
    free = seeds.copy()
    centres: list[np.ndarray] = []
    spreads, certainty = [], []
    while len(centres) < _MOST and len(inside) and free.max() > _LEAST_SEED:
        first = int(free.argmax())
        member = _membership(votes, votes[first], spread[first]) > _MEMBER
        fresh = member & (own < 0)
        if fresh.sum() < max(_LEAST, _NEW * member.sum()):
            free[first] = 0.0
            continue
        own[fresh] = len(centres)
        free[fresh] = 0.0
        centres.append(votes[first])
        spreads.append(spread[first])
        certainty.append(float(seeds[fresh].mean()))
    labels = np.full(known.size, -1)
    if centres:
        rest = own < 0
        every = np.stack([_membership(votes[rest], *one) for one in zip(centres, spreads, strict=True)], axis=1)
        own[rest] = np.where(every.max(axis=1) > _POSSIBLE, every.argmax(axis=1), -1) if rest.any() else -1
        labels[inside] = own
    return labels.reshape(known.shape), np.array(centres).reshape(-1, 3), np.array(spreads), np.array(certainty)


def _membership(votes: np.ndarray, centre: np.ndarray, spread: float) -> np.ndarray:
    """Return how far votes (V, 3) belong to an object: 1 at its mean vote."""
    return np.exp(-((votes - centre) ** 2).sum(axis=1) / (2 * spread**2))


def _nearest_block(sight: Sight, size: int, level: np.ndarray) -> np.ndarray:
    """Return for every point (P,) the flat index of the pixel of the network's picture that is nearest in space."""
    rows, columns = level.shape[:2]
    # Axis by axis: sums over three columns would take three times as long.
    points = np.where(np.isfinite(level), level, 1e3).reshape(-1, 3).T.astype(np.float32, order="C")
    row, column = sight.pixels // sight.shape[1] // size, sight.pixels % sight.shape[1] // size
    own = sight.level.T.astype(np.float32, order="C")
    best, least = np.zeros(len(row), dtype=np.int64), np.full(len(row), np.inf, dtype=np.float32)
    for down in (0, -1, 1):
        for right in (0, -1, 1):
            block = np.clip(row + down, 0, rows - 1) * columns + np.clip(column + right, 0, columns - 1)
            x, y, z = (points[axis][block] - own[axis] for axis in range(3))
            off = x**2 + y**2 + z**2
            nearer = off < least
            best[nearer], least[nearer] = block[nearer], off[nearer]
    return best

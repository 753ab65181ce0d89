"""Describe objects that have no name: "object 3, red, tall"."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from structdiffusion.geometry import pose_from_xyz_yaw

_FLAT, _FLAT_FOR_ITS_WIDTH = 0.03, 0.35  # m; of the longer side
_LONG = 2.6  # times the shorter side
_TALL = 1.2  # times the longer side
_LARGE, _SMALL = 2.2, 0.4  # times the middle volume of the objects at hand
_MOST_WORDS = 2
_TOP = 99.5  # percent of the points lie below an object's top; noise lifts the others


def oriented_box(points: np.ndarray, bottom: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the upright box around points (P, 3): its pose (4, 4), x along the longer side, and its sides (3,).

    Args:
        points: of an object, metres.
        bottom: z of what it stands on; 0 is the table.
    """
    top = float(np.percentile(points[:, 2], _TOP))
    corners = np.array(shapely.LineString(points[:, :2]).minimum_rotated_rectangle.exterior.coords)[:4]
    edges = np.roll(corners, -1, axis=0)[:2] - corners[:2]
    lengths = np.linalg.norm(edges, axis=1)
    longer = int(lengths.argmax())
    yaw = float(np.arctan2(edges[longer, 1], edges[longer, 0]))
    center = corners.mean(axis=0)
    return pose_from_xyz_yaw(center[0], center[1], (top + bottom) / 2, yaw), np.array(
        [lengths.max(), lengths.min(), top - bottom]
    )


def shape_words(sides: Sequence[np.ndarray]) -> list[list[str]]:
    """Return shape words for each object with sides (3,) metres that do not also fit all other objects."""
    volumes = np.array([np.prod(np.maximum(side, 0.005)) for side in sides])
    words = []
    for side, volume in zip(sides, volumes, strict=True):
        long, short, height = side
        flat = height < _FLAT and height < _FLAT_FOR_ITS_WIDTH * long
        fits = {
            "flat": flat, "long": long > _LONG * short and long > height, "tall": height > _TALL * long,
            "large": not flat and volume > _LARGE * np.median(volumes),
            "small": not flat and volume < _SMALL * np.median(volumes),
        }  # fmt: skip
        words.append([word for word, fit in fits.items() if fit])
    common = set.intersection(*map(set, words)) if words else set()
    return [[word for word in own if word not in common][:_MOST_WORDS] for own in words]

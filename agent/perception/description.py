"""What an object that nobody has named can be called: "object 3, red, tall"."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from agent.perception.color import lab
from structdiffusion.geometry import pose_from_xyz_yaw

_COLORED, _SATURATED = 12.0, 0.36  # chroma in CIELAB, and by lightness: white things in a cold light have less
_MOSTLY = 0.35  # of an object's points have a colour: then it is that colour, and not the white of its letters
_HUES = (  # degrees in CIELAB, where one colour's name ends and the next begins
    (18.0, "pink"), (48.0, "red"), (73.0, "orange"), (103.0, "yellow"), (175.0, "green"), (225.0, "turquoise"),
    (306.0, "blue"), (338.0, "purple"), (360.0, "pink"),
)  # fmt: skip
_PALE = 62.0  # lightness from which on a red is pink
_DARK = 48.0  # lightness below which an orange or a yellow is brown
_BLACK, _WHITE = 0.35, 0.72  # of the lightness of the brightest things in the picture
_FLAT, _FLAT_FOR_ITS_WIDTH = 0.03, 0.35  # m; of the longer side
_LONG = 2.6  # times the shorter side
_TALL = 1.2  # times the longer side
_LARGE, _SMALL = 2.2, 0.4  # times the middle volume of the objects at hand
_MOST_WORDS = 2
_BORDER = 9.0  # degrees of hue: nearer than this to where a name ends, people use the next name too
_WOODEN, _PALE_WOOD = 48.0, 78.0  # chroma and lightness below which an orange or a yellow is wood's
_PAPER = 95.0  # lightness of white under daylight
_TOP = 99.5  # percent of the points lie below an object's top; noise lifts the others


def oriented_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The upright box about points (P, 3) on the table: its pose (4, 4), x along the longer side, and sides (3,)."""
    top = float(np.percentile(points[:, 2], _TOP))
    corners = np.array(shapely.LineString(points[:, :2]).minimum_rotated_rectangle.exterior.coords)[:4]
    edges = np.roll(corners, -1, axis=0)[:2] - corners[:2]
    lengths = np.linalg.norm(edges, axis=1)
    longer = int(lengths.argmax())
    yaw = float(np.arctan2(edges[longer, 1], edges[longer, 0]))
    center = corners.mean(axis=0)
    return pose_from_xyz_yaw(center[0], center[1], top / 2, yaw), np.array([lengths.max(), lengths.min(), top])


def color_word(colors: np.ndarray, white: float) -> str:
    """The colour's name, as people say it.

    Args:
        colors: (P, 3) of the object's points, in CIELAB.
        white: the lightness of what is white in this light.
    """
    chroma = np.hypot(colors[:, 1], colors[:, 2])
    colored = (chroma > _COLORED) & (chroma > _SATURATED * colors[:, 0])
    if colored.mean() < _MOSTLY:
        plain = colors[~colored, 0]
        # Its bright side: the other lies in its own shade.
        if np.percentile(plain, 75) > _WHITE * white:
            return "white"
        return "black" if np.median(plain) < _BLACK * white else "gray"
    hue = np.degrees(np.arctan2(colors[colored, 2], colors[colored, 1])) % 360
    names = np.searchsorted([end for end, _ in _HUES], hue)
    weight = np.bincount(names, chroma[colored], len(_HUES))
    weight[0] += weight[-1]
    most = int(weight[:-1].argmax())
    name = _HUES[most][1]
    lightness = np.percentile(colors[colored, 0][names == most], 75) if (names == most).any() else 50.0
    if name in ("orange", "yellow") and lightness < _DARK:
        return "brown"
    if name == "red" and lightness > _PALE:
        return "pink"
    return name


def color_terms(rgb: Sequence[float]) -> tuple[str, ...]:
    """Name one plain colour by every word that people may use for it, the likeliest first.

    Args:
        rgb: in [0, 1].
    """
    color = lab((np.clip([rgb], 0.0, 1.0) * 255).round().astype(np.uint8))
    lightness, chroma = float(color[0, 0]), float(np.hypot(color[0, 1], color[0, 2]))
    first = color_word(color, _PAPER)
    if first in ("white", "gray", "black"):
        return (first,)
    hue = float(np.degrees(np.arctan2(color[0, 2], color[0, 1])) % 360)
    near = [_name_of_hue(hue + turn) for turn in (-_BORDER, _BORDER)]
    # Wood and cardboard are brown to most people, and beige or a dull orange or yellow to some.
    if {first, *near} & {"orange", "yellow"} and chroma < _WOODEN and lightness < _PALE_WOOD:
        return tuple(dict.fromkeys(("brown", first, *near, "beige")))
    return tuple(dict.fromkeys((first, *near)))


def _name_of_hue(degrees: float) -> str:
    return next(name for end, name in _HUES if degrees % 360 <= end)


def lightness_of_white(colors: np.ndarray) -> float:
    """The lightness in CIELAB of the brightest things in a picture (..., 3) RGB."""
    flat = colors.reshape(-1, 3)
    return float(np.percentile(lab(flat[:: max(1, len(flat) // 20000)])[:, 0], 99))


def shape_words(sides: Sequence[np.ndarray]) -> list[list[str]]:
    """For each object with sides (3,) metres, the words for its shape that do not fit all the others too."""
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

"""Name colours with the words that people use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.perception.color import lab

_COLORED, _SATURATED = 12.0, 0.36  # chroma in CIELAB, and by lightness: white things in a cold light have less
_MOSTLY = 0.35  # of an object's points have a colour: then it is that colour, and not the white of its letters
_HUES = (  # degrees in CIELAB, where one colour's name ends and the next begins
    (18.0, "pink"), (48.0, "red"), (73.0, "orange"), (103.0, "yellow"), (175.0, "green"), (225.0, "turquoise"),
    (306.0, "blue"), (338.0, "purple"), (360.0, "pink"),
)  # fmt: skip
_PALE = 62.0  # lightness from which on a red is pink
_DARK = 48.0  # lightness below which an orange or a yellow is brown
_BLACK, _WHITE = 0.35, 0.72  # of the lightness of the brightest things in the picture
_BORDER = 9.0  # degrees of hue: nearer than this to where a name ends, people use the next name too
_WOODEN, _PALE_WOOD = 48.0, 78.0  # chroma and lightness below which an orange or a yellow is wood's
_PAPER = 95.0  # lightness of white under daylight


def color_word_in_picture(colors: np.ndarray, picture: np.ndarray) -> str:
    """Name the colour of an object from its points.

    Args:
        colors: (P, 3) uint8 RGB of the points.
        picture: (..., 3) uint8 RGB in which the object was seen; its brightest parts are taken as white.
    """
    return color_word(lab(np.asarray(colors)), lightness_of_white(picture))


def color_word(colors: np.ndarray, white: float) -> str:
    """Name the colour of an object with the word that people use.

    Args:
        colors: (P, 3) of the object's points, in CIELAB.
        white: the lightness of white under this light.
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
    """List every word that people may use for one plain colour, the likeliest first.

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
    """Return the CIELAB lightness of the brightest parts of a picture (..., 3) RGB."""
    flat = colors.reshape(-1, 3)
    return float(np.percentile(lab(flat[:: max(1, len(flat) // 20000)])[:, 0], 99))

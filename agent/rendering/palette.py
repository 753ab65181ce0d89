"""Choose the colour of an object in drawings: its own, the same in the terminal, on the page and in every picture.

Objects of the same colour are distinguished by numbers, names and contrasting outlines.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

RGB = tuple[int, int, int]  # each 0 to 255

# For objects whose own colour is not known, such as those of a cloud without colours: colours that people who see few
# colours tell apart too (Okabe and Ito, without black and yellow).
COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0), (110, 84, 60))
FAINT = (158, 152, 144)  # what takes no part and has no known colour
DARK, LIGHT = (0, 0, 0), (255, 255, 255)
OUTLINE = (58, 48, 38)  # of every object on a light ground
_LIGHT_RIM = (250, 248, 244)
_LOW_CONTRAST = 1.6  # of two colours, below which an outline is needed between them
_BRIGHT = 140  # from this luma on, black is read better than white


def color_of(index: int, own: Sequence[int] | None = None) -> RGB:
    """Return the colour in which object `index` is drawn: its own mean colour, or one of the palette where that is
    unknown."""
    return COLORS[index % len(COLORS)] if own is None else (int(own[0]), int(own[1]), int(own[2]))


def mean_color(colors: np.ndarray | None) -> RGB | None:
    """Return the mean colour of points (P, 3), 0 to 255; `None` if they have none."""
    if colors is None or not len(colors):
        return None
    red, green, blue = np.asarray(colors)[:, :3].mean(axis=0).round().astype(int).tolist()
    return red, green, blue


def luma(color: Sequence[float]) -> float:
    """Return how bright a colour looks, 0 to 255."""
    return 0.299 * color[0] + 0.587 * color[1] + 0.114 * color[2]


def ink_on(color: Sequence[float]) -> RGB:
    """Return black or white, whichever is read better on the colour."""
    return DARK if luma(color) > _BRIGHT else LIGHT


def rim_of(color: Sequence[float]) -> RGB:
    """Return the colour of an outline that contrasts with a colour: light for a dark colour, otherwise dark."""
    return OUTLINE if luma(color) > 110 else _LIGHT_RIM


def alike(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two neighbouring colours are hard to distinguish, so that a line has to separate them."""
    brighter, darker = sorted((_luminance(one), _luminance(other)), reverse=True)
    near = max(abs(a - b) for a, b in zip(one, other, strict=True)) < 60
    return near and (brighter + 0.05) / (darker + 0.05) < _LOW_CONTRAST


def _luminance(color: Sequence[float]) -> float:
    """Return the relative luminance of an sRGB colour, 0 to 1."""
    linear = [(part / 255 / 12.92 if part <= 10 else ((part / 255 + 0.055) / 1.055) ** 2.4) for part in color]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

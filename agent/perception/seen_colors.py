"""Name the colours of objects in a picture, under any light, with how sure each name is.

The light is estimated from the picture and taken out of it, as far as it can be known. Then every pixel is compared
with examples of the names of colours in CIELAB, and the names are counted over the object's pixels. Pixels in the
object's own shade and in highlights do not count: their colour is that of noise, or of the lamp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.perception.color import lab_of_linear, linear

_MOST = 4_000  # pixels of a picture, or of an object, that are looked at
_POWER = 6.0  # of the mean that tells the lamp's colour: between the mean of all things and the brightest one
_STRENGTH = 0.6  # of the correction: a table of wood is brown under a white lamp too
_STRONGEST = 1.35  # factor of a colour channel: lamps for homes differ from daylight by about as much
_WHITE = 0.7  # reflectance of the brightest things in most pictures
_BRIGHTEST, _DIMMEST = 97.0, 0.05  # percent of the pixels are darker; and the least that is taken for white
_SHADE, _GLOSS = 20.0, 95.0  # percent of an object's pixels, by lightness, that are in its shade; or no highlights
_SUNNY = 35.0  # percent likewise: plain things are judged by their bright side
_LIGHTNESS_COUNTS = 0.75  # of a difference in colour: light changes lightness most
_ALIKE = 7.0  # apart in CIELAB: colours that many call by one name
_PLAIN = {"white": (70.0, 100.0), "gray": (36.0, 64.0), "black": (0.0, 26.0)}  # lightness
_PALE, _BLUISH = 8.0, 24.0  # chroma of plain things at most; more of light ones toward blue, the colour of shade
_LIGHT_FROM, _LIGHT = 40.0, 60.0  # lightness: none of that below, all of it above
_CHROMA_COUNTS = 1.5  # of the chroma beyond that: colours are seen sooner than they are named
_DARK = 20.0  # lightness in the picture, below which a camera's noise has more chroma
_MOSTLY = 0.35  # of an object's pixels have a colour: then it is that colour, and not the white of its letters
_DOUBT = 0.6  # of the first name's share: a second name with more may be what others call it
_EXAMPLES = {
    "red": "c81923 960f19 e13732 78141c b42828 ff2a1e 5a0a12 8c5550 78283c",
    "orange": "f58223 e66414 ffa050 d7691e ff6a1e be4b1e d2501e",
    "brown": "6e4123 8c5a37 503223 a06e46 5f3c32 3c2314 7a4a14 966e3c 60460f 8c7355 a08264",
    "yellow": "f5dc32 e1be28 faeb78 c8aa28 fff05a a5871e b49646",
    "green": "28963c 1e6432 6eb446 648232 96c882 324b2d 646e2d 8cc83c 1e3c1e 50c864 788c78",
    "turquoise": "3cbeb4 149696 82d2c8 146e6e 32aa96 50dcd2 287882",
    "blue": "2350b4 1e286e 5a96dc 141e3c 3c6496 96bee1 1e64dc 283c5a 1428ff 0a0ab4 4b5adc 1e6482 5a8296",
    "purple": "783296 5a2864 a56ebe 461e50 963ca0 bea0d2 5a3cb4 8c5a8c 5a2d46",
    "pink": "f082aa e1508c fab4be c86478 eba0a0 ff5ab4 dc8ca0 b4828c",
    "beige": "e1cda5 cdb48c ebdcc3 dcc8a0",
}  # sRGB


@dataclass(frozen=True)
class ColorName:
    """A name that a colour may have.

    Attributes:
        word: the name.
        share: of the object's pixels that have it, 0 to 1.
    """

    word: str
    share: float


def light_of(picture: np.ndarray) -> np.ndarray:
    """Return the factors (3,) of linear red, green and blue by which a picture (..., 3) uint8 RGB would look as under
    white light, well exposed.

    The lamp's colour is estimated by shades of grey (Finlayson and Trezzi, 2004) and corrected in part.
    """
    flat = picture.reshape(-1, 3)
    values = linear(flat[:: max(1, len(flat) // _MOST)]).astype(np.float64)
    level = np.maximum((values**_POWER).mean(axis=0) ** (1 / _POWER), 1e-4)
    white = np.clip((level.mean() / level) ** _STRENGTH, 1 / _STRONGEST, _STRONGEST)
    brightness = values @ (0.2126, 0.7152, 0.0722)
    return white * _WHITE / max(float(np.percentile(brightness, _BRIGHTEST)), _DIMMEST)


def color_names(colors: np.ndarray, light: np.ndarray) -> tuple[ColorName, ...]:
    """Return the name of an object's colour, followed by those that other people may use, the likeliest first.

    Args:
        colors: (P, 3) uint8 RGB of its pixels, at least one.
        light: (3,) of `light_of` the picture.
    """
    some = colors[:: max(1, len(colors) // _MOST)]
    measured = linear(some)
    seen, dark = lab_of_linear(measured * light.astype(np.float32)), lab_of_linear(measured)[:, 0]
    low, middle, high = np.percentile(seen[:, 0], (_SHADE, _SUNNY, _GLOSS))
    squares = np.hstack((_from_examples(seen), _from_plain(seen, dark)))
    likely = np.exp(-0.5 * (squares - squares.min(axis=1, keepdims=True)) / _ALIKE**2)
    likely /= likely.sum(axis=1, keepdims=True)
    colored = likely[:, : len(_EXAMPLES)].sum(axis=1)
    if (colored > 0.5).mean() > _MOSTLY:
        # What has most colour is what people name: not the white letters, and not their edges.
        counted = (colored > 0.5) & (seen[:, 0] >= low) & (seen[:, 0] <= high)
        words, weight = tuple(_EXAMPLES), np.linalg.norm(seen[:, 1:], axis=1) * (counted if counted.any() else colored)
    else:
        words, weight = _WORDS, (seen[:, 0] >= middle) & (seen[:, 0] <= high)
    shares = np.average(likely, axis=0, weights=weight)[: len(words)]
    shares /= shares.sum()
    first, second = np.argsort(-shares)[:2]
    named = (first, second) if shares[second] > _DOUBT * shares[first] else (first,)
    return tuple(ColorName(words[k], float(shares[k])) for k in named)


def _from_examples(seen: np.ndarray) -> np.ndarray:
    """Return the squared distances (P, 10) of colours (P, 3) in CIELAB from the nearest example of each name."""
    away = (((seen[:, None] - _PLACES) * _COUNTS) ** 2).sum(axis=2)
    return np.stack([away[:, k == _OF_EXAMPLE].min(axis=1) for k in range(len(_EXAMPLES))], axis=1)


def _from_plain(seen: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return the same (P, 3) for white, grey and black, which are ranges of lightness with little chroma.

    Args:
        seen: (P, 3) as under white light.
        measured: (P,) lightness in the picture itself.
    """
    lightness = seen[:, :1]
    low, high = np.array(list(_PLAIN.values())).T
    beyond = np.maximum(np.maximum(low - lightness, lightness - high), 0.0) * _LIGHTNESS_COUNTS
    chroma = np.linalg.norm(seen[:, 1:], axis=1, keepdims=True)
    # The share of the chroma that is blue and not turquoise or purple.
    blue = np.clip(-seen[:, 2:] - np.abs(seen[:, 1:2]), 0.0, None) / np.maximum(chroma, 1e-6)
    blue *= np.clip((lightness - _LIGHT_FROM) / (_LIGHT - _LIGHT_FROM), 0.0, 1.0)
    pale = _PALE + (_BLUISH - _PALE) * blue + np.maximum(_DARK - measured[:, None], 0.0)
    return beyond**2 + (_CHROMA_COUNTS * np.maximum(chroma - pale, 0.0)) ** 2


_WORDS = (*_EXAMPLES, *_PLAIN)
_COUNTS = np.array((_LIGHTNESS_COUNTS, 1.0, 1.0), dtype=np.float32)
_OF_EXAMPLE = np.repeat(np.arange(len(_EXAMPLES)), [len(line.split()) for line in _EXAMPLES.values()])
_PLACES = lab_of_linear(
    linear(np.array([list(bytes.fromhex(one)) for line in _EXAMPLES.values() for one in line.split()], dtype=np.uint8))
)

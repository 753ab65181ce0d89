"""Find the colours of points in the fields that clouds have for them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_PACKED = ("rgb", "rgba")
_SEPARATE = (("r", "g", "b"), ("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
COLOR_FIELDS = frozenset((*_PACKED, *(name for names in _SEPARATE for name in names)))
_WHITE = 1.5  # the largest value up to which fractions of white are taken for such, a little overexposed


def colors_of(columns: Mapping[str, np.ndarray], shape: tuple[int, ...]) -> np.ndarray | None:
    """Return the colours (*shape, 3) uint8 RGB of points, or `None`.

    Args:
        columns: name -> (*shape,), or (*shape, K) for a field of K values: four bytes with a colour, as whole number
            or float, in `rgb` or `rgba`; or a field for each of red, green and blue: bytes, 16 bits, or fractions of 1.
        shape: of the points.
    """
    for name in _PACKED:
        if name not in columns:
            continue
        packed = columns[name]
        if packed.shape in ((*shape, 3), (*shape, 4)):
            return _scaled([packed[..., channel] for channel in range(3)])
        if packed.shape == shape and packed.dtype.itemsize >= 4:
            bits = _bits(packed)
            return np.stack([(bits >> shift & 255).astype(np.uint8) for shift in (16, 8, 0)], axis=-1)
    for names in _SEPARATE:
        if all(name in columns and columns[name].shape == shape for name in names):
            return _scaled([columns[name] for name in names])
    return None


def _bits(packed: np.ndarray) -> np.ndarray:
    """Return the four bytes of packed colours as whole numbers; doubles, as text has them, hold either."""
    if packed.dtype.itemsize == 4:
        return packed.view(f"{packed.dtype.str[0]}u4")
    if packed.dtype.kind in "iu":
        return (packed & 0xFFFFFFFF).astype(np.uint32)
    with np.errstate(invalid="ignore", over="ignore"):
        whole = np.isfinite(packed) & (packed >= 0) & (packed < 2**32) & (np.floor(packed) == packed)
        if (whole | ~np.isfinite(packed)).all():
            return np.where(whole, packed, 0).astype(np.uint32)
        return packed.astype(np.float32).view(np.uint32)


def _scaled(channels: list[np.ndarray]) -> np.ndarray | None:
    """Return colours (..., 3) uint8 of three channels alike, by the largest value; `None` where it is none."""
    largest = max(float(np.max(channel, initial=0, where=np.isfinite(channel))) for channel in channels)
    fractions = channels[0].dtype.kind == "f" and largest <= _WHITE
    if largest >= 2**16:
        return None
    factor = 255.0 if fractions else 1.0 if largest < 256 else 1 / 256
    colors = np.empty((*channels[0].shape, 3), np.uint8)
    for channel, values in enumerate(channels):
        if values.dtype == np.uint8:
            colors[..., channel] = values
            continue
        scaled = np.nan_to_num(values.astype(np.float32), posinf=0.0, neginf=0.0) * np.float32(factor)
        # Fractions are rounded, as are values of text; of 16 bits the upper eight are the colour.
        colors[..., channel] = np.clip(np.floor(scaled) if factor < 1 else np.rint(scaled), 0, 255)
    return colors

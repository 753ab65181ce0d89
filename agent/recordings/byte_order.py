"""Find values that were written in the other byte order than their message states."""

from __future__ import annotations

import numpy as np

_ROWS = 200  # of a picture that are looked at
_SMOOTHER = 8.0  # times as smooth a picture of the other order is; a step of one becomes one of 256
_REAL = 1e-4, 1e6  # magnitudes of floating-point depths and coordinates in any unit
_FEW, _MOST = 0.5, 0.9  # shares of real values in the wrong and in the right order


def is_contradicted(values: np.ndarray) -> bool:
    """Return whether values (H, W) of a picture or a cloud make sense only in the other byte order."""
    some = values[:: max(1, len(values) // _ROWS)]
    other = some.view(some.dtype.newbyteorder())
    if some.dtype.kind == "f":
        return _real(some) < _FEW and _real(other) > _MOST
    if some.dtype.itemsize < 2 or some.shape[1] < 2:
        return False
    return _roughness(some) > _SMOOTHER * max(1.0, _roughness(other))


def in_right_order(values: np.ndarray) -> np.ndarray:
    """Return values (H, W) in the byte order in which they make sense, without copying them."""
    return values.view(values.dtype.newbyteorder()) if is_contradicted(values) else values


def note_of(values: np.ndarray, big_endian: bool) -> str:
    """Say that a flag is contradicted by the values (H, W); "" if it is not."""
    if not is_contradicted(values):
        return ""
    stated, right = ("big", "little") if big_endian else ("little", "big")
    return f"is_bigendian = {int(big_endian)} states {stated}-endian values, and they make sense only as {right}-endian"


def _real(values: np.ndarray) -> float:
    """Return the share of values that are no nonsense among those that are finite and not 0 in both orders."""
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.abs(values.astype(np.float64))
        told = size[~np.isnan(size) & (size != 0)]
        return float(((told > _REAL[0]) & (told < _REAL[1])).mean()) if len(told) else 0.5


def _roughness(values: np.ndarray) -> float:
    """Return the median step between neighbours in a row that both measured something."""
    wide = values.astype(np.int64)
    both = (wide[:, 1:] > 0) & (wide[:, :-1] > 0)
    return float(np.median(np.abs(np.diff(wide, axis=1))[both])) if both.any() else 0.0

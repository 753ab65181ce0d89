"""Store a network in eight bits for each weight: its difference to the one that it was trained from, or the weights
themselves.

What training on one more kind of task changes is a fraction of the weights: it needs fewer bits than they do (Liu et
al., "BitDelta: Your Fine-Tune May Only Be Worth One Bit", 2024). Each row of a matrix has a step of its own, and each
weight of it is a whole number of these steps, and a half. Biases and other short arrays are stored as they are.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from safetensors.numpy import save

CODES, STEP = ".codes", ".step"
BITS = 8
_LEAST = 4096  # weights of a matrix that is worth it
_HALF = 2 ** (BITS - 1)

Arrays = Mapping[str, np.ndarray]


def packed(own: Arrays, base: Arrays) -> dict[str, np.ndarray]:
    """Return the arrays to store of a network, row by row: safetensors writes an array as it lies in memory.

    Args:
        own: the network's arrays by name.
        base: those of the network that is subtracted; it may lack some names, or all.
    """
    stored: dict[str, np.ndarray] = {}
    for name, array in own.items():
        if array.ndim == 2 and array.size >= _LEAST:
            under = base[name].astype(np.float32) if name in base else np.float32(0.0)
            stored[name + CODES], stored[name + STEP] = _quantised(array.astype(np.float32) - under)
        else:
            stored[name] = array.astype(np.float16, order="C")
    return stored


def packed_bytes(own: Arrays, base: Arrays, about: Mapping[str, str] = {}) -> bytes:
    """Return the file of a network as its difference to another one, with what else is said about it."""
    return save(packed(own, base), {"bits": str(BITS), **about})


def unpacked(stored: Arrays, base: Arrays) -> dict[str, np.ndarray]:
    """Return a network's arrays from what `packed` made of them and the same base: float32 where they were packed, and
    column by column (numpy's order "F"), as products read them the fastest.

    Raises:
        KeyError: for codes without their steps.
        ValueError: for a base whose arrays have other shapes.
    """
    own: dict[str, np.ndarray] = {}
    for name, array in stored.items():
        if name.endswith(STEP):
            continue
        if not name.endswith(CODES):
            own[name] = array
            continue
        plain = name.removesuffix(CODES)
        # In the order of `bert.Linear`, which is brought about the fastest while a weight is one byte.
        codes = np.asfortranarray(array)
        values = (codes.astype(np.float32) - (_HALF - 0.5)) * stored[plain + STEP].astype(np.float32)[:, None]
        under = base.get(plain)
        if under is not None and under.shape != values.shape:
            raise ValueError(f"{plain!r} has another shape than in the network that it differs from")
        own[plain] = values if under is None else under.astype(np.float32) + values
    return own


def _quantised(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return codes (R, C) uint8 and the step (R,) float16 of each row of values (R, C)."""
    step = np.abs(values).max(axis=1) / _HALF
    step = np.maximum(step, np.float32(np.finfo(np.float16).tiny)).astype(np.float16)
    levels = np.floor(values / step[:, None].astype(np.float32)) + _HALF
    return np.clip(levels, 0, 2 * _HALF - 1).astype(np.uint8, order="C"), step

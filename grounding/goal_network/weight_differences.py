"""Store a network as its difference to another one that it was trained from, in few bits for each weight.

What training on one more kind of task changes is a fraction of the weights: it needs fewer bits than they do (Liu et
al., "BitDelta: Your Fine-Tune May Only Be Worth One Bit", 2024). Each row of a matrix has a step of its own, and each
weight of it is a whole number of these steps, and a half. Biases and other short arrays are stored as they are.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from safetensors.numpy import save

CODES, STEP = ".codes", ".step"
LEGAL_BITS = (2, 4, 8)
_LEAST = 4096  # weights of a matrix that is worth it
# Steps of the best uniform quantiser of normally distributed values, in standard deviations (Max, "Quantizing for
# Minimum Distortion", 1960); 8 bits take the whole range.
_STEPS = {2: 0.9957, 4: 0.3352}

Arrays = Mapping[str, np.ndarray]


def packed(own: Arrays, base: Arrays, bits: int) -> dict[str, np.ndarray]:
    """Return the arrays to store of a network.

    Args:
        own: the network's arrays by name.
        base: those of the network that is subtracted; it may lack some names.
        bits: for each weight, one of `LEGAL_BITS`.

    Raises:
        ValueError: for another number of bits.
    """
    if bits not in LEGAL_BITS:
        raise ValueError(f"bits cannot be {bits}; legal values: {', '.join(map(str, LEGAL_BITS))}")
    stored: dict[str, np.ndarray] = {}
    for name, array in own.items():
        if name in base and array.ndim == 2 and array.size >= _LEAST and array.shape[1] % (8 // bits) == 0:
            codes, step = _quantised(array.astype(np.float32) - base[name].astype(np.float32), bits)
            stored[name + CODES], stored[name + STEP] = codes, step
        else:
            stored[name] = array.astype(np.float16)
    return stored


def packed_bytes(own: Arrays, base: Arrays, bits: int) -> bytes:
    """Return the file of a network as its difference to another one; its metadata has the number of bits."""
    return save(packed(own, base, bits), {"bits": str(bits)})


def unpacked(stored: Arrays, base: Arrays) -> dict[str, np.ndarray]:
    """Return a network's arrays from what `packed` made of them and the same base: float32 where they were packed.

    Raises:
        KeyError: for a base without an array that is needed.
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
        under = base[plain].astype(np.float32)
        bits = 8 * array.shape[1] // under.shape[1]
        if bits not in LEGAL_BITS or len(array) != len(under):
            raise ValueError(f"{plain!r} has another shape than in the network that it differs from")
        own[plain] = under + _values(array, bits) * stored[plain + STEP].astype(np.float32)[:, None]
    return own


def _quantised(values: np.ndarray, bits: int) -> tuple[np.ndarray, np.ndarray]:
    """Return codes (R, C * bits / 8) uint8 and the step (R,) float16 of each row of values (R, C)."""
    half = 2 ** (bits - 1)
    step = np.abs(values).max(axis=1) / half if bits == 8 else _STEPS[bits] * np.sqrt((values**2).mean(axis=1))
    step = np.maximum(step, np.float32(np.finfo(np.float16).tiny)).astype(np.float16)
    levels = np.floor(values / step[:, None].astype(np.float32)) + half
    codes = np.clip(levels, 0, 2 * half - 1).astype(np.uint8)
    each = 8 // bits
    shifted = codes.reshape(len(codes), -1, each) << (bits * np.arange(each, dtype=np.uint8))
    return np.bitwise_or.reduce(shifted, axis=2).astype(np.uint8), step


def _values(codes: np.ndarray, bits: int) -> np.ndarray:
    """Return what codes (R, B) uint8 stand for, in steps: (R, 8 B / bits) float32."""
    each, half = 8 // bits, 2 ** (bits - 1)
    levels = (codes[:, :, None] >> (bits * np.arange(each, dtype=np.uint8))) & (2 * half - 1)
    return levels.reshape(len(codes), -1).astype(np.float32) - half + 0.5

"""Choose the precision of a training step."""

from __future__ import annotations

import time
from functools import cache

import torch

# A step has more than products: it gains only where these are clearly faster. Measured: products 5 to 6.6 times, steps
# 1.5 to 1.9 times as fast with matrix units; products 2.4 times, steps 1.4 times as fast with vector units for it.
# Where bfloat16 is emulated or its products are no faster, steps take 1.4 to 10 times as long.
_GAIN = 1.8


def quick_steps() -> torch.autocast:
    """Return the context in which a step computes; the weights stay float32."""
    return torch.autocast("cpu", dtype=torch.bfloat16, enabled=_bfloat16_is_quick())


@cache
def _bfloat16_is_quick() -> bool:
    """Return whether this processor multiplies matrices much faster in bfloat16 than in float32."""
    return _product_time(torch.float32) > _GAIN * _product_time(torch.bfloat16)


def _product_time(precision: torch.dtype) -> float:
    """Return the shortest of several times of a product, in seconds: the first one prepares,
    others may be disturbed.
    """
    one, other = torch.ones(1024, 384, dtype=precision), torch.ones(384, 1536, dtype=precision)
    times = []
    for _ in range(8):
        started = time.perf_counter()
        one @ other
        times.append(time.perf_counter() - started)
    return min(times)

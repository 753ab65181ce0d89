"""Choose the precision of a training step."""

from __future__ import annotations

import torch

from grounding.parsers.llm_model import quick_dtype


def quick_steps() -> torch.autocast:
    """Return the context in which a step computes; the weights stay float32.

    bfloat16 halves the time of a step where the processor computes with it. Elsewhere it is emulated, and a step takes
    about ten times as long as in float32.
    """
    dtype = quick_dtype()
    return torch.autocast("cpu", dtype=torch.bfloat16, enabled=dtype is torch.bfloat16)

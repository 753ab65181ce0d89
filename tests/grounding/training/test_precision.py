"""A training step computes in bfloat16 only where the processor does."""

import pytest
import torch

from grounding.training import precision


@pytest.mark.parametrize("dtype", [torch.bfloat16, torch.float32], ids=str)
def test_precision_of_a_step(monkeypatch, dtype):
    monkeypatch.setattr(precision, "quick_dtype", lambda: dtype)
    with precision.quick_steps():
        assert (torch.ones(2, 2) @ torch.ones(2, 2)).dtype == dtype

"""A training step computes in bfloat16 only where the processor has tiles for it."""

import pytest
import torch

from grounding.training.precision import quick_steps


@pytest.mark.parametrize(("tiles", "dtype"), [(True, torch.bfloat16), (False, torch.float32)], ids=str)
def test_precision_of_a_step(monkeypatch, tiles, dtype):
    monkeypatch.setattr(torch.cpu, "_is_amx_tile_supported", lambda: tiles, raising=False)
    with quick_steps():
        assert (torch.ones(2, 2) @ torch.ones(2, 2)).dtype == dtype


def test_a_torch_that_cannot_tell_computes_in_float32(monkeypatch):
    monkeypatch.delattr(torch.cpu, "_is_amx_tile_supported", raising=False)
    with quick_steps():
        assert (torch.ones(2, 2) @ torch.ones(2, 2)).dtype == torch.float32

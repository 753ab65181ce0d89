"""A training step computes in bfloat16 only where the processor's products in it are clearly faster."""

import pytest
import torch

from grounding.training import precision


@pytest.fixture(autouse=True)
def _measured_anew():
    precision._bfloat16_is_quick.cache_clear()
    yield
    precision._bfloat16_is_quick.cache_clear()


@pytest.mark.parametrize(
    ("times", "dtype"),
    [(5.0, torch.bfloat16), (2.4, torch.bfloat16), (1.5, torch.float32), (0.1, torch.float32)],
    ids=str,
)
def test_precision_of_a_step(monkeypatch, times, dtype):
    seconds = {torch.float32: times, torch.bfloat16: 1.0}
    monkeypatch.setattr(precision, "_product_time", seconds.get)
    with precision.quick_steps():
        assert (torch.ones(2, 2) @ torch.ones(2, 2)).dtype == dtype


def test_the_products_of_this_processor_take_a_time():
    assert precision._product_time(torch.float32) > 0.0 and precision._product_time(torch.bfloat16) > 0.0

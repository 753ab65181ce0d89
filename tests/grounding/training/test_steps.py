"""Steps lower a loss and are reported; batches hold what is of like length."""

import numpy as np
import pytest
import torch
from torch import nn

from grounding.training.steps import by_length, take_steps


def test_steps_are_taken_and_reported():
    weight, told = nn.Parameter(torch.tensor([3.0])), []
    optimiser = torch.optim.SGD([weight], lr=0.5)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda step: 1.0)
    losses = (weight.square().sum() for _ in iter(int, 1))
    steps = list(take_steps(losses, 4, optimiser, schedule, told.append, 3, lambda: ", more"))
    assert steps == [1, 2, 3, 4]
    assert weight.item() == pytest.approx(1.0)  # each gradient, of norm 6, 5, 4 and 3, is clipped to 1
    assert [line.rpartition(",")[0] for line in told] == [
        "step 3 of 4, loss 6.417, more",
        "step 4 of 4, loss 4.167, more",
    ]


def test_batches_are_of_like_length_and_complete():
    words = ["a" * length for length in (5, 1, 4, 2, 3, 6, 9)]
    batches = list(by_length(iter(words), 2, 3, len, np.random.default_rng(0)))
    assert sorted(map(len, (word for batch in batches for word in batch))) == [1, 2, 3, 4, 5, 6, 9]
    assert {tuple(map(len, batch)) for batch in batches} == {(1, 2), (3, 4), (5, 6), (9,)}

"""Options of the language model's training; the training itself takes too long for a test."""

from __future__ import annotations

import pytest

from grounding.training.llm_adapter import AdapterTraining


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"steps": 0}, "steps must be at least 1, not 0"),
        ({"threads": -1}, "threads must be at least 1, not -1"),
        ({"rate": -1.0}, "rate must be positive, not -1.0"),
    ],
)
def test_illegal_options_are_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        AdapterTraining(**wrong)

"""Training of the embedding parser: two batches, enough to see that everything is written and can be continued."""

from __future__ import annotations

import json
import math

import pytest

from grounding.parsers.embedding import EmbeddingParser
from grounding.training.embedding_parser import BATCH, ParserTraining, train


def test_a_trained_parser_is_written_and_can_be_continued(tmp_path, monkeypatch):
    monkeypatch.setattr("grounding.training.embedding_parser.development_rows", lambda: _some_rows(12))
    config = train(ParserTraining(tmp_path / "one", steps=2))

    assert json.loads((tmp_path / "one/config.json").read_text()) == config
    assert config["sentences"] == 2 * BATCH and config["before"] == 0
    assert config["development"]["exact"]["n"] == 12
    assert EmbeddingParser.from_pretrained(tmp_path / "one").parse("a small circle").parser == "embedding"

    continued = train(ParserTraining(tmp_path / "two", steps=1, start=tmp_path / "one"))
    assert continued["before"] == 2 * BATCH


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"steps": 0}, "steps must be at least 1, not 0"),
        ({"threads": 0}, "threads must be at least 1, not 0"),
        ({"rate": 0.0}, "rate must be positive, not 0.0"),
        ({"rate": math.nan}, "rate must be positive, not nan"),
    ],
)
def test_illegal_options_are_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        ParserTraining(**wrong)


def _some_rows(count):
    from grounding.benchmark import development_rows

    return development_rows()[:count]

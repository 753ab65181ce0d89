"""The real sentence encoder and the trained parser, loaded once for all tests."""

import pytest

from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.sentence_encoder import SentenceEncoder


@pytest.fixture(scope="session")
def encoder():
    return SentenceEncoder()


@pytest.fixture(scope="session")
def parser(encoder):
    return EmbeddingParser.from_pretrained(encoder=encoder)

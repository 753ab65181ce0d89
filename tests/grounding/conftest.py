"""The real sentence encoder and the trained parser, loaded once for all tests."""

import pytest
import torch

from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.sentence_encoder import SentenceEncoder

# Threads that wait for each other on a busy machine make a sentence of ten words thirty times slower.
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def encoder():
    return SentenceEncoder()


@pytest.fixture(scope="session")
def parser(encoder):
    return EmbeddingParser.from_pretrained(encoder=encoder)

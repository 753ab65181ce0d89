"""The real sentence encoder and the trained parser, loaded once for all tests; the language model, converted once."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from grounding.goal_network.writer import NetworkWriter
from grounding.interpreter import Interpreter
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.llm_model import DEFAULT_NAME, cache_folder, checksum, default_folder, default_gguf
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.network import NetworkProposer
from grounding.verify.verifier import Verifier
from tests.sharing import made_once


@pytest.fixture(scope="session")
def encoder():
    return SentenceEncoder()


@pytest.fixture(scope="session")
def parser(encoder):
    return EmbeddingParser.from_pretrained(encoder=encoder)


@pytest.fixture(scope="session")
def proposer(encoder):
    return NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder))


@pytest.fixture(scope="session")
def verifier(encoder):
    return Verifier.from_pretrained(encoder)


@pytest.fixture(scope="session")
def interpreter(parser, encoder, proposer, verifier):
    return Interpreter(lambda: parser, encoder, proposer, lambda: verifier)


@pytest.fixture(scope="session")
def converted(tmp_path_factory) -> Path:
    """A cache folder in which the language model was converted, where a crash had left half a folder."""

    def convert(cache: Path) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(cache))
            half = cache_folder() / f"{DEFAULT_NAME}-{checksum(default_gguf())[:16]}"
            half.mkdir(parents=True)
            (half / "config.json").write_text("{}")
            default_folder()

    return made_once(tmp_path_factory, "converted-language-model", convert)


@pytest.fixture(scope="module")
def cache_with_model(converted) -> Iterator[None]:
    """Lets the tests of a module find the language model converted, whatever the user's cache holds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(converted))
        yield

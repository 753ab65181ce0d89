"""The sentence encoder, against the library that published it."""

import hashlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

from grounding.parsers.sentence_encoder import EncoderError, SentenceEncoder

TEXTS = [
    "put the cups in a small circle on the left",
    "Stack the Cans!",
    "",
    "crème brûlée, 3 Löffel — 茶碗 ☕",
    "a row of boxes " * 80,
]


def test_it_agrees_with_sentence_transformers(encoder):
    library = pytest.importorskip("sentence_transformers")
    model = library.SentenceTransformer(str(encoder.folder), device="cpu")
    theirs = model.encode(TEXTS, normalize_embeddings=True, show_progress_bar=False)
    np.testing.assert_allclose(encoder.encode(TEXTS), theirs, atol=1e-4)


def test_a_batch_gives_what_single_sentences_give(encoder):
    together = encoder.encode(TEXTS, batch_size=3)
    assert together.shape == (5, 384) and together.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(together, axis=1), 1.0, atol=1e-5)
    alone = np.concatenate([encoder.encode([text]) for text in TEXTS])
    np.testing.assert_allclose(together, alone, atol=1e-5)
    assert encoder.encode([]).shape == (0, 384)


def test_sentences_of_one_meaning_lie_closer_than_those_of_two(encoder):
    circle, ring, tower = encoder.encode(["put the cups in a circle", "form a ring of mugs", "stack boxes high"])
    assert circle @ ring > circle @ tower + 0.1


def test_importing_it_loads_no_network_library():
    code = "import grounding.parsers.sentence_encoder, grounding.parsers.embedding, sys; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_lower_layers_alone_are_the_same_network(encoder):
    states = encoder.token_states(TEXTS[:2], 2)
    hidden = states.hidden
    for layer in encoder.network().layers[2:]:
        hidden = layer(hidden, states.mask)
    whole = encoder.token_states(TEXTS[:2]).hidden
    np.testing.assert_allclose(hidden[states.mask], whole[states.mask], atol=1e-5)


def test_encoding_prints_nothing(encoder):
    code = "from grounding.parsers.sentence_encoder import SentenceEncoder; SentenceEncoder().encode(['a line'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "" and done.stderr == ""


@pytest.fixture
def copy(encoder, tmp_path):
    for name in ("config.json", "tokenizer.json", "model.safetensors"):
        shutil.copy(encoder.folder / name, tmp_path / name)
    return tmp_path


def test_broken_weights_are_told(copy, monkeypatch):
    weights = copy / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-1] + b"\x07")
    with pytest.raises(EncoderError, match="has the SHA-256 checksum .* expected 53aa5117"):
        SentenceEncoder(copy).encode(["a line"])
    weights.write_bytes(b"not a network")
    monkeypatch.setattr("grounding.parsers.sentence_encoder.SHA256", hashlib.sha256(b"not a network").hexdigest())
    with pytest.raises(EncoderError, match="model.safetensors cannot be loaded"):
        SentenceEncoder(copy).encode(["a line"])
    weights.unlink()
    with pytest.raises(EncoderError, match="model.safetensors is missing"):
        SentenceEncoder(copy)


def test_another_kind_of_network_is_refused(copy):
    (copy / "config.json").write_text('{"model_type": "gpt2", "hidden_size": 768}')
    with pytest.raises(EncoderError, match="is a gpt2 of width 768; it must be a bert of width 384"):
        SentenceEncoder(copy)


def test_a_network_of_fewer_layers_shares_the_arrays_of_the_whole():
    """The readers need three layers, the planners all: the words alone would be there twice with 47 MB."""
    encoder = SentenceEncoder()
    few, whole = encoder.network(3), encoder.network()
    again = encoder.network(3)
    assert (len(few.layers), len(again.layers), len(whole.layers)) == (3, 3, 6)
    assert again.words is whole.words and all(map(lambda one, other: one is other, again.layers, whole.layers))
    assert encoder.network().layers[5] is whole.layers[5]


def test_the_words_are_read_where_they_are_used():
    """They are a view of the file and equal to what is in it."""
    from safetensors import safe_open

    encoder = SentenceEncoder()
    with safe_open(encoder.folder / "model.safetensors", framework="np") as file:
        words = file.get_tensor("embeddings.word_embeddings.weight")
    found = encoder.network(1).words
    assert found.dtype == np.float32 and not found.flags.owndata and not found.flags.writeable
    assert np.array_equal(found[::997], words[::997])

"""The stored embeddings of the lexicon's nouns, against the encoder."""

import numpy as np

from grounding.resolve.object_names import KNOWN_NOUNS, embed_nouns, stored_embeddings


class OtherEncoder:
    """An encoder of another checksum, which counts what it embeds."""

    checksum = "0" * 64

    def __init__(self):
        self.embedded = []

    def encode(self, texts):
        self.embedded += texts
        return np.ones((len(texts), 384), dtype=np.float32)


def test_the_stored_embeddings_are_those_of_the_encoder(encoder):
    checksum, stored = stored_embeddings()
    assert checksum == encoder.checksum
    nouns = sorted(stored)[::7]
    np.testing.assert_allclose(embed_nouns(nouns, encoder), encoder.encode(nouns), atol=5e-4)  # of float16


def test_nearly_all_known_nouns_are_stored():
    """Else a sentence with an unknown noun takes long: `python -m grounding.training.noun_embeddings`
    stores the rest.
    """
    assert len(set(KNOWN_NOUNS) - set(stored_embeddings()[1])) <= len(KNOWN_NOUNS) // 10


def test_what_is_not_stored_is_embedded(encoder):
    np.testing.assert_array_equal(embed_nouns(["zeppelin"], encoder), encoder.encode(["zeppelin"]))
    other = OtherEncoder()
    assert embed_nouns(["cup", "zeppelin"], other).tolist() == [[1.0] * 384] * 2
    assert other.embedded == ["cup", "zeppelin"]

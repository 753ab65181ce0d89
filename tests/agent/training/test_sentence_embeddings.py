"""The training language: nothing of the corpus is lost, and a changed noun changes nothing else."""

import numpy as np
import pytest

from agent.training.sentence_embeddings import write_language
from grounding.corpus.grammar import OBJECT_WORDS, all_sentences
from grounding.spec import SHAPES
from structdiffusion.word_tokens import VOCABULARY, word_ids


class Recorder:
    """An encoder that notes what it was given; its "embedding" is the number of the text."""

    def encode(self, texts):
        self.texts = list(texts)
        return np.arange(len(texts), dtype=np.float32)[:, None].repeat(384, axis=1) / len(texts)


@pytest.fixture
def written(tmp_path):
    recorder = Recorder()
    count = write_language(tmp_path / "new", recorder)
    with np.load(tmp_path / "new" / "language.npz") as file:
        return count, recorder.texts, file["embeddings"], file["words"]


def test_every_sentence_is_there_with_its_words(written):
    count, texts, embeddings, words = written
    assert count == len(texts) == len(embeddings) == len(words)
    assert embeddings.shape == (count, 384) and words.shape[1] == 5
    np.testing.assert_allclose(embeddings[:, 0], np.arange(count) / count, atol=1e-3)  # in the order of the texts
    found = {(text, tuple(row)) for text, row in zip(texts, words.tolist())}
    missing = [text for text, spec in all_sentences((*SHAPES, None)) if (text, tuple(word_ids(spec))) not in found]
    assert missing == []
    assert set(range(1, VOCABULARY)) == set(words.flatten().tolist()) - {0}


def test_a_changed_noun_keeps_the_rest_of_the_sentence_and_its_words(written):
    _, texts, _, words = written
    corpus = {}
    for text, spec in all_sentences((*SHAPES, None)):
        corpus.setdefault(text, set()).add(tuple(word_ids(spec)))
    changed = [k for k, text in enumerate(texts) if text not in corpus]
    assert len(changed) > 500
    for k in changed:
        before, after = texts[k - 1].split(), texts[k].split()
        assert len(before) == len(after)
        different = [(a, b) for a, b in zip(before, after) if a != b]
        assert len(different) == 1
        assert different[0][0].rstrip(".,!") in OBJECT_WORDS, (texts[k - 1], texts[k])
        assert words[k].tolist() == words[k - 1].tolist()


def test_same_seed_same_nouns(tmp_path):
    recorders = [Recorder(), Recorder(), Recorder()]
    for number, (recorder, seed) in enumerate(zip(recorders, (1, 1, 2))):
        write_language(tmp_path / str(number), recorder, seed)
    assert recorders[0].texts == recorders[1].texts != recorders[2].texts

"""Typing errors are mended towards the words of goals and the objects that are there."""

import pytest

from grounding.goal_reading.spelling import corrected
from grounding.references.object_names import vocabulary

NOUNS = vocabulary(["plate", "knife", "box", "jar", "duck", "hammer"])


@pytest.mark.parametrize(
    ("word", "right"),
    [
        ("palte", "plate"), ("nife", "knife"), ("bxo", "box"), ("jra", "jar"), ("duk", "duck"), ("hamer", "hammer"), ("nex", "next"),
        ("everythin", "everything"), ("evrything", "everything"), ("behnid", "behind"), ("tnx", "thanks"), ("croos", "cross"),
    ],
)  # fmt: skip
def test_typing_errors(word, right):
    assert corrected(word, NOUNS, ()) == right


@pytest.mark.parametrize("word", ["Tim", "bob", "cup", "zzz"])
def test_other_words_stay(word):
    assert corrected(word.lower(), NOUNS, ("tim", "bob")) == word.lower()

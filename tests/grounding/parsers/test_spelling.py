"""Typing errors: mended where the word is unknown, left alone where it is known, traceable to the text."""

import numpy as np
import pytest

from grounding.parsers.spelling import mend


@pytest.fixture(scope="module")
def known(encoder):
    return encoder.whole_words


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("plz mak a smal circl", "please make a small circle"),
        ("stak teh cups at teh bakc", "stack the cups at the back"),
        ("evrything 2 the lfet", "everything to the left"),
        ("towr in the midle, facin rihgt", "tower in the middle, facing right"),
        ("put 2 cups and 4 cans in a row", "put 2 cups and 4 cans in a row"),
        ("puttheplates in a line", "puttheplates in a line"),
        ("ALL CUPS IN A CRICLE", "ALL CUPS IN A circle"),
        ("ask Lina about the line", "ask Lina about the line"),
        ("arrange the tambourines and the gherkins", "arrange the tambourines and the gherkins"),
        ("", ""),
    ],
)
def test_mended(known, typed, meant):
    assert mend(typed, known).text == meant


def test_every_word_is_traceable(known):
    text = "stak teh cups, evrything 2 the lfet"
    mended = mend(text, known)
    first = mended.text.index("everything")
    span = mended.original_span(first, first + len("everything"))
    assert text[slice(*span)] == "evrything"
    assert mended.original_span(len(mended.text), len(mended.text)) is None


@pytest.mark.parametrize(
    ("text", "mended"),
    [
        ("stack object 1 and object 2 on the left", "stack the objects on the left"),
        ("Objects 1, 2, and 13 in a line", "the objects in a line"),
        ("line up the object 1 & object 3", "line up the objects"),
        ("stack object 1 on object 3", "stack object 1 on object 3"),
        ("put object 1 on the left", "put object 1 on the left"),
    ],
)
def test_numbered_objects_are_read_as_several(known, text, mended):
    found = mend(text, known)
    assert found.text == mended
    if "the objects" in mended:
        first = mended.index("the objects")
        assert text[slice(*found.original_span(first, first + 3))][-1].isdecimal()


def test_sentences_without_errors_stay_as_they_are(known):
    from grounding.benchmark import development_rows

    rows = [row for row in development_rows() if row.stratum not in ("typos", "out of scope")]
    changed = [row.text for row in rows if mend(row.text, known).text != row.text]
    assert len(changed) <= 0.03 * len(rows), changed


def test_any_text_is_mended_quickly(known):
    rng = np.random.default_rng(0)
    for _ in range(300):
        text = "".join(chr(c) for c in rng.integers(1, 0x3000, 60))
        words = mend(text, known).words
        assert all(text[first:last] for _, _, first, last in words)
    assert mend("x" * 100_000, known).text == "x" * 100_000

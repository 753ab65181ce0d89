"""Words that nobody knows are found; inflections, names, slips and words of the goal's phrases are not among them."""

import pytest

from grounding.verify.unknown_words import unknown_words


@pytest.mark.parametrize(
    ("text", "copied", "unknown"),
    [
        ("bigger flurb gronk", (), ("flurb", "gronk")),
        ("left gronk", (), ("gronk",)),
        ("put the gorp on the left", ("the", "gorp"), ()),
        ("stack the cans for Agnieszka", (), ()),
        ("a liine of the cups on the lfet", (), ()),
        ("the rightmost cups, spread outwards", (), ()),
        ("stack thecups", (), ()),
    ],
)
def test_unknown_words(encoder, text, copied, unknown):
    assert unknown_words(text, copied, encoder.whole_words) == unknown

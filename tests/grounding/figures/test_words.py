"""Written words: the letters' figures side by side."""

import pytest

from grounding.figures.figure import FigureError
from grounding.figures.names import figure_named


def test_a_word_has_its_letters_side_by_side_on_one_line_and_of_one_height():
    word, h, i = (figure_named(name) for name in ("word HI", "letter H", "letter I"))
    assert word.least == h.least + i.least and len(word.strokes) == len(h.strokes) + len(i.strokes)
    first, second = word.strokes[: len(h.strokes)], word.strokes[len(h.strokes) :]
    assert max(x for stroke in first for x, _ in stroke) + 1 < min(x for stroke in second for x, _ in stroke)
    for letter in (first, second):
        assert (min(y for stroke in letter for _, y in stroke), max(y for stroke in letter for _, y in stroke)) == (
            0,
            2,
        )


@pytest.mark.parametrize(("name", "says"), [
    ("word I♥U", "one word of the letters A to Z and digits"),
    ("word hi", "one word of the letters"),
    ("word HELLO", "needs 28 objects or more; legal: up to 24"),
])  # fmt: skip
def test_what_cannot_be_written(name, says):
    with pytest.raises(FigureError, match=says):
        figure_named(name)

"""Word ids are part of checkpoints: they do not change, and a network refuses those that it does not know."""

import pytest

from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SHAPES, SLOTS, StructureSpec
from structdiffusion.word_tokens import (
    FIRST_VOCABULARY,
    VOCABULARY,
    WORDS,
    UnknownWordError,
    require_known_words,
    word_ids,
)


def test_the_ids_of_the_shipped_networks_stay():
    words = [("shape", shape) for shape in ("circle", "line", "tower", "table setting")]
    words += [(slot, value) for slot in SLOTS[1:] for value in LEGAL_VALUES[slot]]
    assert [WORDS[word] for word in words] == list(range(1, FIRST_VOCABULARY))
    assert sorted(WORDS.values()) == list(range(1, VOCABULARY))
    assert SHAPES[:4] == FIRST_SHAPES


def test_what_is_open_has_the_id_0():
    assert word_ids(StructureSpec()) == [0] * 5
    assert word_ids(StructureSpec("line", x_position="left")) == [2, 0, WORDS["x_position", "left"], 0, 0]


def test_a_word_that_a_network_was_not_trained_on_is_refused():
    spec = StructureSpec("line", size="large")
    require_known_words(spec, FIRST_VOCABULARY, "diffusion")
    with pytest.raises(UnknownWordError, match="'diffusion' was not trained on the size 'large': train it"):
        require_known_words(spec, WORDS["size", "large"], "diffusion")

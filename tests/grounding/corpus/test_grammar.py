"""The grammar: every legal combination, said in at least five ways, each of which says nothing else."""

import os
import subprocess
import sys
from collections import Counter
from itertools import product

import pytest

from grounding.corpus.grammar import all_sentences, legal_specs, sentences
from grounding.spec import FIRST_VALUES, SLOTS, SpecError, StructureSpec


def test_legal_specs_are_exactly_what_the_spec_accepts():
    accepted = set()
    for values in product(*((None, *FIRST_VALUES[slot]) for slot in SLOTS)):
        try:
            accepted.add(StructureSpec(*values))
        except SpecError:
            continue
    accepted.discard(StructureSpec())
    assert set(legal_specs()) == accepted
    assert len(legal_specs()) == len(accepted) == 1055


def test_the_count_per_shape_is_the_product_of_its_open_slots():
    counts = Counter(spec.shape for spec in legal_specs())
    assert counts == {"circle": 320, "line": 320, "tower": 16, "table setting": 80, None: 319}


def test_every_spec_has_five_sentences_and_no_sentence_two_specs():
    table = all_sentences()
    assert len(table) >= 3345
    per_spec = Counter(spec for _, spec in table)
    assert set(per_spec) == set(legal_specs())
    assert min(per_spec.values()) >= 5
    # what the encoder cannot tell apart counts as the same sentence: it lowers all letters
    assert len({text.lower() for text, _ in table}) == len(table)


def test_a_sentence_speaks_of_its_positions_and_rotation_and_of_no_other():
    words_of = {
        "x_position": {"left": {"left"}, "center": {"center", "centered"}, "right": {"right"}},
        "rotation": {value: {value} for value in FIRST_VALUES["rotation"]},
    }
    for text, spec in all_sentences():
        words = set(text.replace("between left and right", "").replace(",", " ").replace("?", " ").split())
        for slot, by_value in words_of.items():
            for value, synonyms in by_value.items():
                assert bool(words & synonyms) == (getattr(spec, slot) == value), (text, spec)


def test_sentences_read_as_english():
    for text, _ in all_sentences():
        assert "  " not in text and " ," not in text and "{" not in text and text == text.strip()
        words = text.split()
        for word, following in zip(words, words[1:], strict=False):
            if word in ("a", "an"):
                assert (word == "an") == (following[0] in "aeiou"), text


def test_an_empty_spec_has_no_sentence():
    with pytest.raises(ValueError, match="at least one slot"):
        sentences(StructureSpec())


def test_the_corpus_is_the_same_in_another_process():
    # another hash seed: no set's order may leak into the sentences
    code = "from grounding.corpus.grammar import all_sentences as t; import zlib; print(zlib.crc32(str(t()).encode()))"
    prints = {
        subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(prints) == 1

"""The files of words of the structures, and what another shape needs."""

import shutil

import pytest

from grounding import structure_words
from grounding.spec import FIRST_SHAPES, SHAPES
from grounding.structure_words import FOLDER, STRUCTURES, StructureWordsError, read_structure, words_of_all

SPIRAL = """\
name = "spiral"
number = 13
slots = ["size", "x_position"]
keys = ["gap"]
least = 3
[words]
nouns = ["spiral", "whorl"]
[grammar]
nouns = ["spiral", "spiral", "spiral", "spiral"]
actions = ["wind the {objects} up{where}"]
[phrases]
noun = ["spiral"]
action = ["coil {o} up"]
"""


def test_the_order_of_the_shapes_is_that_of_the_trained_answers():
    assert tuple(STRUCTURES) == SHAPES
    assert SHAPES[:4] == FIRST_SHAPES == ("circle", "line", "tower", "table setting")
    assert SHAPES[4:] == ("cluster", "rectangle", "square", "triangle", "arc", "grid", "cross", "pyramid")


def test_every_shape_has_a_noun_for_corrections_that_is_never_an_object():
    for structure in STRUCTURES.values():
        assert structure.words.nouns
        assert structure.name.split()[-1] in structure.words.never_objects


def test_another_shape_is_another_file(tmp_path, monkeypatch):
    for file in FOLDER.glob("*.toml"):
        shutil.copy(file, tmp_path)
    (tmp_path / "spiral.toml").write_text(SPIRAL)
    monkeypatch.setattr(structure_words, "FOLDER", tmp_path)
    found = structure_words._all_structures()
    assert list(found)[-1] == "spiral" and found["spiral"].slots == ("size", "x_position")
    assert (found["spiral"].keys, found["spiral"].least) == (("gap",), 3)
    monkeypatch.setattr(structure_words, "STRUCTURES", found)
    assert words_of_all("nouns")[-2:] == ("spiral", "whorl")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("nouns = [\"spiral\", \"whorl\"]", "noun = [\"spiral\"]"),
         r"spiral.toml, \[words\]: unknown key 'noun'; legal keys: nouns,"),
        (("[\"gap\"]", "[\"gaps\"]"), "spiral.toml: keys cannot hold 'gaps'; legal values: order, gap,"),
        (("number = 13\n", ""), "spiral.toml: the key 'number' is missing"),
        (("number = 13", "number ="), "spiral.toml is not a TOML file"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_is_named(tmp_path, change, message):
    (tmp_path / "spiral.toml").write_text(SPIRAL.replace(*change))
    with pytest.raises(StructureWordsError, match=message):
        read_structure(tmp_path / "spiral.toml")


def test_numbers_have_no_gap(tmp_path, monkeypatch):
    (tmp_path / "spiral.toml").write_text(SPIRAL)
    monkeypatch.setattr(structure_words, "FOLDER", tmp_path)
    with pytest.raises(StructureWordsError, match=r"numbered from 1 without gaps, not \[13\]"):
        structure_words._all_structures()

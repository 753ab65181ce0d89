"""The trained network writes the goals of sentences in their own words."""

from __future__ import annotations

import json
import shutil

import pytest

from grounding.goal_network.parts import UnreadLengthError, WrittenParts, parts_of
from grounding.goal_network.vocabulary import Action, keyword
from grounding.goal_network.writer import MOST_SAID, WEIGHTS, GoalNetworkError, NetworkWriter, WrittenGoal, words_of


@pytest.fixture(scope="module")
def writer(encoder):
    return NetworkWriter.from_pretrained(encoder)


def part(**values):
    return values


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "would you kindly perch the teacup upon the saucer",
            [part(kind="relation", objects=["the teacup"], relation="on", reference=["the saucer"])],
        ),
        (
            "cubes in a loop of 12 cm radius please",
            [part(kind="structure", shape="circle", objects=["cubes"], radius=0.12)],
        ),
        (
            "the tins want stacking over on the left",
            [part(kind="structure", shape="tower", objects=["the tins"], x_position="left")],
        ),
    ],
)
def test_sentences_are_read_into_parts(writer, text, parts):
    written = writer.likeliest(text, 3)[0]
    assert 0.0 < written.certainty <= 1.0
    assert parts_of(written, text) == WrittenParts(tuple(parts))


def test_likeliest_goals_are_distinct_and_the_most_certain_first(writer):
    found = writer.likeliest("the tins want stacking over on the left", 4)
    certainties = [each.certainty for each in found]
    assert len({each.actions for each in found}) == 4
    assert certainties == sorted(certainties, reverse=True) and sum(certainties) <= 1.0


def test_a_goal_is_written_where_no_answer_is_wanted(writer):
    found = writer.likeliest("good morning to you", 2, answers=False)
    assert found and all(parts_of(each, "good morning to you").parts for each in found)


def test_no_words_and_too_many_words_are_not_read(writer):
    assert writer.likeliest("", 4) == []
    assert writer.likeliest("stack " * (MOST_SAID + 1), 4) == []
    # More word pieces than it takes.
    assert writer.likeliest("supercalifragilisticexpialidocious " * (MOST_SAID - 1), 4) == []


def test_a_radius_of_a_diameter_is_half_of_it():
    text = "a ring of cups 30 cm across"
    words = words_of(text)
    actions = (keyword("circle of"), Action(1, 3), Action(2, 3), keyword("radius"), Action(1, 4), Action(2, 5))
    found = parts_of(WrittenGoal(tuple(words), actions, 1.0), text)
    assert found.parts[0]["radius"] == pytest.approx(0.15)
    with pytest.raises(UnreadLengthError, match="has 'of cups' for a length"):
        wrong = (*actions[:4], Action(1, 2), Action(2, 3))
        parts_of(WrittenGoal(tuple(words), wrong, 1.0), text)


def test_weights_that_do_not_fit_are_named(tmp_path, encoder):
    with pytest.raises(GoalNetworkError, match="cannot be loaded"):
        NetworkWriter.from_pretrained(encoder, tmp_path)
    shutil.copytree(WEIGHTS, tmp_path / "other")
    config = json.loads((tmp_path / "other/config.json").read_text())
    (tmp_path / "other/config.json").write_text(json.dumps(config | {"keywords": ["one"]}))
    with pytest.raises(GoalNetworkError, match="was trained with other keywords"):
        NetworkWriter.from_pretrained(encoder, tmp_path / "other")
    (tmp_path / "other/config.json").write_text(json.dumps(config | {"encoder_sha256": "0"}))
    with pytest.raises(GoalNetworkError, match="was trained with another sentence encoder"):
        NetworkWriter.from_pretrained(encoder, tmp_path / "other")

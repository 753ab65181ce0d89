"""The trained network writes the goals of sentences in their own words."""

from __future__ import annotations

import json
import shutil

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.beam_search import MOST_SAID, Request, WrittenGoal
from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.parts import UnreadLengthError, WrittenParts, parts_of
from grounding.goal_network.vocabulary import Action, keyword
from grounding.goal_network.writer import WEIGHTS, GoalNetworkError, NetworkWriter
from grounding.resolve.tokens import words_of
from grounding.training.goal_corrections import GoalCorrection, goal_of


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


def test_goals_that_are_written_side_by_side_are_those_that_are_written_alone(writer, monkeypatch):
    objects = goal_scenes()["cans and cups"]
    texts = ["stack the cans", "", "stack " * (MOST_SAID + 1), *(f"put the cups {'in a row ' * k}" for k in range(20))]
    alone = [writer.likeliest(text, 3, objects) for text in texts]
    writer.ahead([Request.of(text, objects) for text in texts], 3)
    with monkeypatch.context() as patch:
        patch.setattr(writer.decoder, "scores", None)  # nothing is written any more
        together = [writer.likeliest(text, 3, objects) for text in texts]
    assert alone[1] == alone[2] == []
    for one, other in zip(alone, together, strict=True):
        assert [each.actions for each in one] == [each.actions for each in other]
        assert [each.certainty for each in one] == pytest.approx([each.certainty for each in other], rel=1e-3)
    writer.ahead([Request.of("stack the cans", objects)], 3)
    assert writer.likeliest("stack the cans", 3)[0].certainty != together[0][0].certainty, "in another scene"


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


@pytest.mark.parametrize(
    ("gap", "said", "metres"),
    [(", gap 4 cm", "make that 6", 0.06), (", gap 4 cm", "ten rather", 0.1), ("", "make that 6", None)],
)
def test_a_bare_number_is_in_centimetres_where_the_goal_so_far_has_some(gap, said, metres):
    row = GoalCorrection("cans and cups", f"line of the cans {{0,1,2}}{gap}.", said, "")
    rendition = rendition_of(goal_of(row.before), goal_scenes()[row.scene])
    words = words_of(f"{rendition.text} {said}")
    place = next(n for n, word in enumerate(words) if word in ("6", "ten"))
    cans = words.index("cans")
    actions = (keyword("line of"), Action(1, cans), Action(2, cans), keyword("gap"), Action(1, place), Action(2, place))
    written = AfterGoal(tuple(words), actions, 1.0, rendition)
    if metres is None:
        with pytest.raises(UnreadLengthError):
            parts_of(written, " ".join(words))
    else:
        assert parts_of(written, " ".join(words)).parts[0]["gap"] == pytest.approx(metres)


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

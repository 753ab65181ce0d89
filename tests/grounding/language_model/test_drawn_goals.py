"""A language model draws what no figure is called: what is asked, what is built, and what is told back to it."""

import re
from dataclasses import replace

import pytest

from grounding.figures.drawings import drawing_shape
from grounding.figures.files import write_figure
from grounding.figures.names import VARIABLE, figure_named
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpreter import Interpreter
from grounding.language_model.goal_model import GoalModel
from grounding.parsers.llm_endpoint import EndpointLLM
from tests.grounding.language_model.artist import HOOK, NOTHING, SAILBOAT, Artist, build, drawn
from tests.grounding.language_model.oracle import MODEL, serving_oracle

NAMES = ["can", "can 2", "can 3", "can 4", "can 5", "can 6", "can 7", "mug"]
CANS = {"objects": [0, 1, 2, 3, 4, 5, 6]}
BESIDE = {"kind": "relation", "relation": "left of", "objects": [7], "reference": {"part": 0}}
TEXT = "lay the cans out as a sailboat"
SHAPE = drawing_shape("sailboat", SAILBOAT)


class Unread:
    """A proposer that proposes nothing: what the default reader says is a refusal."""

    def propose(self, *given):
        return ()


@pytest.fixture
def read(parser, encoder, verifier):
    """What comes of a sentence, and the messages to the model."""

    def run(reply, text=TEXT, objects=NAMES, **more):
        with serving_oracle(Artist({text: reply})) as artist:
            model = GoalModel(EndpointLLM(artist.url, MODEL))
            interpreter = Interpreter(
                lambda: parser, encoder, Unread(), lambda: verifier, model=lambda: model, instead=lambda: parser
            )
            return interpreter.interpret(text, objects, **more), artist.messages

    return run


def test_a_drawing_is_asked_about_before_it_is_built(read):
    found, (message,) = read(build(drawn("a Sailboat", SAILBOAT, **CANS, size="large")))
    goal = Goal((StructurePart(SHAPE, "large", objects=tuple(range(7))),))
    assert found.status == "ask" and found.goal == Goal() and found.choices == (goal,)
    assert found.message.startswith("there is no figure 'sailboat', so the language model has drawn one; build this: ")
    assert found.message.endswith("sailboat of can, can 2, can 3, can 4, can 5, can 6, can 7, large?")
    assert found.drawings == (SHAPE,) and found.drawn.status == "ok" and found.drawn.goal == goal
    assert found.fallback == "" and "figures" not in message


def test_a_drawing_and_other_parts_are_asked_about_together(read):
    found, _ = read(build(drawn("sailboat", SAILBOAT, **CANS), BESIDE))
    assert [len(one.parts) for one in found.choices] == [2] and "mug left of part 1" in found.message


def test_a_drawing_waits_for_its_scene(read):
    found, _ = read(build(drawn("sailboat", SAILBOAT, objects=["the cans"])), objects=None)
    assert found.status == "ask" and found.drawn.among(NAMES).goal.structures[0].objects == tuple(range(7))


def test_what_was_accepted_is_known_by_its_name(read):
    named = build({"kind": "structure", "shape": "sailboat", "x_position": "left", **CANS})
    for known in ({"drawn": [SHAPE]}, {"before": Goal((StructurePart(SHAPE, objects=tuple(range(7))),))}):
        found, (message,) = read(named, **known)
        assert found.status == "ok" and found.goal.structures[0].shape == SHAPE
        assert message["figures"] == ["sailboat"]
        assert [part["shape"] for part in message["goal"]["parts"]] == ["sailboat"] * ("before" in known)
    again, _ = read(build(drawn("sailboat", SAILBOAT, **CANS)), drawn=[SHAPE])
    assert again.status == "ok" and again.goal.structures[0].shape == SHAPE
    other, _ = read(build(drawn("sailboat", HOOK, **CANS)), drawn=[SHAPE])
    assert other.status == "ask" and other.drawings == (drawing_shape("sailboat", HOOK),)


@pytest.mark.parametrize(("part", "why"), [
    (drawn("sailboat", {"strokes": [[[0, 0], [1, float("nan")]]], "least": 2}), "strokes cannot have nan"),
    (drawn("sailboat", {"strokes": [[[k, k % 2] for k in range(500)]], "least": 9}), "of 500 points; legal: up to 12"),
    (drawn("sailboat", {"strokes": [[[1, 1]]], "least": 1}), "strokes of one point show nothing"),
    (drawn("sailboat", {"blocks": [{"x": 0, "level": 0}, {"x": 3, "level": 1}]}), "level 1 stands on nothing"),
    (drawn("sailboat", {"strokes": None, "blocks": None, "least": None}), "one of strokes, pattern, blocks and places"),
    (drawn("sailboat", SAILBOAT, objects=[0, 1, 2]), "a sailboat needs 7 or more objects, but can 1, .* are only 3"),
    (drawn("sailboat", SAILBOAT, gap=0.1, **CANS), "a sailboat cannot have the key gap"),
    (drawn("gate", SAILBOAT), "'gate' is 'gate' already, .* or leave out the drawing"),
    (drawn("ring", SAILBOAT), "'ring' is 'circle' already"),
    (drawn("word hi", SAILBOAT), "a figure cannot be called 'word hi'"),
    (drawn("a boat with one sail and two masts", SAILBOAT), "legal: one to four words"),
    (drawn(None, SAILBOAT), "a drawing needs its name as the shape"),
    ({"kind": "structure", "shape": "sailboat", "objects": None}, "shape cannot be 'sailboat'"),
])  # fmt: skip
def test_a_bad_drawing_is_told_to_the_model_once_and_then_refused(read, part, why):
    found, (first, second) = read(build(part))
    assert found.status == "refused" and found.goal == Goal() and found.drawn is None
    assert "the default parser read this instead" in found.fallback and "no legal answer in 2 tries" in found.fallback
    assert "problem" not in first
    assert re.search(why, second["problem"])


def test_a_drawing_that_is_mended_counts(read):
    def reply(message):
        return build(
            drawn("sailboat", SAILBOAT if "problem" in message else {"strokes": [[[1, 1]]], "least": 1}, **CANS)
        )

    found, messages = read(reply)
    assert found.status == "ask" and found.drawings == (SHAPE,) and len(messages) == 2


def test_the_name_of_a_figure_that_was_taught_is_never_taken(read, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    write_figure(replace(figure_named("letter L"), name="sailboat", nouns=("sailboat",)), tmp_path / "sailboat.toml")
    found, messages = read(build(drawn("sailboat", SAILBOAT, **CANS)))
    assert found.status == "refused" and "'sailboat' is a figure of the user already" in messages[1]["problem"]
    named, _ = read(build({"kind": "structure", "shape": "sailboat", **CANS}), drawn=[SHAPE])
    assert named.status == "ok" and named.goal.structures[0].shape == "sailboat"


def test_a_question_offers_no_drawing(read):
    offered = [
        {"parts": [drawn("sailboat", SAILBOAT, **CANS)]},
        {"parts": [{"kind": "structure", "shape": "letter L", **CANS}]},
    ]
    found, _ = read(NOTHING | {"decision": "ask", "question": "A boat or an L?", "options": offered})
    assert found.status == "ask" and [one.structures[0].shape for one in found.choices] == ["letter L"]


def test_directions_of_a_drawing_are_those_of_the_speaker(parser, encoder, verifier):
    with serving_oracle(Artist({TEXT: build(drawn("sailboat", SAILBOAT, **CANS, x_position="left"))})) as artist:
        model = GoalModel(EndpointLLM(artist.url, MODEL))
        interpreter = Interpreter(
            lambda: parser, encoder, Unread(), lambda: verifier, "opposite", lambda: model, lambda: parser
        )
        found = interpreter.interpret(TEXT, NAMES)
    assert found.message.endswith("can 7, left?")
    assert found.drawn.goal.structures[0].x_position == "right" and found.choices == (found.drawn.goal,)

"""Parser, selection and viewpoint together; and what happens when the language model cannot be used."""

from dataclasses import replace

import pytest

from grounding.interpreter import Interpreter
from grounding.parse_result import Parse
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.spec import StructureSpec
from grounding.viewpoint import ViewpointError, turned

ROW_KEYS = {
    "text", "goal", "spec", "status", "message", "question", "confidence", "evidence", "dropped", "parser", "prompt_sha256",
    "fallback", "viewpoint", "seconds", "suggestions",
}  # fmt: skip


@pytest.fixture
def interpreter(parser):
    return Interpreter(lambda: parser)


def test_a_row(interpreter):
    row = interpreter.interpret("put the cups in a small circle on the left").to_dict()
    assert set(row) == ROW_KEYS
    assert row["spec"] == {
        "shape": "circle", "size": "small", "x_position": "left", "y_position": None, "rotation": None,
        "objects": ["cups"],
    }  # fmt: skip
    assert row["status"] == "ok" and row["message"] == "" and row["viewpoint"] == "robot"
    assert row["evidence"]["shape"] == "circle" and row["seconds"] > 0


@pytest.mark.parametrize(
    ("text", "names", "chosen"),
    [
        ("stack the cans", ["mug", "can", "can"], ("can", "can")),
        ("line everything up but the bowl", ["mug", "bowl", "plate"], ("mug", "plate")),
        ("make a circle", ["mug", "bowl", "plate"], ("mug", "bowl", "plate")),
    ],
)
def test_objects_of_a_scene(interpreter, text, names, chosen):
    assert interpreter.interpret(text, names).objects == chosen


def test_objects_that_are_not_there_are_refused(interpreter):
    reading = interpreter.interpret("stack the bananas", ["mug", "can"])
    assert reading.status == "refused" and "banana" in reading.message and "mug" in reading.message


@pytest.mark.parametrize(
    ("text", "robot", "opposite"),
    [
        ("a row on the left at the back, facing me", ("left", "top", "south"), ("right", "bottom", "north")),
        ("a row on my right", ("right", None, None), ("left", None, None)),
        ("a row in the center facing east", ("center", None, "east"), ("center", None, "west")),
        ("a row right in front of me", (None, "bottom", None), (None, "top", None)),
    ],
)
def test_viewpoint(parser, text, robot, opposite):
    for viewpoint, expected in (("robot", robot), ("opposite", opposite)):
        reading = Interpreter(lambda: parser, viewpoint=viewpoint).interpret(text)
        assert reading.spec == StructureSpec("line", None, *expected), viewpoint
        assert reading.to_dict()["viewpoint"] == viewpoint


@pytest.mark.parametrize(
    ("text", "evidence", "expected"),
    [
        ("near the robot", {"y_position": ("near",)}, "bottom"),
        ("close to you", {"y_position": ("close",)}, "bottom"),
        ("in front of you", {"y_position": ("front",)}, "bottom"),
        ("could you put it near me", {"y_position": ("near",)}, "top"),
        ("robot, near me", {"y_position": ("near",)}, "top"),
        ("near me, your humble servant", {"y_position": ("near",)}, "top"),
    ],
)
def test_what_is_said_of_the_robot_is_the_robots(text, evidence, expected):
    parse = Parse(text, StructureSpec("line", None, "left", "bottom"), "p", evidence=evidence)
    assert turned(parse) == StructureSpec("line", None, "right", expected)


def test_an_unknown_viewpoint(parser):
    with pytest.raises(ViewpointError, match="'above'; legal values: robot, opposite"):
        Interpreter(lambda: parser, viewpoint="above")


def test_when_the_llm_cannot_be_loaded_the_other_parser_speaks_and_it_is_said(parser):
    def unusable():
        raise LLMError("no server at http://localhost:1")

    reading = Interpreter(unusable, lambda: parser).interpret("stack the cans")
    assert reading.spec.shape == "tower" and reading.to_dict()["parser"] == "embedding"
    assert "no server at http://localhost:1" in reading.fallback
    with pytest.raises(LLMError):
        Interpreter(unusable).interpret("stack the cans")


def test_when_the_llm_fails_on_the_way_the_other_parser_speaks_from_then_on(parser):
    class Dying:
        name = "llm"
        calls = 0

        def parse_batch(self, texts):
            self.calls += 1
            if self.calls > 1:
                raise LLMError("the server hung up")
            return [Parse(text, StructureSpec("line"), self.name) for text in texts]

    dying = Dying()
    interpreter = Interpreter(lambda: dying, lambda: parser)
    assert interpreter.interpret("stack the cans").to_dict()["parser"] == "llm"
    for _ in range(2):
        reading = interpreter.interpret("stack the cans")
        assert reading.to_dict()["parser"] == "embedding" and "hung up" in reading.fallback
    assert dying.calls == 2


def test_words_for_one_that_fit_several_objects_are_a_question(encoder, parser):
    interpreter = Interpreter(lambda: parser, encoder=encoder)
    reading = interpreter.interpret("put the mug and the bowl in a line", ["red mug", "blue mug", "bowl"])
    assert reading.status == "ask" and reading.question.options == ("red mug", "blue mug")
    assert reading.to_dict()["question"] == {"slot": "object", "options": ["red mug", "blue mug"]}
    assert "mug' can be each of 2 objects: red mug; blue mug; which one?" in reading.message


def test_an_adjective_that_cannot_be_judged_is_told(encoder, parser):
    reading = Interpreter(lambda: parser, encoder=encoder).interpret("put the heavy cups in a line", ["cup", "cup", "bowl"])
    assert reading.status == "ok" and reading.objects == ("cup", "cup")
    assert reading.message == "it is not known which of the cups here are 'heavy': that word was left out of the choice"


def test_an_illegal_reply_costs_its_own_text_and_no_other(parser):
    class Stammering:
        name = "llm"

        def parse(self, text):
            return self.parse_batch([text])[0]

        def parse_batch(self, texts):
            if any("cans" in text for text in texts):
                raise IllegalReplyError("the language model gave no legal answer")
            return [replace(parse, parser="llm") for parse in parser.parse_batch(texts)]

    texts = ["make a line", "stack the cans", "make a circle"]
    interpreter = Interpreter(Stammering, lambda: parser)
    readings = interpreter.interpret_many(texts)
    assert [reading.parse.parser for reading in readings] == ["llm", "embedding", "llm"]
    assert [reading.spec.shape for reading in readings] == ["line", "tower", "circle"]
    said = "the language model gave no legal answer; the embedding parser read this"
    assert [reading.fallback for reading in readings] == ["", said, ""]
    assert interpreter.interpret("make a row").parse.parser == "llm"
    with pytest.raises(IllegalReplyError):
        Interpreter(Stammering).interpret_many(texts)

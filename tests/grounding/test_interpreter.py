"""Proposals, objects, the verifier and the viewpoint together; and a language model that is asked first."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpreter import Interpreter
from grounding.language_model.goal_reply import ModelReply
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.spec import StructureSpec
from grounding.viewpoint import ViewpointError

ROW_KEYS = {
    "text", "goal", "spec", "status", "message", "question", "confidence", "evidence", "dropped", "parser",
    "prompt_sha256",
    "fallback", "viewpoint", "seconds", "suggestions",
}  # fmt: skip


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


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("put object 2 and object 3 on the left", ("object 2", "object 3")),
        ("put the cup, object 2 and object 3 in a line", ("cup", "object 2", "object 3")),
        ("put everything but object 2 in a circle", ("cup 1", "object 3", "object 4")),
        ("put everything in a circle", ()),
    ],
)
def test_the_objects_of_a_goal_are_named_where_no_noun_chose_them(interpreter, text, named):
    assert interpreter.interpret(text, ["cup 1", "object 2", "object 3", "object 4"]).named == named


def test_a_scene_that_is_known_later_takes_up_the_same_reading(parser, encoder, verifier):
    class Once:
        fallback = ""

        def __init__(self, proposer):
            self.proposer, self.calls = proposer, 0

        def propose(self, *given):
            self.calls += 1
            return self.proposer.propose(*given)

    from grounding.goal_network.writer import NetworkWriter
    from grounding.propose.network import NetworkProposer

    once = Once(NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder)))
    read = Interpreter(lambda: parser, encoder, once, lambda: verifier).interpret("stack the cans on the left")
    assert read.goal == Goal((StructurePart("tower", x_position="left", objects=("cans",)),))
    there = read.among(["mug", "can", "can"])
    assert there.goal == Goal((StructurePart("tower", x_position="left", objects=(1, 2)),)) and once.calls == 1


def test_objects_that_are_not_there_are_refused(interpreter):
    reading = interpreter.interpret("stack the bananas", ["mug", "can"])
    assert reading.status == "refused" and "banana" in reading.message and "mug" in reading.message


def test_texts_that_are_read_ahead_are_read_as_they_are_alone(interpreter):
    objects, line = goal_scenes()["cans and cups"], Goal((StructurePart("line", objects=(0, 1, 2)),))
    asked = [(text, objects, Goal()) for text in ("stack the cans", "put the cups in a gate", "{}")]
    asked += [(text, objects, line) for text in ("a bit bigger, and a tower of the cups", "good morning")]
    alone = [interpreter.interpret(*each) for each in asked]
    interpreter.read_ahead(asked)
    for one, other in zip(alone, (interpreter.interpret(*each) for each in asked), strict=True):
        assert (one.status, one.goal, one.message) == (other.status, other.goal, other.message)
        assert one.probability == pytest.approx(other.probability, abs=1e-4)


def test_the_slots_are_read_when_they_are_looked_at_where_they_decide_nothing(interpreter, parser, monkeypatch):
    text = "put the cups in a small circle"
    read = interpreter.interpret(text, goal_scenes()["cans and cups"])
    with monkeypatch.context() as patch:
        patch.setattr(parser, "_parsed", None)
        again = interpreter.interpret(text, goal_scenes()["cans and cups"])
        with pytest.raises(TypeError):
            interpreter.interpret("put the cups in a large circle")  # no scene is known: they take part
    assert again.goal == read.goal
    assert again.parse.text == text and again.parse.spec == StructureSpec("circle", "small") == read.parse.spec


def test_an_unknown_viewpoint(parser, encoder, proposer, verifier):
    with pytest.raises(ViewpointError, match="'above'; legal values: robot, opposite"):
        Interpreter(lambda: parser, encoder, proposer, lambda: verifier, viewpoint="above")


def test_words_for_one_that_fit_several_objects_are_a_question(interpreter):
    reading = interpreter.interpret("put the mug and the bowl in a line", ["red mug", "blue mug", "bowl"])
    assert reading.status == "ask" and reading.question.options == ("red mug", "blue mug")
    assert [str(goal) for goal in reading.choices] == ["line of 0, 2", "line of 1, 2"]
    assert reading.to_dict()["question"] == {"slot": "object", "options": ["red mug", "blue mug"]}


def test_data_and_texts_without_end_are_not_read(interpreter):
    assert "is JSON" in interpreter.interpret('{"shape": "line"}').message
    assert "2400 characters; legal: up to 2000" in interpreter.interpret("stack " * 400).message


# --- a language model that is asked first ---


class Model:
    """Says what it was made to say, and remembers what it was asked."""

    def __init__(self, *replies):
        self.replies, self.asked = list(replies), []

    def read(self, *asked, drawn):
        assert drawn == {}
        self.asked.append(asked)
        reply = self.replies.pop(0)
        if isinstance(reply, Exception):
            raise reply
        return reply


@pytest.fixture
def with_model(parser, encoder, proposer, verifier):
    def made(model, viewpoint="robot", strict=False):
        instead = None if strict else lambda: parser
        return Interpreter(lambda: parser, encoder, proposer, lambda: verifier, viewpoint, lambda: model, instead)

    return made


def build(*parts):
    return ModelReply("build", Goal(parts))


CUPS = goal_scenes()["cans and cups"]


def test_its_goal_is_built_as_it_said_whatever_the_default_reader_would_make_of_it(with_model):
    line = StructurePart("line", objects=(0, 3))
    read = with_model(Model(build(line))).interpret("stelle die rote Dose neben die rote Tasse", CUPS)
    assert (read.status, read.goal, read.by_model, read.fallback) == ("ok", Goal((line,)), True, "")
    assert read.objects == ("can", "cup")


def test_it_is_asked_about_corrections_with_the_goal_so_far(with_model):
    before, after = StructurePart("line", objects=(3, 4, 5)), StructurePart("circle", objects=(3, 4, 5))
    model = Model(build(after))
    read = with_model(model).interpret("rounder", CUPS, Goal((before,)))
    assert read.goal == Goal((after,)) and model.asked[0][2] == Goal((before,))


def test_its_goals_are_the_speakers(with_model):
    left = StructurePart("line", x_position="left", objects=(3, 4))
    read = with_model(Model(build(left)), "opposite").interpret("a row on the left", CUPS)
    assert read.goal == Goal((StructurePart("line", x_position="right", objects=(3, 4)),))


def test_words_for_objects_are_looked_up_where_the_scene_comes_later(with_model):
    read = with_model(Model(build(StructurePart("tower", objects=("the cans",))))).interpret("stack the cans")
    assert read.among(["can", "mug", "can"]).goal == Goal((StructurePart("tower", objects=(0, 2)),))


def test_its_question_refusal_and_remark_are_passed_on(with_model):
    goals = tuple(Goal((StructurePart("tower", objects=two),)) for two in ((0, 1), (0, 2)))
    replies = (
        ModelReply("ask", question="Which?", options=goals),
        ModelReply("refuse", reason="No."),
        ModelReply("none", reason="Two."),
    )
    reader = with_model(Model(*replies))
    asked, refused, remark = (reader.interpret(text, CUPS) for text in ("stack two cans", "a bridge", "how many?"))
    assert (asked.status, asked.message, asked.choices) == ("ask", "Which?", goals)
    assert asked.question.options == ("tower of can, can 2", "tower of can, can 3")
    assert (refused.status, refused.message, refused.nothing) == ("refused", "No.", False)
    assert (remark.status, remark.message, remark.nothing) == ("refused", "Two.", True)


def test_where_it_cannot_be_used_the_default_reader_reads_from_then_on_and_it_is_said(with_model):
    model = Model(LLMError("the server hung up"))
    reader = with_model(model)
    for _ in range(2):
        read = reader.interpret("stack the cans")
        assert read.spec == StructureSpec("tower") and "hung up" in read.fallback and not read.by_model
    assert len(model.asked) == 1
    with pytest.raises(LLMError):
        with_model(Model(LLMError("the server hung up")), strict=True).interpret("stack the cans")


def test_an_illegal_reply_costs_its_own_text_and_no_other(with_model):
    tower = StructurePart("tower", objects=("the cans",))
    reader = with_model(Model(IllegalReplyError("no legal answer"), build(tower)))
    first, second = (reader.interpret("stack the cans") for _ in range(2))
    assert "no legal answer" in first.fallback and first.spec == StructureSpec("tower")
    assert second.fallback == "" and second.by_model


def test_a_parser_that_cannot_be_used_gives_way_to_another_and_says_so(parser, encoder, proposer, verifier):
    def unusable():
        raise LLMError("no model")

    read = Interpreter(unusable, encoder, proposer, lambda: verifier, instead=lambda: parser).interpret(
        "stack the cans"
    )
    assert read.status == "ok" and read.parse.parser == "embedding" and "no model" in read.fallback
    with pytest.raises(LLMError):
        Interpreter(unusable, encoder, proposer, lambda: verifier).interpret("stack the cans")


@pytest.mark.parametrize(
    ("scene", "text", "goal"),
    [
        ("fruit and plate", "put the gren aple on the plate", "2 on 0"),
        ("cans and cups", "put the bleu can behind the red can", "1 behind 0"),
        ("grocery", "put the sour can on the milk carton", None),  # English as it is: no slip of "soup"
    ],
)
def test_typing_errors_of_short_words(interpreter, scene, text, goal):
    read = interpreter.interpret(text, goal_scenes()[scene])
    assert (str(read.goal) if read.status == "ok" else None) == goal

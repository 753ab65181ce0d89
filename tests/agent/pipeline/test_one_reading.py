"""An instruction is read once in a run, with the objects of a scene that is there before it."""

import pytest

from agent import events
from agent.pipeline.event_builders import why_not
from agent.pipeline.run import RunOptions, run_instruction
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpretation import Interpretation
from grounding.interpreter import Interpreter
from grounding.parse_result import Parse, Question
from grounding.spec import StructureSpec
from tests.agent.chat.conftest import DESK

TOWER = Goal((StructurePart("tower", objects=("cans",)),))


@pytest.fixture
def read(monkeypatch) -> list[tuple[str, int | None]]:
    """The text of each reading, and with how many objects it was read."""
    found = []
    interpret = Interpreter.interpret

    def counted(self, text, objects=None, *more):
        found.append((text, None if objects is None else len(objects)))
        return interpret(self, text, objects, *more)

    monkeypatch.setattr(Interpreter, "interpret", counted)
    return found


@pytest.mark.parametrize(
    ("scene", "text"),
    [
        ("simulated", "put the cups in a line"),
        ("simulated", "put the cups in a line on the left and the cans in a line on the right"),
        (str(DESK), "put the cups in a line"),
    ],
)
def test_one_reading_is_enough(read, scene, text):
    happened = run_instruction(text, RunOptions(scene=scene, model="geometric", execute=False))
    parsed = next(event for event in happened if isinstance(event, events.Parsed | events.Failed))
    assert isinstance(parsed, events.Parsed) and parsed.spec.shape == "line"
    list(happened)
    assert [said for said, _ in read] == [text]
    assert (read[0][1] is None) == (scene == "simulated")


def test_a_scene_of_a_file_that_lacks_what_is_named_costs_one_reading(read):
    *_, failed, finished = run_instruction(
        "put the pineapples in a line", RunOptions(scene=str(DESK), model="geometric")
    )
    assert isinstance(failed, events.Failed) and finished.exit_code == 3 and len(read) == 1


def test_what_a_refused_instruction_may_mean_is_said_and_a_question_lists_its_options_itself():
    parse = Parse("the cans", StructureSpec(), "by hand")
    refused = Interpretation(parse, StructureSpec(), "refused", "not clear", "robot", None, 0.0, suggestions=(TOWER,))
    assert why_not(refused, None, "call it so") == "not clear; it may mean 'tower of cans'"
    question = Question("goal", "is it this: tower of cans?", ("tower of cans",))
    asked = Interpretation(
        parse, StructureSpec(), "ask", question.text, "robot", None, 0.0, question=question, suggestions=(TOWER,)
    )
    assert why_not(asked) == question.text
    missing = Interpretation(parse, StructureSpec(), "refused", "no can; there is only: mug", "robot", None, 0.0)
    assert why_not(missing, ["mug"], "call it so") == "no can; there is only: mug; call it so"

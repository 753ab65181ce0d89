"""A refused first instruction becomes a question with what it may mean."""

from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.dialogue.scene_reader import SpokenReading
from grounding.dialogue.suggestions import suggested
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.parse_result import Parse
from grounding.spec import StructureSpec

NAMES = ["red can", "blue can", "bowl"]
TOWER, LINE = (Goal((StructurePart(shape, objects=(0, 1)),)) for shape in ("tower", "line"))
NOTHING = Goal()


def ask(suggestions, last=NOTHING, status="refused"):
    parse = Parse("build it", StructureSpec(), "embedding")
    read = SpokenReading(Goal(), "refused", "'gronk' is not understood", None, parse, True, lambda: suggestions)
    turn = Turn(last, "build it", GoalText("build it", last, NAMES), None, (), False)
    return suggested(turn, GoalRevision(last, status, "new", read.message, read=read))


def test_one_suggestion_is_a_question_of_yes_or_no():
    found = ask((TOWER,))
    assert (found.status, found.kind, found.choices) == ("ask", "new", (TOWER,))
    assert found.question.text == "'gronk' is not understood; is this what is meant?"
    assert found.question.options == ("tower of red can, blue can",)


def test_two_suggestions_are_a_choice():
    found = ask((TOWER, LINE))
    assert found.choices == (TOWER, LINE) and found.question.text.endswith("is one of these meant?")


def test_without_suggestions_it_stays_refused():
    assert ask(()).status == "refused"


def test_what_is_said_about_a_goal_stays_with_the_reader_of_corrections():
    assert ask((TOWER,), last=LINE).status == "refused"


def test_what_is_understood_is_no_question():
    assert ask((TOWER,), status="ok").status == "ok"

"""What the network's reading of a correction changes: in place of a refusal, offered, beside what the rules read."""

from dataclasses import dataclass, replace

import pytest

from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.dialogue.second_opinion import AS_IT_IS, CERTAIN_OF_CALCULATED, second_opinion
from grounding.goal_network.network_reading import NetworkReading
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart

NAMES = ["red can", "blue can", "green can", "bowl"]
ROW = Goal((StructurePart("line", objects=(0, 1, 2)),))
LEFT = Goal((replace(ROW.parts[0], x_position="left"),))
MIDDLE = Goal((replace(ROW.parts[0], y_position="middle"),))
RIGHT = Goal((replace(ROW.parts[0], x_position="right"),))


@dataclass(frozen=True)
class FixedReader:
    """A reader whose network reads the same in every text."""

    reading: NetworkReading | None

    def corrected(self, goal, text):
        return self.reading


def opinion(found, reading, last=ROW, text="over to the left side", built=False):
    said = GoalText(text, last, NAMES)
    return second_opinion(Turn(last, text, said, FixedReader(reading), (), built), found)


REFUSED = GoalRevision(ROW, "refused", message="not understood")
READ_LEFT = GoalRevision(LEFT, "ok", "edit", changed=(0,))


IMPOSSIBLE = NetworkReading(certainty=0.6, answer="impossible")


def test_certain_goal_takes_the_place_of_a_refusal():
    found = opinion(REFUSED, NetworkReading(LEFT, 0.97))
    assert (found.status, found.kind, found.goal, found.changed) == ("ok", "edit", LEFT, (0,))


@pytest.mark.parametrize("reading", [NetworkReading(LEFT, 0.6), NetworkReading(LEFT, 0.99, unknown=("gronk",))])
def test_goal_that_is_not_certain_or_of_unknown_words_is_offered(reading):
    found = opinion(REFUSED, reading)
    assert (found.status, found.goal) == ("ask", ROW)
    assert found.choices == (LEFT, ROW)
    assert found.question.options[1] == AS_IT_IS and "left" in found.question.options[0]


@pytest.mark.parametrize(
    "reading",
    [
        None,
        NetworkReading(LEFT, 0.03),
        NetworkReading(LEFT, 0.09, unknown=("gronk",)),
        replace(IMPOSSIBLE, others=(NetworkReading(LEFT, 0.3),)),
        NetworkReading(ROW, 0.99),  # nothing changes
        NetworkReading(LEFT, 0.99, uncopied=("upside",)),
        NetworkReading(certainty=0.99, answer="impossible"),
    ],
)
def test_refusal_stays(reading):
    assert opinion(REFUSED, reading) is REFUSED


def test_likeliest_goals_are_offered_first_what_there_are_words_for():
    others = (NetworkReading(LEFT, 0.3), NetworkReading(ROW, 0.1), NetworkReading(MIDDLE, 0.06))
    found = opinion(REFUSED, NetworkReading(RIGHT, 0.4, others=others), text="left I think")
    assert (found.status, found.choices) == ("ask", (LEFT, RIGHT, ROW))  # "left" is said; two are offered
    assert "one of these" in found.question.text


@pytest.mark.parametrize("text", ["the same over to the left", "over to the left side, 5 cm"])
def test_what_has_to_be_calculated_is_offered(text):
    assert opinion(REFUSED, NetworkReading(LEFT, CERTAIN_OF_CALCULATED - 0.01), text=text).choices == (LEFT, ROW)


def test_question_that_has_answers_stays():
    asked = GoalRevision(ROW, "ask", message="which?", choices=(LEFT, RIGHT))
    assert opinion(asked, NetworkReading(LEFT, 0.99)) is asked
    assert opinion(replace(asked, choices=()), NetworkReading(LEFT, 0.6)).choices == (LEFT, ROW)


def test_long_sentence_that_the_network_reads_otherwise_is_asked_about():
    long = "well you see my left hand is where it goes best"
    assert opinion(READ_LEFT, NetworkReading(RIGHT, 0.6), text=long).choices == (RIGHT, LEFT, ROW)
    supported = NetworkReading(RIGHT, 0.6, others=(NetworkReading(LEFT, 0.1),))
    assert opinion(READ_LEFT, supported, text=long) is READ_LEFT


def test_change_that_cannot_be_meant_is_asked_about():
    assert opinion(READ_LEFT, replace(IMPOSSIBLE, others=(NetworkReading(LEFT, 0.3),))).choices == (LEFT, ROW)


def test_where_both_agree_there_is_no_question():
    assert opinion(READ_LEFT, NetworkReading(LEFT, 0.99)) is READ_LEFT


def test_certain_doubt_makes_a_question_of_both_goals():
    found = opinion(READ_LEFT, NetworkReading(RIGHT, 0.97))
    assert (found.status, found.choices) == ("ask", (LEFT, RIGHT))
    assert opinion(READ_LEFT, NetworkReading(RIGHT, 0.7)) is READ_LEFT


def test_change_that_is_perhaps_a_remark_is_asked_about():
    found = opinion(READ_LEFT, NetworkReading(certainty=0.97, answer="nothing"))
    assert (found.status, found.choices) == ("ask", (LEFT, ROW))
    assert "remark" in found.question.text


def test_first_instruction_and_what_moved_on_the_table_are_not_read_again():
    assert opinion(READ_LEFT, NetworkReading(RIGHT, 0.99), last=Goal()) is READ_LEFT
    moved = Goal((RelationPart("moved", objects=(3,), direction="left", distance=0.1),))
    assert opinion(READ_LEFT, NetworkReading(RIGHT, 0.99), last=moved, built=True) is READ_LEFT

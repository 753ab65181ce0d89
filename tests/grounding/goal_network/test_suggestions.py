"""Which goals are asked about where an instruction is refused."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.suggestions import LIKELY, LIKELY_WITHOUT_A_REQUEST, MOST_SUGGESTED, suggested_goals
from grounding.goal_network.writer import NetworkWriter
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart
from grounding.interpreter import Interpreter

TOWER, LINE, ARC = (Goal((StructurePart(shape, objects=(0, 1, 2)),)) for shape in ("tower", "line", "arc"))


def test_the_likeliest_goals_are_suggested():
    readings = [NetworkReading(TOWER, 0.4), NetworkReading(LINE, 0.3), NetworkReading(ARC, 0.25)]
    assert suggested_goals(readings, True) == (TOWER, LINE)[:MOST_SUGGESTED]
    assert suggested_goals([NetworkReading(TOWER, LIKELY - 0.01)], True) == ()


def test_nothing_is_suggested_where_nothing_is_asked_for():
    remark = NetworkReading(certainty=0.6, answer="nothing")
    assert suggested_goals([remark, NetworkReading(TOWER, 0.4)], True) == ()
    assert suggested_goals([NetworkReading(TOWER, LIKELY_WITHOUT_A_REQUEST - 0.01)], False) == ()
    assert suggested_goals([NetworkReading(TOWER, LIKELY_WITHOUT_A_REQUEST)], False) == (TOWER,)


def test_objects_of_which_nothing_is_asked_are_no_suggestion():
    only = Goal((StructurePart(None, objects=(0, 1)),))
    left = Goal((StructurePart(None, x_position="left", objects=(0, 1)),))
    assert suggested_goals([NetworkReading(only, 0.5), NetworkReading(left, 0.4)], True) == (left,)


@pytest.mark.parametrize("uncopied", [("upside", "down"), ("half", "of")])
def test_a_goal_without_what_no_goal_can_hold_is_not_suggested(uncopied):
    assert suggested_goals([NetworkReading(TOWER, 1.0, uncopied=uncopied)], True) == ()


def test_what_is_wanted_far_away_is_not_suggested_beside():
    beside = Goal((RelationPart("next to", (0,), (1,)),))
    assert suggested_goals([NetworkReading(beside, 1.0, uncopied=("far", "away", "from"))], True) == ()


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder))


def test_a_sentence_with_another_work_is_refused_and_suggests_the_rest(interpreter):
    read = interpreter.interpret("pile the blue cups up in a pyramid, then knock it over", goal_scenes()["party"])
    assert read.status == "refused" and not read.goal.parts and "knock" in read.message
    (goal,) = read.suggestions
    assert [(part.shape, set(part.objects)) for part in goal.structures] == [("pyramid", {3, 4, 5})]
    assert read.to_dict()["suggestions"] == [goal.to_dict()]


def test_suggestions_are_turned_for_a_speaker_across_the_table(parser, encoder):
    across = Interpreter(
        lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder), viewpoint="opposite"
    )
    read = across.interpret("pile the blue cups up in a pyramid on the left, then knock it over", goal_scenes()["party"])
    assert read.status == "refused"
    assert [part.x_position for goal in read.suggestions for part in goal.structures][:1] == ["right"]


@pytest.mark.parametrize("text", ["how many cups are there?", "thanks, that is nice", "draw a heart with the cups"])
def test_remarks_and_what_cannot_be_built_suggest_nothing(interpreter, text):
    read = interpreter.interpret(text, goal_scenes()["party"])
    assert (read.status, read.suggestions) == ("refused", ())

"""The arithmetic of reading goals, on readings made by hand."""

from dataclasses import dataclass

from grounding.goal_benchmark.rows import GoalRow
from grounding.goal_benchmark.scoring import compare_with_row, is_exact_reading, is_right_with_an_answer, score_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart


@dataclass
class Reading:
    status: str
    goal: Goal = Goal()
    message: str = ""
    suggestions: tuple[Goal, ...] = ()


LINE, TOWER = StructurePart("line", objects=(0, 1)), StructurePart("tower", objects=(2, 3))
LINE_2 = StructurePart("line", objects=(1, 2))
TWO = GoalRow("two", "breakfast", "two", "ok", (Goal((LINE, TOWER)),))
IDLE = GoalRow("idle", "breakfast", "idle", "refused")
CORNER = GoalRow("corner", "breakfast", "idle", "ask")


def ok(*parts):
    return Reading("ok", Goal(parts))


def test_parts_may_come_in_any_order_and_any_acceptable_goal_will_do():
    assert is_exact_reading(TWO, ok(TOWER, LINE))
    either = GoalRow("t", "breakfast", "s", "ok", (Goal((TOWER,)), Goal((LINE,))))
    assert is_exact_reading(either, ok(LINE)) and is_exact_reading(either, ok(TOWER))
    assert compare_with_row(Goal((LINE,)), either)[1] == Goal((LINE,))


def test_a_suggestion_and_an_option_of_a_question_are_an_answer_away():
    right, wrong = Goal((LINE, TOWER)), Goal((LINE,))
    for status in ("refused", "ask"):
        assert is_right_with_an_answer(TWO, Reading(status, suggestions=(wrong, right)))
        assert not is_right_with_an_answer(TWO, Reading(status, suggestions=(wrong,)))
    assert not is_right_with_an_answer(TWO, Reading("ok", wrong, suggestions=(right,)))
    assert not is_right_with_an_answer(IDLE, Reading("ask", suggestions=(right,)))


def test_everything_else_is_the_list_of_all_others():
    row = GoalRow("t", "breakfast", "s", "ok", (Goal((StructurePart("line"), TOWER)),))
    assert is_exact_reading(row, ok(TOWER, StructurePart("line", objects=(5, 4, 1, 0))))
    assert not is_exact_reading(row, ok(TOWER, StructurePart("line", objects=(5, 4, 1))))


def test_words_are_compared_without_articles():
    row = GoalRow("t", None, "s", "ok", (Goal((RelationPart("on", ("apple",), ("plate",)),)),))
    assert is_exact_reading(row, ok(RelationPart("on", ("the Apple",), ("a plate",))))
    assert not is_exact_reading(row, ok(RelationPart("on", ("the pear",), ("a plate",))))


def test_a_question_is_not_a_refusal_but_builds_nothing_either():
    assert is_exact_reading(CORNER, Reading("ask")) and not is_exact_reading(CORNER, Reading("refused"))
    found = score_goals([IDLE, CORNER, TWO], [Reading("refused"), Reading("refused"), ok(LINE, TOWER)])
    assert found["refusal"]["precision"]["rate"] == found["refusal"]["recall"]["rate"] == 1.0
    assert found["status"]["hits"] == 1 and found["exact"]["hits"] == 2 and found["built_wrongly"]["hits"] == 0


def test_what_is_dropped_invented_filled_and_wrong_is_counted_apart():
    readings = [
        ok(LINE),  # a part dropped
        ok(LINE, TOWER, RelationPart("next to", (4,), PartReference(0))),  # a part invented
        ok(StructurePart("line", objects=(0, 1), gap=0.05), TOWER),  # a key invented
        ok(LINE, StructurePart("tower", objects=(2, 4))),  # wrong objects
        Reading("refused"),
        Reading("ask"),
    ]
    found = score_goals([TWO] * 6, readings)
    assert found["exact"]["hits"] == 0
    assert (found["dropped_parts"]["hits"], found["dropped_parts"]["n"]) == (1, 8)
    assert (found["false_parts"]["hits"], found["false_parts"]["n"]) == (1, 8)
    assert (found["false_fills"]["hits"], found["false_fills"]["n"]) == (1, 4) and found["keys"]["filled"] == {"gap": 1}
    assert (found["wrong_keys"]["hits"], found["wrong_keys"]["n"]) == (1, 4) and found["keys"]["wrong"] == {
        "objects": 1
    }
    assert found["wrongly_refused"]["hits"] == found["wrongly_asked"]["hits"] == 1
    assert found["built_wrongly"]["hits"] == 4 and len(found["wrong"]) == 6
    assert found["wrong"][0]["dropped"] == [1] and found["wrong"][2]["false_fills"] == ["gap"]


def test_building_what_must_not_be_built_is_found():
    found = score_goals([IDLE, TWO], [ok(LINE), ok(LINE, TOWER)])
    assert found["refusal"]["recall"]["rate"] == 0.0 and found["built_wrongly"]["hits"] == 1
    assert found["strata"]["idle"]["hits"] == 0 and found["strata"]["two"]["hits"] == 1
    assert found["refusal"]["precision"]["rate"] is None  # nothing was refused


def test_another_status_may_be_fair_too():
    vague = GoalRow("t", "breakfast", "s", "ask", also="refused")
    found = score_goals([vague, vague, vague], [Reading("ask"), Reading("refused"), ok(LINE)])
    assert found["exact"]["hits"] == 2 and found["status"]["hits"] == 2 and found["refusal"]["recall"]["hits"] == 2


def test_a_relation_of_two_objects_is_two_relations():
    both = GoalRow("t", "breakfast", "s", "ok", (Goal((RelationPart("on", (0, 4), (3,)), LINE_2)),))
    apart = ok(LINE_2, RelationPart("on", (4,), (3,)), RelationPart("on", (0,), (3,)))
    assert is_exact_reading(both, apart)
    after = RelationPart("behind", PartReference(1), (3,))
    row = GoalRow("t", "breakfast", "s", "ok", (Goal((RelationPart("on", (0, 4), (3,)), LINE_2, after)),))
    assert is_exact_reading(
        row, ok(LINE_2, RelationPart("on", (0, 4), (3,)), RelationPart("behind", PartReference(0), (3,)))
    )
    one = score_goals([both], [ok(LINE_2, RelationPart("on", (4,), (3,)))])
    assert (one["dropped_parts"]["hits"], one["dropped_parts"]["n"]) == (1, 3)

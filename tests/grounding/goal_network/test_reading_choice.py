"""When the network's goal counts, and when it does not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.reading_choice import (
    AGREED_PLAIN,
    ANOTHER_GOAL,
    CERTAIN,
    CONTRARY,
    HALF_READ,
    IMPOSSIBLE,
    SURE,
    FirstReading,
    counts,
    doubted,
    excepts,
    notes_of,
    sorts,
)
from grounding.goal_reading.reader import GoalReading
from grounding.goals.goal import Goal
from grounding.goals.parts import Order, RelationPart, StructurePart
from grounding.spec import StructureSpec

TOWER = Goal((StructurePart("tower", objects=(0, 1)),))
TRIANGLE = Goal((StructurePart("triangle", objects=(0, 1, 2)),))
LINE = Goal((StructurePart("line", objects=(0, 1)),))
UNKNOWN = GoalReading(residue=("egypt",))
REFUSED = FirstReading(UNKNOWN, "refused", Goal(), True, False)


def read(goal=TRIANGLE, certainty=SURE - 0.01):
    return NetworkReading(goal, certainty)


def test_a_certain_goal_stands_in_for_a_refusal_because_of_unknown_words():
    assert counts(read(certainty=CERTAIN), REFUSED, 3)
    assert not counts(read(certainty=CERTAIN - 0.01), REFUSED, 3)
    aside, copied = replace(read(), uncopied=("in", "egypt")), replace(read(), uncopied=("in",))
    assert notes_of(aside, UNKNOWN) == ("read without knowing 'egypt': say so if this changes the wish",)
    assert notes_of(copied, UNKNOWN) == ()  # what it copied is in the goal that the user sees


def test_goals_of_single_objects_are_not_taken_where_each_gets_its_own():
    beside = Goal((RelationPart("behind", (0, 1), (2,)),))
    each = replace(REFUSED, reading=replace(UNKNOWN, paired=True))
    assert not counts(read(beside), each, 3) and counts(read(), each, 3)


@pytest.mark.parametrize(
    "first",
    [
        replace(REFUSED, requests=False, text="what about Egypt?"),
        replace(REFUSED, reading=replace(UNKNOWN, conditions=("if",))),
        replace(REFUSED, reading=replace(UNKNOWN, residue=("upside down",))),
    ],
)
def test_questions_conditions_and_weighty_words_stay_refused_unless_the_network_is_sure(first):
    assert not counts(read(), first, 3)
    assert counts(read(certainty=SURE), first, 3)


@pytest.mark.parametrize("known", [{"work": ("pour",)}, {"never": ("half of the",)}, {"definite": True}])
def test_other_work_and_what_no_goal_can_hold_stay_refused(known):
    assert not counts(read(certainty=1.0), replace(REFUSED, reading=replace(UNKNOWN, **known)), 3)


def test_a_statement_that_begins_like_a_question_needs_more_certainty():
    statement = replace(REFUSED, requests=False, text="what goes in the triangle is all of it")
    assert counts(read(certainty=CONTRARY), statement, 3)
    assert not counts(read(certainty=CONTRARY - 0.01), statement, 3)


def test_a_place_that_is_asked_for_counts_where_the_goal_has_it():
    along = Goal((StructurePart("line", objects=(0, 1), along="near"),))
    asking = replace(REFUSED, asks_place=True)
    assert counts(read(along, CONTRARY), asking, 3)
    assert not counts(read(along, CONTRARY - 0.01), asking, 3)
    assert not counts(read(LINE), asking, 3)


def test_words_that_the_goal_holds_do_not_refuse_it():
    arc = Goal((StructurePart("arc", rotation="west", objects=(0, 1, 2)),))
    opened = replace(REFUSED, reading=GoalReading(residue=("open",)), text="an arc that is open to the left")
    assert counts(read(arc), opened, 3) and not counts(read(), opened, 3)
    every = replace(REFUSED, reading=GoalReading(residue=("every",)), text="a triangle out of every can")
    assert counts(read(), every, 3)
    assert not counts(read(), replace(every, text="a triangle out of every second can"), 3)


@pytest.mark.parametrize(
    ("first", "enough"),
    [
        (replace(REFUSED, reading=GoalReading(problem="there is no fork")), IMPOSSIBLE),
        (replace(REFUSED, idle=True), CONTRARY),
        (replace(REFUSED, reading=GoalReading(problem="left and right", contradictory=True)), CONTRARY),
    ],
)
def test_what_is_understood_contradictory_or_asks_for_nothing_needs_more_certainty(first, enough):
    assert counts(read(certainty=enough), first, 3)
    assert not counts(read(certainty=enough - 0.01), first, 3)


def test_another_goal_is_replaced_only_where_the_network_is_nearly_sure_and_reads_something_else():
    complete = FirstReading(GoalReading(goal=TRIANGLE), "ok", TRIANGLE, True, False)
    other = Goal((StructurePart("arc", objects=(0, 1, 2)),))
    assert counts(read(other, ANOTHER_GOAL), complete, 3)
    assert not counts(read(other, ANOTHER_GOAL - 0.01), complete, 3)
    assert not counts(read(TRIANGLE), complete, 3)
    assert not counts(read(other), replace(complete, excepts=excepts("all but the red one")), 3)


def test_a_network_goal_that_loses_what_was_understood_is_not_taken():
    at, behind = RelationPart("at", (1,), y_position="top"), RelationPart("behind", (1,), (0,))
    complete = FirstReading(GoalReading(goal=Goal((at, behind))), "ok", Goal((at, behind)), True, False)
    assert not counts(read(Goal((behind,))), complete, 3)  # without the place
    named = FirstReading(GoalReading(goal=Goal((behind,))), "ok", Goal((behind,)), True, False)
    assert not counts(read(Goal((at,))), named, 3)  # without what it stands behind
    half_read = replace(complete, reading=replace(complete.reading, residue=("egypt",)))
    assert counts(read(Goal((behind,))), half_read, 3)


def test_one_structure_that_two_readers_agree_on_gives_way_to_a_network_that_is_surer_still():
    agreed = FirstReading(GoalReading(goal=LINE), "ok", LINE, True, False, agreed=True)
    along = Goal((StructurePart("line", objects=(0, 1), along="near"),))
    assert counts(read(along, AGREED_PLAIN), agreed, 3) and not counts(read(along, AGREED_PLAIN - 0.001), agreed, 3)
    assert not counts(read(LINE, AGREED_PLAIN), agreed, 3) and not counts(read(along, AGREED_PLAIN), agreed, None)


def test_a_row_that_stands_already_is_known_to_the_network_alone():
    everything = Goal((StructurePart("circle", y_position="bottom", objects=(0, 1, 2, 3)),))
    row = Goal((StructurePart("circle", objects=(0, 1)),))
    agreed = FirstReading(GoalReading(goal=everything), "ok", everything, True, False, "the blocks in the front row form a circle", agreed=True)
    assert counts(read(row, CERTAIN), agreed, 4)
    assert not counts(read(row, CERTAIN), replace(agreed, text="the blocks form a circle in front"), 4)


def test_everything_gives_way_to_named_objects_where_the_network_is_sure():
    everything = Goal((StructurePart("line", y_position="bottom"),))
    named = Goal((StructurePart("line", y_position="bottom", objects=(0, 1)),))
    plain = FirstReading(GoalReading(goal=everything), "ok", everything, True, False)
    assert counts(read(named, SURE), plain, 3) and not counts(read(named), plain, 3)


def test_a_goal_without_parts_is_none():
    assert not counts(read(Goal(), AGREED_PLAIN), replace(REFUSED, slots=StructureSpec()), 3)


def test_an_order_that_is_asked_for_is_not_lost():
    sorting = replace(REFUSED, sorts=sorts("put things in order of size"))
    assert not counts(read(LINE), sorting, 3)
    assert counts(read(Goal((StructurePart("line", objects=(0, 1), order=Order("height")),))), sorting, 3)


def test_a_plain_structure_of_a_half_read_sentence_needs_a_second_vote():
    half = FirstReading(UNKNOWN, "ok", TOWER, True, False)
    assert counts(read(LINE, HALF_READ), half, 2)
    assert not counts(read(LINE, HALF_READ - 0.01), half, 2)
    assert doubted(read(LINE, 0.1), half, 2) and doubted(NetworkReading(), half, 2)
    assert not doubted(read(TOWER, 0.1), half, 2)
    assert not doubted(read(LINE, 0.1), half, None)  # without a scene the parser decides
    assert not counts(read(LINE), half, None)


def test_a_network_that_leaves_slots_open_supports_the_parser():
    left = Goal((StructurePart("tower", x_position="left", objects=(0, 1)),))
    half = FirstReading(UNKNOWN, "ok", left, True, False)
    assert not counts(read(TOWER), half, 2) and not doubted(read(TOWER), half, 2)
    right = Goal((StructurePart("tower", x_position="right", objects=(0, 1)),))
    assert counts(read(right), half, 2)
    other_objects = Goal((StructurePart("tower", objects=(0, 2)),))
    assert counts(read(other_objects), half, 3)

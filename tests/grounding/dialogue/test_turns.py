"""Conversations as states: each as (what is said, what stands then, a word of what is said of it)."""

import pytest

from grounding.dialogue.state import Dialogue, built, forget
from grounding.dialogue.turns import answer, say
from grounding.goal_benchmark.rows import goal_scenes
from tests.grounding.goal_in_words import goal_of_words
from tests.grounding.scripted_reader import ScriptedReader

TABLE = goal_scenes()["cans and cups"]  # cans 0 to 2 (red, blue, green), cups 3 to 6 (red, yellow, white, blue)
NAMES = [one.name for one in TABLE]
BOTH = "tower of 0, 1, 2, left; circle of 3, 4, 5, 6, right"


def talk(script, *lines, state=Dialogue(), **more):
    """Return (state, outcome) after some lines."""
    reader = ScriptedReader(script, **more)
    for line in lines:
        state, outcome = say(state, line, reader, TABLE)
    return state, outcome


def holding(goal):
    return Dialogue(goal_of_words(goal))


def test_a_sentence_is_read_after_the_goal_so_far():
    reader = ScriptedReader({"a": BOTH, f"{BOTH} > b": "tower of 0, 1, 2, left"})
    state, first = say(Dialogue(), "a", reader, TABLE)
    state, second = say(state, "b", reader, TABLE)
    assert [first.status, second.status] == ["ok", "ok"] and str(state.goal) == "tower of 0, 1, 2, left"
    assert reader.asked == [("nothing", "a"), (BOTH, "b")]
    assert first.changed == (0, 1) and second.changed == () and second.dropped == first.goal.parts[1:]
    assert second.message == "no longer wanted: circle of cup, cup 2, cup 3, cup 4, right"


def test_what_is_replaced_is_said():
    state, outcome = talk({"orange": "0 on 3"}, "orange", state=holding("line of 4, 5, 6"))
    assert outcome.message == "this replaces line of cup 2, cup 3, cup 4; say “also …” to keep both"
    _, outcome = talk({"bigger": "line of 4, 5, 6, large"}, "bigger", state=holding("line of 4, 5, 6"))
    assert outcome.message == "" and outcome.changed == (0,)


@pytest.mark.parametrize(
    ("answered", "then"),
    [("1", BOTH), ("2", "line of 0, 1, 2"), ("the first", BOTH), ("the second one", "line of 0, 1, 2"),
     ("the last", "line of 0, 1, 2"),
     ("the line please", "line of 0, 1, 2"), ("the tower", BOTH), ("either", BOTH), ("the cups", BOTH)],
)  # fmt: skip
def test_a_question_is_answered(answered, then):
    state, outcome = talk({"hm": f"? {BOTH} | line of 0, 1, 2"}, "hm", answered)
    assert outcome.status == "ok" and str(state.goal) == then and state.question is None


@pytest.mark.parametrize("answered", ["blue", "the blue one", "cup 4", "2", "the blue cup", "I mean the blue one"])
def test_a_short_answer_says_which_object(answered):
    state, outcome = talk({"put the cup left": "? 3 at left | 6 at left"}, "put the cup left", answered)
    assert outcome.status == "ok" and str(state.goal) == "6 at left"


@pytest.mark.parametrize("answered", ["yes", "y", "ok", "1", "do it", "Build.", "yes build it"])
def test_yes_answers_where_one_goal_is_offered(answered):
    state, _ = talk({"hm": f"? {BOTH}"}, "hm", answered)
    assert str(state.goal) == BOTH


@pytest.mark.parametrize("said", ["no", "n", "never mind", "neither", "forget that"])
def test_no_drops_the_question_alone(said):
    before = holding("line of 4, 5, 6")
    state, outcome = talk({"hm": f"? {BOTH}"}, "hm", said, state=before)
    assert outcome.status == "unchanged" and state.goal == before.goal and state.question is None
    assert state.history == before.history


def test_what_was_read_back_is_the_goal_so_far_for_what_is_said_next():
    offered = "line of 0, 1, 2, top; line of 3, 4, 5, 6, bottom"
    script = {"rows": f"? {offered}", f"{offered} > the front line, 2 cm gap": f"{offered}, gap 2 cm"}
    state, outcome = talk(script, "rows", "the front line, 2 cm gap")
    assert outcome.status == "ok" and str(state.goal) == f"{offered}, gap 2 cm"


def test_arithmetic_is_about_what_was_read_back():
    state, outcome = talk({"row": "? line of 0, 1, 2, gap 5 cm"}, "row", "3 cm more")
    assert outcome.status == "ok" and str(state.goal) == "line of 0, 1, 2, gap 8 cm"


def test_a_question_is_never_dropped_without_a_word():
    state, outcome = talk({"hm": f"? {BOTH}", "blah": "! not understood"}, "hm", "blah")
    assert outcome.status == "refused" and "still open: which of these" in outcome.message
    assert state.question is not None and state.choices == (goal_of_words(BOTH),)
    state, outcome = talk({"hm": f"? {BOTH}", "lovely weather": "-"}, "hm", "lovely weather")
    assert outcome.status == "nothing" and state.question is not None
    assert answer(state, 0, NAMES)[1].status == "ok"


def test_bigger_after_a_question_about_the_others_keeps_the_new_circle():
    line, offered = "line of 0, 1, 2", "circle of 3, 4, 5, 6; line of 0, 1, 2"
    script = {
        f"{line} > a circle of the cups": f"? {offered}",
        f"{offered} > bigger": "circle of 3, 4, 5, 6, large; line of 0, 1, 2",
    }
    state, _ = talk(script, "a circle of the cups", "bigger", state=holding(line))
    assert str(state.goal) == "circle of 3, 4, 5, 6, large; line of 0, 1, 2"


def test_a_denial_is_about_the_goal_so_far_first():
    line, offered, meant = "line of 0, 1, 2", "line of 0, 1, 2; 3 on 0", "line of 0, 1, 2; 4 on 0"
    script = {
        f"{line} > add a cup": f"? {offered}",
        f"{line} > no, the white one": meant,
        f"{offered} > no, the white one": offered + "; 4 on 1",
    }
    state, _ = talk(script, "add a cup", "no, the white one", state=holding(line))
    assert str(state.goal) == meant


def test_a_refused_wish_is_mended():
    wish, mended = "circle of 3, 4", "circle of 0, 1, 2, 3, 4"
    script = {"a ring of two cups": f"! too few ! {wish}", f"{wish} > use the cans too": mended}
    state, outcome = talk(script, "a ring of two cups")
    assert outcome.status == "refused" and str(state.wish) == wish
    state, outcome = talk(script, "use the cans too", state=state)
    assert outcome.status == "ok" and str(state.goal) == mended and not state.wish.parts and not state.refused


def test_refused_words_are_joined_with_what_is_said_next():
    script = {"put the mug left. I mean the cup": "3 at left"}
    state, outcome = talk(script, "put the mug left", "I mean the cup")
    assert outcome.status == "ok" and str(state.goal) == "3 at left"


def test_a_failed_correction_leaves_the_goal():
    before = holding(BOTH)
    state, outcome = talk({"paint it": "! cannot be built"}, "paint it", state=before)
    assert outcome.status == "refused" and outcome.goal == state.goal == before.goal
    state, outcome = talk({}, "forget that", state=state)
    assert outcome.status == "unchanged" and state.goal == before.goal and not state.refused


@pytest.mark.parametrize(
    "said", ["forget that", "undo", "never mind", "as it was", "no, forget it", "put it back as it was"]
)
def test_a_bare_way_back_takes_out_what_was_added(said):
    script = {f"{BOTH} > and the can on the cup": f"{BOTH}; 0 on 3"}
    state, outcome = talk(script, "and the can on the cup", said, state=holding(BOTH))
    assert outcome.status == "ok" and str(state.goal) == BOTH and str(outcome.dropped[0].relation) == "on"
    assert state.history == ()


def test_nothing_is_left_to_take_back():
    assert talk({}, "undo")[1].status == "refused"
    state, outcome = talk({"a": BOTH}, "a", "undo")
    assert outcome.status == "ok" and not state.goal.parts


def test_a_whole_instruction_that_fits_no_goal_so_far_is_asked_about():
    script = {"*": "", "0 on the white cup": "0 on 4"}
    state, outcome = talk(script, "0 on the white cup", state=holding("line of 5, 6"))
    assert outcome.status == "ask" and [str(one) for one in state.choices] == ["0 on 4", "line of 5, 6; 0 on 4"]
    state, _ = talk(script, "0 on the white cup", "2", state=holding("line of 5, 6"))
    assert str(state.goal) == "line of 5, 6; 0 on 4"


def test_after_a_build_an_instruction_of_its_own_needs_no_question():
    script = {"*": "", "0 on the white cup": "0 on 4"}
    state, outcome = talk(script, "0 on the white cup", state=built(holding("line of 5, 6")))
    assert (
        outcome.status == "ok"
        and str(state.goal) == "0 on 4"
        and state.standing == frozenset()
        and outcome.message == ""
    )


def test_choices_are_whole_feasible_goals():
    script = {"*": "", "stack the cans": "tower of 0, 1, 2"}
    state, outcome = talk(script, "stack the cans", state=holding("line of 0, 5, 6"))  # can 0 cannot be in both
    assert outcome.status == "ask" and [str(one) for one in state.choices] == [
        "tower of 0, 1, 2",
        "line of 5, 6; tower of 0, 1, 2",
    ]


def test_what_stands_moves_by_centimetres():
    line = "line of 0, 1, 2, left"
    state, outcome = talk({}, "move the line 5 cm to the left", state=holding(line))
    assert outcome.status == "refused" and "build it first" in outcome.message
    state, outcome = talk({}, "move the line 5 cm to the left", state=built(holding(line)))
    assert outcome.status == "ok" and str(state.goal) == f"{line}; 0, 1, 2 moved left by 5 cm"
    assert state.standing == frozenset({0}) and outcome.changed == (1,)
    state, outcome = talk({}, "3 cm more", state=built(state))
    assert str(state.goal) == f"{line}; 0, 1, 2 moved left by 3 cm" and state.standing == frozenset({0})


def test_from_across_the_table_what_is_said_of_the_robot_is_the_robots():
    across = {"state": holding("line of 0, 1, 2, left"), "viewpoint": "opposite"}
    assert str(talk({}, "a bit further to your right", **across)[0].goal) == "line of 0, 1, 2, center"
    stands = built(holding("line of 0, 1, 2, left"))
    state, _ = talk({}, "move the line 5 cm towards the robot", state=stands, viewpoint="opposite")
    assert str(state.goal) == "line of 0, 1, 2, left; 0, 1, 2 moved closer by 5 cm"


def test_from_across_the_table_directions_are_the_speakers():
    state, _ = talk({}, "a bit further left", state=holding("line of 0, 1, 2, left"), viewpoint="opposite")
    assert str(state.goal) == "line of 0, 1, 2, center"


def test_what_is_so_already_is_said():
    state, outcome = talk({"again": BOTH}, "again", state=holding(BOTH))
    assert outcome.status == "unchanged" and state == holding(BOTH)
    assert talk({"again": "="}, "again", state=holding(BOTH))[1].status == "unchanged"


def test_forgetting_can_be_taken_back():
    state = forget(holding(BOTH))
    assert not state.goal.parts
    assert str(talk({}, "undo", state=state)[0].goal) == BOTH


def test_an_answer_needs_a_question():
    with pytest.raises(ValueError, match="no question"):
        answer(Dialogue(), 0, NAMES)
    state, _ = talk({"hm": f"? {BOTH}"}, "hm")
    with pytest.raises(IndexError, match="legal: 1 to 1"):
        answer(state, 1, NAMES)


def test_a_wish_that_is_repeated_is_proposed_anew():
    script = {"put the cups in a line": "line of 3, 4", "line of 3, 4 > put the cups in a line": "="}
    state, outcome = talk(script, "put the cups in a line", "put the cups in a line")
    assert (outcome.status, str(state.goal), outcome.changed) == ("ok", "line of 3, 4", (0,))


def test_a_part_that_is_wished_for_again_is_there_already_once_it_is_built():
    both, script = "line of 3, 4; 2 at left", {"can left": "2 at left", "line of 3, 4; 2 at left > can left": "="}
    _, outcome = talk(script, "can left", state=holding(both))
    assert (outcome.status, str(outcome.goal), outcome.changed) == ("ok", both, (1,))
    _, outcome = talk(script, "can left", state=built(holding(both)))
    assert (outcome.status, str(outcome.goal)) == ("unchanged", both)


def test_the_goal_so_far_said_again_answers_the_question():
    script = {
        "a": "line of 3, 4",
        "line of 3, 4 > b": "? 2 at left | line of 3, 4; 2 at left",
        "line of 3, 4; 2 at left > a": "line of 3, 4",
    }
    state, outcome = talk(script, "a", "b", "a")
    assert (outcome.status, str(state.goal), outcome.changed, state.question) == ("ok", "line of 3, 4", (0,), None)

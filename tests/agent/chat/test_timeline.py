"""The timeline of a conversation: back to any turn with its goal, table, proposal and question,
and branches beside each other.
"""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from agent import events
from agent.chat.commands import command_of
from agent.chat.run import run_chat
from agent.errors import UsageError
from agent.pipeline.run import RunOptions
from tests.agent.chat.conftest import DESK

LINE = "put the cups in a line on the right"


def test_back_to_any_turn_restores_the_goal_the_table_and_what_was_proposed(conversation, sent):
    start = conversation.table.poses()
    assert conversation.say(LINE) and conversation.go()
    built = conversation.table.poses()
    assert conversation.say("make it a circle") and conversation.say("on the left")
    assert [(turn.number, turn.after, turn.line) for turn, _ in conversation.timeline()] == [
        (0, None, ""), (1, 0, LINE), (2, 1, "make it a circle"), (3, 2, "on the left"),
    ]  # fmt: skip
    conversation.back_to(0)
    assert not conversation.situation.asked and np.allclose(conversation.table.poses()["cup 1"], start["cup 1"])
    conversation.back_to(1)
    assert conversation.situation.built and np.allclose(conversation.table.poses()["cup 1"], built["cup 1"], atol=1e-6)
    assert str(conversation.situation.goal) == "line of 0, 1, 2, right"
    conversation.back_to(2)
    assert str(conversation.situation.proposal.goal) == "circle of 0, 1, 2, right"
    restored = [event for event in sent if isinstance(event, events.Restored)]
    assert [(event.how, event.turn) for event in restored] == [("turn 0", 0), ("turn 1", 1), ("turn 2", 2)]
    for number in (2, 4):
        with pytest.raises(UsageError, match="turn"):
            conversation.back_to(number)


def test_an_open_question_comes_back_and_can_be_answered(conversation, sent, told):
    told({"put the orange next to the box": "? 5 next to 3 | 5 next to 4"})
    assert conversation.say("put the cups in a line")
    assert not conversation.say("put the orange next to the box") and conversation.question is not None
    conversation.back_to(0)
    assert conversation.question is None
    conversation.back_to(1)
    assert conversation.question is not None and isinstance(sent[-1], events.Asked)
    assert conversation.answer(1) and str(conversation.situation.goal) == "5 next to 4"


def test_a_branch_keeps_the_other_one(conversation, sent):
    assert conversation.say("put the cups in a line") and conversation.say("on the left")
    conversation.back_to(1)
    conversation.fork()
    assert conversation.say("on the right")
    remembered = [event for event in sent if isinstance(event, events.Remembered)]
    assert [(one.turn, one.after, one.branch) for one in remembered] == [(1, 0, 1), (2, 1, 1), (3, 1, 2)]
    assert [event for event in sent if isinstance(event, events.Forked)] == [events.Forked(1, 2)]
    conversation.back_to(2)
    assert str(conversation.situation.goal) == "line of 0, 1, 2, left"
    conversation.back_to(3)
    assert str(conversation.situation.goal) == "line of 0, 1, 2, right"


@pytest.mark.parametrize("line", ["/back 2", "back to turn 2", "please go back to step 2", "/back  2"])
def test_a_turn_is_named_by_its_number(line):
    command, rest = command_of(line)
    assert (command.name, rest) == ("/back", "2")


def test_the_terminal_lists_the_turns_and_the_session_has_them(tmp_path):
    said = ("put the cups in a line", "make it a circle", "/back 1", "/fork", "on the right", "/timeline", "/back x")
    lines, screen, options = io.StringIO("\n".join(said)), io.StringIO(), RunOptions(str(DESK), model="geometric")
    run_chat(options, Console(file=screen, width=100), tmp_path / "session.jsonl", lines, False)
    shown = screen.getvalue()
    assert "branch 2 begins after turn 1; /back 1 returns here" in shown
    assert "> 3  on the right" in shown and "after 1, branch 2" in shown and "/back takes a whole number" in shown
    happened = [json.loads(line).get("event", {}) for line in (tmp_path / "session.jsonl").read_text().splitlines()]
    assert [(one["turn"], one["after"], one["branch"]) for one in happened if one.get("kind") == "remembered"] == [
        (1, 0, 1), (2, 1, 1), (3, 1, 2),
    ]  # fmt: skip

"""Conversations about goals of several parts, with questions in between;
proposals are made where they are the subject.
"""

from dataclasses import replace

import pytest

from agent import events
from agent.chat.conversation import Conversation
from agent.chat.input import PlainLines
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.dialogue.state import built
from tests.agent.chat.conftest import DESK
from tests.agent.event_log import EventLog


class Unplanned(Conversation):
    """A conversation that keeps what should be proposed, and plans nothing."""

    def _propose(self, situation):
        self._remember(situation)


@pytest.fixture
def talk(cache: ResourceCache, sent: EventLog):
    """Say lines as they are typed; returns the goal as it was spoken then."""
    import io
    from pathlib import Path

    from rich.console import Console

    with Unplanned(RunOptions(str(DESK), model="geometric", execute=False), cache, [sent]) as conversation:
        screen = ChatScreen(Console(file=io.StringIO()))
        chat = Chat(conversation, screen, PlainLines(io.StringIO(), print), Path("session.jsonl"))

        def say(*lines: str) -> str:
            for line in lines:
                chat.handle(line)
            return str(conversation.situation.spoken)

        say.conversation, say.chat = conversation, chat
        yield say


def last(sent, kind):
    return [event for event in sent if isinstance(event, kind)][-1]


TWO = "stack the boxes on the left and put the cups in a circle on the right"
PARTS = "tower of 3, 4, left; circle of 0, 1, 2, right"
TALK = {
    TWO: PARTS,
    "also put the orange behind the tower": "tower of 3, 4, left; circle of 0, 1, 2, large, right; 5 behind part 1",
    "put the orange on the other side": "tower of 3, 4, left; circle of 0, 1, 2, large, right; 5 in front of part 1",
    "drop the circle, keep the tower": "tower of 3, 4, left; 5 in front of part 1",
    "put the orange next to the box": "? 5 next to 3 | 5 next to 4",
    "put the orange next to box 1 and move cup 3 10 cm to the right": "5 next to 3; 2 moved right by 10 cm",
    "make the circle purple": "! it cannot be purple",
    "and the can": "-",
}  # fmt: skip


@pytest.fixture(autouse=True)
def talk_is_told(told):
    told(TALK)


def test_a_whole_conversation(talk, sent):
    assert talk(TWO) == PARTS
    assert last(sent, events.Parsed).parts == ("tower of box 1, box 2, left", "circle of cup 1, cup 2, cup 3, right")
    assert talk("make the circle bigger") == "tower of 3, 4, left; circle of 0, 1, 2, large, right"
    assert last(sent, events.Parsed).parts[1].endswith("(changed)")
    assert talk("what is the goal?") == "tower of 3, 4, left; circle of 0, 1, 2, large, right"
    answered = last(sent, events.Answered).answer
    assert "1. tower of box 1, box 2, left; 2. circle of cup 1, cup 2, cup 3, large, right" in answered
    talk("what is part 2?")
    assert last(sent, events.Answered).answer == "Part 2: circle of cup 1, cup 2, cup 3, large, right."
    talk("also put the orange behind the tower")
    assert last(sent, events.Parsed).parts[2] == "orange behind part 1 (new)"
    assert talk("put the orange on the other side").endswith("5 in front of part 1")
    assert talk("drop the circle, keep the tower") == "tower of 3, 4, left; 5 in front of part 1"
    assert last(sent, events.Noted).message == "no longer wanted: circle of cup 1, cup 2, cup 3, large, right"
    talk("what is left to do")
    assert last(sent, events.Answered).answer.startswith("Still to build: 1. tower of box 1")
    assert talk("undo").startswith("tower of 3, 4, left; circle")
    assert last(sent, events.Restored).parts[2] == "orange in front of part 1"
    assert talk("undo").endswith("5 behind part 1")
    assert talk("redo").endswith("5 in front of part 1")
    assert talk("is the orange red?").endswith("5 in front of part 1")
    assert talk("forget everything") == "nothing"
    assert talk("undo").endswith("5 in front of part 1")
    assert talk("forget that").endswith("5 behind part 1")
    assert talk("start over") == "nothing"


def test_a_correction_that_may_mean_two_parts_is_a_question(talk, sent):
    assert talk(TWO, "the other side") == PARTS
    asked = last(sent, events.Asked)
    assert (
        asked.options[0] == "tower of box 1, box 2, right; circle of cup 1, cup 2, cup 3, right"
        and len(asked.options) == 3
    )
    talk("what do you see")
    assert talk.conversation.question is not None
    assert talk("2") == "tower of 3, 4, left; circle of 0, 1, 2, left" and talk.conversation.question is None
    assert talk("undo", "the other side", "3") == "tower of 3, 4, right; circle of 0, 1, 2, left"
    assert talk("undo", "the other side", "never mind") == PARTS
    assert talk.conversation.question is None
    assert talk("the other side", "n") == PARTS


def test_an_object_that_is_not_clear_is_asked_for(talk, sent):
    talk("put the orange next to the box")
    assert last(sent, events.Asked).options == ("orange next to box 1", "orange next to box 2")
    assert talk("the pink one") == "5 next to 4"


def test_refusals_change_nothing(talk, sent):
    for line in ("make the circle purple", "also put the unicorn on box 1", "drop part 7", "5 cm more"):
        assert talk(TWO, line) == PARTS
        assert last(sent, events.Failed).message


def test_from_across_the_table_the_parts_are_the_speakers(talk):
    assert talk("/viewpoint opposite", TWO) == PARTS
    assert str(talk.conversation.situation.goal) == "tower of 3, 4, right; circle of 0, 1, 2, left"
    assert talk("the circle a bit further left") == "tower of 3, 4, left; circle of 0, 1, 2, center"
    assert talk("/viewpoint robot") == "tower of 3, 4, right; circle of 0, 1, 2, center"


def test_what_stands_is_not_built_again(cache, sent, told):
    told({"also put the orange behind the tower": "tower of 3, 4; 5 behind part 1", "stack all": "tower of 3, 4"})
    with Conversation(RunOptions(str(DESK), model="geometric", execute=False), cache, [sent]) as conversation:
        assert conversation.say("stack the boxes")
        now = conversation.situation
        conversation.situation = replace(now, dialogue=built(now.dialogue), proposal=None)
        assert conversation.situation.built
        assert not conversation.say("stack all") and "already so" in last(sent, events.Failed).message
        assert conversation.say("also put the orange behind the tower")
        assert "what was built before stays as it stands" in [
            note.message for note in sent if isinstance(note, events.Noted)
        ]
        assert [goal["name"] for goal in last(sent, events.Chosen).goals] == ["orange"]
        assert str(conversation.situation.goal).endswith("; 5 behind part 1")


def test_proposed_and_tried_without_the_arm(cache, sent):
    with Conversation(RunOptions(str(DESK), model="geometric", execute=False), cache, [sent]) as conversation:
        assert conversation.say("put the orange next to box 1 and move cup 3 10 cm to the right")
        chosen = last(sent, events.Chosen)
        assert {goal["name"] for goal in chosen.goals} == {"cup 3", "orange"}
        assert conversation.say("cup 3 5 cm more") and str(conversation.situation.goal).endswith(
            "2 moved right by 15 cm"
        )
        assert conversation.go() and last(sent, events.Checked).success


@pytest.mark.parametrize("answer", ["y", "1", "yes"])
def test_one_goal_that_is_offered_is_answered_with_yes(talk, told, answer):
    told({"a pyramid, then knock it over": "? pyramid of 0, 1, 2"})
    assert talk("a pyramid, then knock it over") == "nothing"
    assert talk.chat._prompt() == "[y/n] > "
    assert talk(answer) == "pyramid of 0, 1, 2"
    assert talk.conversation.situation.objects == ("cup 1", "cup 2", "cup 3")

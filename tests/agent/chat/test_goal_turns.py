"""Conversations about goals of several parts, with questions in between; proposals are made where they are the subject."""

import pytest

from agent import events
from agent.chat.conversation import Conversation
from agent.chat.input import PlainLines
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.spec import StructureSpec
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
            situation = conversation.situation
            return str(situation.spoken_parts or situation.goal)

        say.conversation, say.chat, say.screen = conversation, chat, screen
        yield say


def last(sent, kind):
    return [event for event in sent if isinstance(event, kind)][-1]


TWO = "stack the boxes on the left and put the cups in a circle on the right"


def test_a_whole_conversation(talk, sent):
    assert talk(TWO) == "tower of 3, 4, left; circle of 0, 1, 2, right"
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
    talk("what is left to do")
    assert last(sent, events.Answered).answer.startswith("Still to build: 1. tower of box 1")
    assert talk("undo").startswith("tower of 3, 4, left; circle")
    assert last(sent, events.Restored).parts[2] == "orange in front of part 1"
    assert talk("undo").endswith("5 behind part 1")
    assert talk("redo").endswith("5 in front of part 1")
    assert talk("is the orange red?").endswith("5 in front of part 1")
    assert talk("forget it") == "None"
    assert talk("undo").endswith("5 in front of part 1")
    assert talk("start over") == "None"


def test_a_correction_that_may_mean_two_parts_is_a_question(talk, sent):
    assert talk(TWO, "the other side") == "tower of 3, 4, left; circle of 0, 1, 2, right"
    asked = last(sent, events.Asked)
    assert asked.slot == "part" and asked.options[2] == "both"
    assert asked.options[0] == "part 1 (tower of box 1, box 2, left)"
    talk("what do you see")
    assert talk.conversation.question is not None
    assert talk("2") == "tower of 3, 4, left; circle of 0, 1, 2, left" and talk.conversation.question is None
    assert talk("undo", "the other side", "the tower") == "tower of 3, 4, right; circle of 0, 1, 2, right"
    assert talk("undo", "the other side", "both") == "tower of 3, 4, right; circle of 0, 1, 2, left"
    assert talk("undo", "the other side", "never mind") == "tower of 3, 4, left; circle of 0, 1, 2, right"
    assert talk.conversation.question is None
    assert talk("the other side", "scrap that, put the orange next to box 1") == "5 next to 3"


def test_an_object_that_is_not_clear_is_asked_for(talk, sent):
    talk("put the orange next to the box")
    assert last(sent, events.Asked).options == ("box 1", "box 2")
    assert talk("the pink one") == "5 next to 4"
    talk("also put cup 1 on the box")
    assert talk("1") == "5 next to 4; 0 on 3"


def test_one_structure_becomes_several_parts_and_one_again(talk, sent):
    talk("put the cups in a line")
    assert talk.conversation.situation.parts is None
    assert talk("and put the orange next to box 1") == "line of 0, 1, 2; 5 next to 3"
    assert talk("drop part 2") == "shape line"
    assert talk.conversation.situation.parts is None and talk.conversation.situation.objects == (
        "cup 1",
        "cup 2",
        "cup 3",
    )
    assert talk("bigger") == "shape line, size large"
    assert talk("gaps of 5 cm", "2 cm more") == "line of 0, 1, 2, gap 7 cm"  # which says its size


def test_a_question_in_form_can_be_an_instruction(talk):
    assert talk("can you put the orange next to box 1?") == "5 next to 3"
    assert talk("could you swap cup 1 and cup 2?") == "5 next to 3; 0, 1 swapped"
    assert talk("would you move the orange 10 cm to the left?") == "5 moved left by 10 cm; 0, 1 swapped"


def test_refusals_change_nothing(talk, sent):
    for line in (
        "drop the line",
        "make the circle purple",
        "also put the unicorn on box 1",
        "drop part 7",
        "5 cm more",
    ):
        assert talk(TWO, line) == "tower of 3, 4, left; circle of 0, 1, 2, right"
        assert last(sent, events.Failed).message


def test_from_across_the_table_the_parts_are_the_speakers(talk):
    assert talk("/viewpoint opposite", TWO) == "tower of 3, 4, left; circle of 0, 1, 2, right"
    assert str(talk.conversation.situation.parts) == "tower of 3, 4, right; circle of 0, 1, 2, left"
    assert talk("put the circle in the center") == "tower of 3, 4, left; circle of 0, 1, 2, center"
    assert talk("/viewpoint robot") == "tower of 3, 4, right; circle of 0, 1, 2, center"


def test_what_stands_is_not_built_again(talk, sent):
    from dataclasses import replace

    from agent.chat.state import Build

    talk(TWO, "also put the orange behind the tower")
    conversation = talk.conversation
    now = conversation.situation
    build = Build(now.goal or StructureSpec(), now.objects, now.poses, now.objects, "", now.parts, now.names)
    conversation.situation = replace(now, builds=(build,))
    assert conversation.situation.built
    assert talk("put the orange on the other side") == "5 in front of 3, 4"
    assert "what was built before stays as it stands" in [
        note.message for note in sent if isinstance(note, events.Noted)
    ]
    conversation.situation = replace(now, builds=(build,))
    assert talk("then put cup 1 next to the orange") == "0 next to 5"
    conversation.situation = replace(now, builds=(build,))
    talk("drop the circle")
    assert "it stands already" in last(sent, events.Failed).message


def test_proposed_and_tried_without_the_arm(cache, sent):
    with Conversation(RunOptions(str(DESK), model="geometric", execute=False), cache, [sent]) as conversation:
        assert conversation.say("put the orange next to box 1 and move cup 3 10 cm to the right")
        chosen = last(sent, events.Chosen)
        assert {goal["name"] for goal in chosen.goals} == {"cup 3", "orange"}
        assert conversation.say("5 cm more") and str(conversation.situation.parts).endswith("2 moved right by 15 cm")
        assert conversation.go() and last(sent, events.Checked).success


KNOCKED = "pile the cups up in a pyramid, then knock it over"


@pytest.mark.parametrize("answer", ["y", "1", "yes"])
def test_a_refusal_asks_for_what_it_may_mean(talk, sent, answer):
    assert talk(KNOCKED) == "None"
    question = talk.conversation.question
    assert "'knock'" in question.text and question.text.endswith("is this what is meant?")
    assert question.options == ("pyramid of cup 1, cup 2, cup 3",)
    assert talk.chat._prompt() == "[y/n] > "
    assert talk(answer) == "shape pyramid"
    assert talk.conversation.situation.objects == ("cup 1", "cup 2", "cup 3")


def test_a_suggestion_that_is_not_meant_is_dropped(talk):
    assert talk(KNOCKED, "no") == "None" and talk.conversation.question is None
    assert talk(KNOCKED, "stack the boxes") == "shape tower"


def test_what_was_declined_is_not_corrected_by_a_refused_instruction(talk, sent):
    talk("stack the boxes")
    talk.conversation.drop()
    talk("put the orange in front of box 1 tomorrow")
    assert "tomorrow" in last(sent, events.Failed).message

"""Objects of a recording get their nouns in conversation: what says so, what does not, and what follows."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from agent import events
from agent.chat.conversation import Conversation
from agent.chat.naming import named_indices, naming_of
from agent.errors import UsageError
from agent.event_base import json_value
from agent.pipeline.run import RunOptions
from agent.reporting.event_text import describe_object
from agent.scenes.renaming import renamed


@pytest.mark.parametrize(
    ("line", "numbers", "noun"),
    [
        ("object 3 is a bowl", (3,), "bowl"),
        ("Object 3 is really a bowl.", (3,), "bowl"),
        ("number 3 is a bowl", (3,), "bowl"),
        ("#3 is a small bowl", (3,), "small bowl"),
        ("ok, object number 3 is a bowl", (3,), "bowl"),
        ("object three is a plate", (3,), "plate"),
        ("object 2 and 4 are cans", (2, 4), "can"),
        ("objects 2, 4 and 5 are all cans", (2, 4, 5), "can"),
        ("object 2 and object 4 are cans", (2, 4), "can"),
        ("call object 1 the red mug", (1,), "red mug"),
        ("please name object 5 spoon", (5,), "spoon"),
        ("cup 1 is really a bowl", (1,), "bowl"),
        ("can 5 is in fact a mug", (5,), "mug"),
        ("object 3's a bowl", (3,), "bowl"),
        ("object 1 should be called mug", (1,), "mug"),
        ("treat object 2 as a knife", (2,), "knife"),
        ("object 2 is a gizmo", (2,), "gizmo"),
    ],
)
def test_what_gives_a_noun(line, numbers, noun):
    found = naming_of(line)
    assert (found.numbers, found.noun) == (numbers, noun)


@pytest.mark.parametrize(
    "line",
    [
        "put object 3 in a bowl", "object 3 is red", "object 3 is missing", "is object 3 a bowl?", "what is object 3",
        "object 3 is on the left", "object 3 is a bit too far away", "object 1 is next to object 2",
        "object 3 is wobbly", "object 3 is the tallest", "object 2 and 4 are the ends", "stack object 3 on bowl 2",
        "use object 3 as the corner of a square", "put number 3 in the middle", "call it a day", "the bowl is a bowl",
        "move object 3 to the left", "object 3 is the first in the line", "cup 1 is the centre",
    ],
)  # fmt: skip
def test_what_gives_none(line):
    assert naming_of(line) is None


def test_numbers_and_kinds_are_checked():
    names, shown = ("object 2", "object 1"), ("cup or mug 2, red", "object 1, blue")
    assert named_indices(naming_of("objects 1 and 2 are bowls"), names, shown) == [1, 0]
    assert named_indices(naming_of("mug 2 is a bowl"), names, shown) == [0]
    with pytest.raises(UsageError, match="there is no object 7; legal: 1, 2"):
        named_indices(naming_of("object 1 and 7 are bowls"), names, shown)
    with pytest.raises(UsageError, match="no can 2, object 2 is cup or mug 2"):
        named_indices(naming_of("can 2 is a bowl"), names, shown)


def test_a_recordings_objects_keep_their_nouns_for_the_conversation(cache, sent):
    with Conversation(RunOptions("example", model="geometric"), cache, [sent]) as talk:
        assert talk.replied("object 3 is a bowl") and talk.question is None and not talk.situation.asked
        (answered,) = [event for event in sent if isinstance(event, events.Answered)]
        assert answered.answer.startswith("object 3 is bowl 3, purple")
        seen = {one.name: one for one in talk.look().objects}
        assert seen["bowl 3"].display_name == "bowl 3, purple" and seen["bowl 3"].category == "bowl"
        assert describe_object(json_value(seen["bowl 3"])) == "bowl 3, purple"
        with pytest.raises(UsageError, match="no object 9; legal: 1, 2, 3, 4"):
            talk.replied("object 9 is a bowl")
        assert talk.replied("object 4 is a bowl") and talk.say("put the bowls in a line")
        assert set(talk.situation.objects) == {"bowl 3", "bowl 4"}
        assert talk.replied("bowl 4 is really a plate")
        proposal = talk.situation.proposal
        assert {goal["name"] for goal in proposal.chosen.goals} == {"bowl 3", "plate 4"}
        assert "plate 4, green" in talk.table.display_names and talk.table.referents[0].name.startswith("bowl 3")
    with Conversation(RunOptions("example", model="geometric"), cache, [sent]) as other:
        assert not any("bowl 3" in words for words in other.table.display_names)


def test_objects_with_names_of_their_own_are_not_renamed(conversation):
    with pytest.raises(UsageError, match="only the objects of a recording"):
        conversation.replied("cup 1 is a bowl")


def test_a_noun_that_is_given_while_a_proposal_is_pending_is_the_name_from_then_on(cache, sent, tmp_path):
    with Conversation(RunOptions("example", model="geometric", execute=False), cache, [sent]) as talk:
        assert talk.say("put object 3 on the left") and talk.replied("call object 1 the red mug")
        before, at_work = len(sent), talk.situation.proposal
        assert talk.replied("object 3 is a bowl")
        answered, seen, chosen = sent[before:]
        assert isinstance(seen, events.Perceived) and {one.name for one in seen.objects} >= {"bowl 3", "red mug 1"}
        assert [goal["name"] for goal in chosen.goals] == ["bowl 3"]
        assert not any("object 1 is taken" in note for note in seen.notes)
        proposal = talk.situation.proposal
        assert talk.situation.shown is proposal and proposal.viable_count == at_work.viable_count
        assert talk.go()
        checked = [event for event in sent if isinstance(event, events.Checked)][-1]
        names = json.dumps(json_value(checked.checks))
        assert "bowl 3 at left" in names and "object 3" not in names
        talk.undo()  # to what was before it had that name
        assert talk.say("put object 3 at the front") and talk.situation.objects == ("bowl 3",)


def test_names_change_within_sentences_and_what_is_one_object_stays_one():
    @dataclass(frozen=True)
    class Wish:
        objects: tuple[str, ...]
        poses: dict[str, np.ndarray]
        text: str
        count: int = 3

    pose = np.eye(4)
    wish = Wish(("object 3", "object 31"), {"object 3": pose}, "object 3 on object 31")
    untouched = Wish(("cup",), {"cup": pose}, "cup")
    first, second, same = renamed([wish, {"a": wish}, untouched], {"object 3": "object 31", "object 31": "object 3"})
    assert first.objects == ("object 31", "object 3") and first.text == "object 31 on object 3"
    assert first.poses["object 31"] is pose and second["a"] is first and same is untouched

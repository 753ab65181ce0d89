"""Lines that give a structure a name, and words for the structure before."""

import pytest

from agent import events
from agent.chat.teaching import taught_name, with_structure_before
from agent.errors import UsageError
from agent.figures.taught import taught_names
from agent.runtime.output_ownership import OwnFolder
from grounding.figures.figure import FigureError
from grounding.figures.files import write_figure
from grounding.figures.names import VARIABLE, figure_named
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart


@pytest.mark.parametrize(("line", "name"), [
    ("call this a gate", "a gate"), ("Call it the city gate, please.", "the city gate"),
    ("let's call this structure a fort", "a fort"),
    ("remember this as my fort", "my fort"), ("this is called a roof", "a roof"), ("save that figure as roof", "roof"),
    ("call object 3 a mug", None), ("this is a mess", None), ("what do you call this?", None),
    ("put the cups in a roof", None),
])  # fmt: skip
def test_names(line, name):
    assert (taught.name if (taught := taught_name(line)) else None) == name


def test_the_structure_before_stands_in_its_own_noun():
    goal = Goal((StructurePart("letter T", objects=(0, 1, 2, 3)),))
    assert with_structure_before("one like the one before, but bigger", goal) == "a letter T, but large"
    assert with_structure_before("another one like the last one with the cans", goal) == "a letter T with the cans"
    assert with_structure_before("a bit bigger", goal) == "a bit bigger"
    with pytest.raises(UsageError, match="there is no structure before"):
        with_structure_before("like the one before", Goal())
    said = "one like the last one"
    assert with_structure_before(said, Goal(), "like x.toml") == said  # the example is meant


def test_a_proposal_gets_a_name_and_can_be_asked_for_by_it(cache, conversation, sent, told, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    told({})
    assert conversation.say("put the cups in a line")
    assert conversation.replied("call this a fence")
    assert taught_names() == ("fence",) and len(figure_named("fence").strokes) == 1
    answered = [event for event in sent if isinstance(event, events.Answered)][-1]
    assert "From now on this is a fence, of 2 or more objects" in answered.answer
    assert conversation.situation.proposal is not None  # naming changes nothing else
    with pytest.raises(UsageError, match="'circle' is 'circle' already"):
        conversation.taught("call this a circle")


def test_a_conversation_about_a_figure(conversation, tmp_path, monkeypatch):
    """Read by the networks that users have."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert conversation.say("make a letter L out of everything")
    assert str(conversation.situation.goal) == "letter L of everything else"
    assert conversation.replied("call this a hook")
    assert figure_named("hook").strokes == figure_named("letter L").strokes
    assert conversation.say("turn the L around")
    assert str(conversation.situation.goal) == "letter L of everything else, facing north"
    assert not conversation.say("make it a hook") and conversation.answer(0)  # facing north still, or not
    assert [part.shape for part in conversation.situation.goal.structures] == ["hook"]
    assert not conversation.say("write HELLO with the cups")
    assert [part.shape for part in conversation.situation.goal.structures] == ["hook"]


def test_an_example_is_shown_and_copied_in_a_conversation(conversation, tmp_path, monkeypatch):
    """Read by the networks that users have."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "none"))
    write_figure(figure_named("letter L"), tmp_path / "corner.toml")
    name = conversation.show_example(tmp_path / "corner.toml", False, OwnFolder(tmp_path / "chat", "chat")).name
    assert conversation.say("the same with everything")
    assert [part.shape for part in conversation.situation.goal.structures] == [name]
    assert conversation.say("now a line")
    assert [part.shape for part in conversation.situation.goal.structures] == ["line"]
    assert conversation.say("now the example with everything")
    assert [part.shape for part in conversation.situation.goal.structures] == [name]
    with pytest.raises(UsageError, match="/parser cannot be llm here"):
        conversation.read_with("llm")
    with pytest.raises(FigureError, match="is a drawing without poses"):
        conversation.show_example(tmp_path / "corner.toml", True, OwnFolder(tmp_path / "chat", "chat"))

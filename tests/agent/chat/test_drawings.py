"""A whole chat with a language model that draws: shown, asked about, named again, and kept."""

import io
import re

import pytest
from rich.console import Console

from agent.chat.conversation import Conversation
from agent.chat.input import PlainLines
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.run import RunOptions
from grounding.figures.drawings import drawing_shape
from grounding.figures.names import VARIABLE, figure_named
from tests.agent.chat.conftest import DESK
from tests.grounding.language_model.artist import HOOK, Artist, build, drawn
from tests.grounding.language_model.oracle import MODEL, serving_oracle

NAMED = {"kind": "structure", "shape": "hook"}
SCRIPT = {
    "make a hook out of the cups and box 2": build(drawn("hook", HOOK, objects=[0, 1, 2, 4])),
    "put the cups in a line": build({"kind": "structure", "shape": "line", "objects": [0, 1, 2]}),
    "another one with the cups and box 1": build(NAMED | {"objects": [0, 1, 2, 3]}),
    "make a ghost": build(drawn("ghost", {"strokes": [[[1, 1]]], "least": 1})),
}
FIRST = """\
o
o
o
o
o
o
o
o
o               o
o               o
o               o
o               o
ooooooooooooooooo
there is no figure 'hook', so the language model has drawn one; build this: hook of cup 1, cup 2, cup 3, box 2?
  1  hook of cup 1, cup 2, cup 3, box 2

[y/n] > """


@pytest.fixture
def talked(cache, sent, tmp_path, monkeypatch):
    """Talks lines with a model that draws; what was shown, the conversation, and the messages to the model."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "structures"))

    def talk(*lines):
        with serving_oracle(Artist(SCRIPT)) as artist:
            reading = ReadingOptions("llm", llm_url=artist.url, llm_model=MODEL)
            with Conversation(RunOptions(str(DESK), model="geometric", reading=reading), cache, []) as conversation:
                console = Console(file=io.StringIO(), width=140)
                screen = ChatScreen(console)
                conversation.listeners = [sent, screen]
                source = PlainLines(
                    io.StringIO("\n".join(lines) + "\n"), lambda text: console.print(text, end="", markup=False)
                )
                Chat(conversation, screen, source, tmp_path / "session.jsonl").run()
                return console.file.getvalue(), conversation, artist.messages

    return talk


def test_a_whole_chat(talked):
    shown, conversation, messages = talked(
        "make a hook out of the cups and box 2", "no", "make a hook out of the cups and box 2", "yes", "n",
        "put the cups in a line", "n", "another one with the cups and box 1", "call this a fish hook", "n",
    )  # fmt: skip
    shape = drawing_shape("hook", HOOK)
    assert (
        shown.count(FIRST) == 2 and shown.count("so the language model has drawn one") == 2
    )  # the third time it is known
    after_no = shown.split(FIRST)[1]
    assert "the question is dropped; say it another way" in after_no and "proposed" not in after_no
    assert re.search(r"\n  shape +hook\n", shown) and "build it? [y/n] > " in shown.split(FIRST)[2]
    assert "figures" not in messages[0]
    assert [one["figures"] for one in messages if one["instruction"].startswith("another")] == [["hook"]]
    assert [part.shape for part in conversation.situation.goal.structures] == [shape]
    assert "From now on this is a fish hook, of 4 or more objects" in shown
    assert figure_named("fish hook").strokes == figure_named(shape).strokes
    assert "<" not in shown  # a drawing is told by its noun


def test_a_drawing_that_cannot_be_had_is_refused_and_said(talked):
    shown, conversation, messages = talked("make a ghost")
    assert [message.get("problem", "") for message in messages[:2]] == [
        "", "strokes of one point show nothing; legal: two points or more that lie apart"
    ]  # fmt: skip
    assert not conversation.situation.asked and conversation.question is None
    assert "[y/n]" not in shown
    told = " ".join(shown.split())
    assert "'make a ghost' does not ask for an arrangement" in told
    assert "strokes of one point show nothing" in told and "the default parser read this instead" in told

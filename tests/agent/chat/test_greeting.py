"""What is suggested first can be read, means what it should, and can be built."""

import re
from pathlib import Path

import pytest

from agent.chat.conversation import Conversation
from agent.chat.greeting import invitation, suggestion
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.run import RunOptions
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from grounding.spec import StructureSpec
from tests.agent.chat.conftest import DESK

SENTENCE = "put the cups in a small circle on the left"  # of the README
ROOT = Path(__file__).resolve().parents[3]
# What a reader says or types: in quotation marks, or after the prompt of a chat.
SAID = re.compile(r"""(?:["“]|^> )((?:put|stack|line up|make) [^"”\n]+)""", re.MULTILINE)
SEED = re.compile(r"structagent (?:serve|chat|mcp)[^\n#]*--seed (\d+)")


def assert_can_be_read(cache, table, suggested):
    """The words mean the slots and the objects that are meant."""
    read = cache.interpreter(ReadingOptions()).interpret(suggested.text)
    assert (read.status, read.spec) == ("ok", suggested.spec)
    words = re.search(r"the \w+|everything", suggested.text).group()
    indices = resolve_phrase(words, Referents(table.display_names, cache.encoder)).indices
    assert {table.names[index] for index in indices} == set(suggested.objects)


@pytest.mark.parametrize("objects", ["ycb", "procedural"])
def test_every_table_that_is_drawn_has_an_instruction_that_can_be_read(cache, objects):
    source = cache.source("simulated", objects)
    others = set()
    for seed in range(10):
        with source.set_out(seed) as table:
            suggested = suggestion(table, table.look())
            assert suggested is not None, seed
            assert suggested.text == SENTENCE and len(suggested.objects) == 4
            assert_can_be_read(cache, table, suggested)
            others.update(model.category for model in table.models)
    assert len(others) > 4, "another table has other objects too"


def first_sentences() -> dict[str, str]:
    """The first sentence that each document about the conversation tells its reader to say, by the document's name."""
    names = ("README.md", "docs/chat.md", "docs/live-view.md", "docs/mcp.md")
    said = {name: SAID.findall((ROOT / name).read_text()) for name in names}
    assert all(said.values()), said
    return {name: sentences[0] for name, sentences in said.items()}


def named_seeds() -> set[int]:
    """The seeds of the commands in the documents that set a table to talk about."""
    return {
        int(seed)
        for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
        for seed in SEED.findall(path.read_text())
    }


def commands_of_the_tour() -> list[str]:
    """The instructions for simulated tables in the README's tour."""
    tour = (ROOT / "README.md").read_text().partition("## Three-minute tour")[2].partition("\n## ")[0]
    return re.findall(r'structagent run "([^"]+)"(?![^\n]*--scene)', tour)


@pytest.mark.parametrize("seed", sorted({0, 1, 3, 4, *named_seeds()}))
def test_the_first_sentence_of_each_document_works_on_every_table(cache, seed):
    assert 2 in named_seeds() and len(commands_of_the_tour()) == 2
    sentences = {**first_sentences(), **{f"README.md, {text}": text for text in commands_of_the_tour()}}
    options = RunOptions("simulated", model="geometric", seed=seed)
    for text in dict.fromkeys(sentences.values()):
        with Conversation(options, cache, []) as conversation:
            assert conversation.say(text), [name for name, said in sentences.items() if said == text]


def test_the_first_table_suits_the_sentence_of_the_readme(cache):
    with cache.source("simulated", "ycb").set_out(0) as table:
        suggested = suggestion(table, table.look())
    assert suggested.text == SENTENCE and suggested.objects == ("cup 1", "cup 2", "cup 3", "cup 4")
    assert invitation(suggested) == f"Say what to build, for example “{SENTENCE}”."
    assert invitation(None) == "Say what to build."


def test_what_is_suggested_is_built(cache, sent):
    options = RunOptions("simulated", model="geometric", seed=1, hold="weld")
    with Conversation(options, cache, [sent]) as conversation:
        suggested = conversation.example()
        assert conversation.say(suggested.text)
        assert conversation.situation.goal.plain_spec == suggested.spec
        assert set(conversation.situation.objects) == set(suggested.objects)
        assert conversation.go(), sent[-2:]


def test_a_recording_without_nouns(cache, monkeypatch):
    monkeypatch.setattr("agent.perception.nouns.recognition.nouns_available", lambda: False)
    with cache.source("example", "ycb").set_out(0) as table:
        suggested = suggestion(table, table.look())
        assert suggested.text.startswith("put everything in a ")
        assert_can_be_read(cache, table, suggested)


def set_out(cache, tmp_path, *rows):
    file = tmp_path / "scene.yaml"
    file.write_text("version: 1\nobjects:\n" + "".join(f"- {{{row}}}\n" for row in rows))
    return cache.source(str(file), "ycb").set_out(0)


def test_scene_files(cache, tmp_path):
    with cache.source(str(DESK), "ycb").set_out(0) as table:
        assert suggestion(table, table.look()).text == SENTENCE
    two = (
        "mesh: ycb/065-g_cups, x: 0.30, y: -0.30",
        "mesh: ycb/065-h_cups, x: 0.30, y: 0.20",
        "mesh: ycb/banana, x: 0.60, y: 0.0",
    )
    with set_out(cache, tmp_path, *two) as table:
        suggested = suggestion(table, table.look())
        assert suggested.text == "stack the cups on the right" and suggested.spec == StructureSpec(
            "tower", None, "right"
        )
        assert_can_be_read(cache, table, suggested)
    with set_out(cache, tmp_path, "mesh: ycb/banana, x: 0.60, y: 0.0") as table:
        assert suggestion(table, table.look()) is None


def test_there_is_no_suggestion_of_what_carries_something(cache, tmp_path):
    cups = [f"mesh: ycb/065-{letter}_cups, x: 0.{x}, y: 0.3" for letter, x in zip("ghi", (25, 40, 55))]
    with set_out(cache, tmp_path, *cups, "mesh: ycb/plum, x: 0.40, y: -0.3") as table:
        assert suggestion(table, table.look()).text == SENTENCE
        pose = table.poses()["cup 2"].copy()
        pose[2, 3] = table.models[1].height
        table.world.set_pose(table.names.index("plum"), pose)
        assert suggestion(table, table.look()) is None

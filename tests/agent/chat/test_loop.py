"""The loop: what a line is taken for, and what becomes of errors."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from agent import events
from agent.chat.lines import PlainLines
from agent.chat.loop import Chat
from agent.chat.screen import ChatScreen


@pytest.fixture
def chat_of(conversation, heard, tmp_path):
    """Talks the given lines; what was shown, and the chat."""

    def talk(*lines: str, yes: bool = False) -> tuple[str, Chat]:
        console = Console(file=io.StringIO(), width=100)
        screen = ChatScreen(console)

        def tell(event):
            heard.append(event)
            screen(event)

        conversation._tell = tell
        source = PlainLines(io.StringIO("\n".join(lines) + "\n"), lambda text: console.print(text, end=""))
        chat = Chat(conversation, screen, source, tell, tmp_path / "session.jsonl", yes)
        chat.run()
        return console.file.getvalue(), chat

    return talk


@pytest.mark.parametrize("line", ["y", "1", "no"])
def test_a_decision_needs_a_proposal(chat_of, line):
    shown, _ = chat_of(line)
    assert "there is no proposal; say what to build, or /again" in shown


def test_answers(chat_of, conversation):
    shown, _ = chat_of("put the cups", "7", "yes", "n", "put the cups", "line")
    assert "'7' is no answer; legal: 1 to 4, or say it differently" in shown
    assert "'yes' is no answer" in shown and "the question is dropped" in shown
    assert conversation.situation.wish.shape == "line"


def test_yes_builds_at_once(chat_of):
    shown, _ = chat_of("stack the boxes on the right", yes=True)
    assert "build it?" not in shown and "It stands as it was asked for." in shown


def test_without_the_arm_the_map_is_that_of_what_was_tried(chat_of, conversation, heard):
    conversation.options = replace(conversation.options, execute=False)
    before = conversation.table.poses()
    shown, _ = chat_of("stack the boxes on the right", yes=True)
    _, _, after = shown.partition("tried without the arm; the table is unchanged")
    assert after.count("+--") == 2 and "stacked: " in after  # one map, of the tower; the table has none
    assert "It stands" not in shown and "It holds as it was asked for, tried without the arm" in " ".join(after.split())
    assert all((pose == before[name]).all() for name, pose in conversation.table.poses().items())
    kinds = [events.kind_of(event) for event in heard]
    assert kinds.index("tried") < kinds.index("pictured") < kinds.index("checked")


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("/seed 9999999999999999999999999999", "/seed takes a whole number from 0 to 9223372036854775807"),
        ("/choose -1", "/choose takes a whole number from 1 on, got '-1'"),
        ("/save table.txt", "/save needs a file that ends in .yaml or .yml, got 'table.txt'"),
        ("/load missing.yaml", "missing.yaml"),
        ("/go", "there is no proposal"),
        ("/undo", "there is nothing to undo"),
        ("/scene old", "/scene takes new, got 'old'"),
        ("/parser gpt", "/parser takes embedding or llm, got 'gpt'"),
    ],
)
def test_wrong_values_get_a_sentence(chat_of, line, sentence):
    shown, chat = chat_of(line)
    assert sentence in shown and chat.defects == 0


def test_a_folder_is_no_file_to_save_to(chat_of, tmp_path):
    folder = tmp_path / "folder.yaml"
    folder.mkdir()
    shown, _ = chat_of(f"/save {folder}")
    assert "is a folder" in "".join(shown.split("\n"))


def test_a_file_is_overwritten_at_the_second_time_of_asking(chat_of, tmp_path):
    path = tmp_path / "table.yaml"
    path.write_text("mine")
    chat_of(f"/save {path}")
    assert path.read_text() == "mine"
    chat_of(f"/save {path}", f"/save {path}")
    assert path.read_text().startswith("# structagent chat")


def test_a_defect_costs_a_line_and_is_kept(chat_of, conversation, tmp_path):
    def broken(text):
        raise RuntimeError("out of order")

    conversation.say = broken
    shown, chat = chat_of("put the cups in a line", "/seed")
    assert "a defect of structagent, RuntimeError: out of order" in shown and "seed: 0" in shown
    assert chat.defects == 1 and "RuntimeError: out of order" in (tmp_path / "traceback.txt").read_text()


def test_a_page_does_not_overwrite_what_is_no_page(chat_of, tmp_path):
    scene, page = tmp_path / "mine.yaml", tmp_path / "mine.html"
    scene.write_text("mine")
    page.write_text("mine")
    shown, _ = chat_of(f"/report {scene}", f"/report {page}")
    assert "/report needs a file that ends in .html" in shown and "overwrites it" in " ".join(shown.split())
    assert scene.read_text() == page.read_text() == "mine"


def test_another_table_is_another_talk(chat_of):
    shown, chat = chat_of("put the cups in a row", "/scene new 5", "/why", "/candidates")
    assert shown.count("nothing was imagined yet") == 2 and chat.defects == 0

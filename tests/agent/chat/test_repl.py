"""The loop: what a line is taken for, and what becomes of errors."""

import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from agent import events
from agent.arm.events import Placed
from agent.chat.input import PlainLines
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.event_base import kind_of
from agent.reporting.event_schema import payload_error
from agent.reporting.event_text import remark_sentence
from agent.reporting.run_report import RunRecord


def assert_stands_at(conversation, poses):
    for name, pose in conversation.table.poses().items():
        assert np.abs(pose - poses[name]).max() < 1e-6, name


pytestmark = pytest.mark.usefixtures("told")


@pytest.fixture
def chat_of(conversation, sent, tmp_path):
    """Talks the given lines; what was shown, and the chat."""

    def talk(*lines: str, yes: bool = False) -> tuple[str, Chat]:
        console = Console(file=io.StringIO(), width=100)
        screen = ChatScreen(console)

        conversation.listeners = [sent, screen]
        source = PlainLines(io.StringIO("\n".join(lines) + "\n"), lambda text: console.print(text, end=""))
        chat = Chat(conversation, screen, source, tmp_path / "session.jsonl", yes)
        chat.run()
        return console.file.getvalue(), chat

    return talk


@pytest.mark.parametrize("line", ["y", "1", "no"])
def test_a_decision_needs_a_proposal(chat_of, line):
    shown, _ = chat_of(line)
    assert "there is no proposal; say what to build, or /again" in shown


def test_answers(chat_of, conversation):
    shown, _ = chat_of("put the cups", "70", "yes", "n", "put the cups", "line")
    assert "'70' is not an answer; legal: 1 to 3, or say it differently" in shown
    assert "'yes' is not an answer" in shown and "the question is dropped" in shown
    assert conversation.situation.goal.plain_spec.shape == "line"


def test_yes_builds_at_once(chat_of):
    shown, _ = chat_of("stack the boxes on the right", yes=True)
    assert "build it?" not in shown and "It stands as asked." in shown


def test_without_the_arm_the_map_is_that_of_what_was_tried(chat_of, conversation, sent):
    conversation.options = replace(conversation.options, execute=False)
    before = conversation.table.poses()
    shown, _ = chat_of("stack the boxes on the right", yes=True)
    _, _, after = shown.partition("tried without the arm; the table is unchanged")
    assert after.count("+--") == 2 and "stacked: " in after  # one map, of the tower; the table has none
    assert "It stands" not in shown and "The goal holds as asked when released without the arm" in " ".join(
        after.split()
    )
    assert all((pose == before[name]).all() for name, pose in conversation.table.poses().items())
    kinds = [kind_of(event) for event in sent]
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


def test_what_cannot_be_written_decides_how_the_chat_ends(chat_of, tmp_path, monkeypatch):
    def no_room(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    kept = tmp_path / "table.yaml"
    kept.write_text("mine")
    monkeypatch.setattr("os.fsync", no_room)
    shown, chat = chat_of(f"/save {kept}", f"/save {kept}", "/seed")
    assert "no space left on device" in " ".join(shown.split()) and "seed: 0" in shown  # the chat goes on
    assert kept.read_text() == "mine" and [path.name for path in tmp_path.iterdir()] == ["table.yaml"]
    assert (chat.unwritten, chat.exit_code) == (1, 6)
    _, chat = chat_of("/seed")
    assert chat.exit_code == 0


def test_a_defect_costs_a_line_and_is_kept(chat_of, conversation, tmp_path):
    def broken(text):
        raise RuntimeError("out of order")

    conversation.say = broken
    shown, chat = chat_of("put the cups in a line", "/seed")
    assert "a defect of structagent, RuntimeError: out of order" in shown and "seed: 0" in shown
    assert chat.defects == 1 and "RuntimeError: out of order" in (tmp_path / "traceback.txt").read_text()


@pytest.mark.parametrize(
    "after", [["put everything in a line with gaps of 30 cm"], ["put the cups in a circle", "/undo"]]
)
def test_the_proposal_before_is_shown_and_tried_with_its_own_objects(chat_of, conversation, sent, after):
    conversation.options = replace(conversation.options, execute=False)
    shown, chat = chat_of("stack the boxes", *after, "/candidates 1", "y")
    assert chat.exit_code == 0 and "no arrangement has been proposed yet" not in shown
    assert ("the proposal before it is unchanged" in shown) == (len(after) == 1)
    place, tried = [(n, event) for n, event in enumerate(sent) if isinstance(event, events.Tried)][-1]
    seen = [event for event in sent[:place] if isinstance(event, events.Perceived)][-1]
    assert len(tried.positions) == sum(one.takes_part for one in seen.objects) == 2


def test_a_page_does_not_overwrite_what_is_no_page(chat_of, tmp_path):
    scene, page = tmp_path / "mine.yaml", tmp_path / "mine.html"
    scene.write_text("mine")
    page.write_text("mine")
    shown, _ = chat_of(f"/report {scene}", f"/report {page}")
    assert "/report needs a file that ends in .html" in shown and "overwrites it" in " ".join(shown.split())
    assert scene.read_text() == page.read_text() == "mine"


def test_another_table_is_another_talk(chat_of):
    shown, chat = chat_of("put the cups in a row", "/scene new 5", "/why", "/candidates")
    assert shown.count("no arrangement has been proposed yet") == 2 and chat.defects == 0


QUESTIONS = ("hello", "what do you see", "where is the orange", "why that one", "what are you going to do", "thanks")


def test_small_talk_and_questions_are_answered_and_change_nothing(chat_of, conversation, sent):
    for line in QUESTIONS:
        chat_of(line)
        assert not conversation.situation.asked and conversation.question is None
    for before in ("put the cups in a small circle on the left", "put the cups"):
        conversation.say(before)
        situation, question = conversation.situation, conversation.question
        for line in QUESTIONS:
            sent.clear()
            shown, _ = chat_of(line)
            (answered,) = sent
            assert isinstance(answered, events.Answered) and answered.question == line
            assert " ".join(answered.answer.split()[:3]) in " ".join(shown.split())
            assert conversation.situation is situation and conversation.question is question


def test_an_instruction_beside_a_greeting_is_an_instruction(chat_of, conversation):
    chat_of("hello, can you put the cups in a line?")
    assert conversation.situation.goal.plain_spec.shape == "line"
    chat_of("thanks, what about a circle?")
    assert conversation.situation.goal.plain_spec.shape == "circle"


def test_a_question_that_cannot_be_answered_is_no_bad_instruction(chat_of, sent):
    shown, _ = chat_of("who won the football match?")
    (answered,) = sent
    assert answered.answer.startswith("I cannot answer that.") and "does not ask for an arrangement" not in shown
    shown, _ = chat_of("what a nice day")
    assert "does not ask for an arrangement" in shown


def test_answers_are_kept_with_the_session(chat_of, sent):
    chat_of("where is the orange")
    payload = sent[0].to_dict()
    assert payload["kind"] == "answered" and payload_error(payload) is None
    record = RunRecord()
    record.on_event(sent[0])
    assert record.report["remarks"] == [payload]
    assert remark_sentence(payload).startswith("The orange is on the left")


def test_commands_in_words_before_anything_was_asked(chat_of, sent):
    shown, chat = chat_of("stop", "clear", "continue", "put it back", "start over")
    for sentence in (
        "there is no proposal and no question", "there is no goal", "you have not asked for anything yet; say what "
        "to build",
        "there is nothing to put back", "everything is as it was at the start",
    ):  # fmt: skip
        assert sentence in shown
    assert chat.defects == 0


def test_stop_drops_a_proposal_and_continue_takes_it_up_again(chat_of, conversation):
    shown, _ = chat_of("put the cups in a small circle on the left", "stop")
    assert "the proposal is dropped; nothing was moved" in shown and conversation.situation.proposal is None
    chat_of("continue")
    assert conversation.situation.proposal is not None and conversation.situation.goal.plain_spec.size == "small"
    chat_of("put the cups", "stop")
    assert conversation.question is None and conversation.situation.goal.plain_spec.size == "small"


def test_continue_asks_again_where_a_question_stands(chat_of, conversation):
    shown, _ = chat_of("put the cups", "go on")
    assert shown.count("which of these is meant") == 2 and conversation.question is not None


def test_clear_drops_the_wish_and_can_be_undone(chat_of, conversation):
    chat_of("put the cups in a circle", "forget it")
    assert not conversation.situation.asked and conversation.situation.proposal is None
    chat_of("undo")
    assert conversation.situation.goal.plain_spec.shape == "circle"
    chat_of("stack the boxes", "put the cups", "clear")
    assert conversation.question is None and not conversation.situation.asked


def test_building_putting_back_and_starting_over(chat_of, conversation):
    start = conversation.table.poses()
    shown, _ = chat_of("put the cups in a small circle on the left", "go on", "what did you just do", "continue")
    assert "I built a small circle of cup 1, cup 2 and cup 3 (left), and it stands as asked." in " ".join(shown.split())
    assert "it already stands as asked; say what to change" in shown
    circle = conversation.table.poses()
    chat_of("put everything back where it was")
    assert_stands_at(conversation, start)
    assert conversation.situation.goal.plain_spec.shape == "circle"
    chat_of("undo")
    assert_stands_at(conversation, circle)
    chat_of("now as a line", "y")
    assert conversation.situation.goal.plain_spec.shape == "line"
    chat_of("put it back")
    assert_stands_at(conversation, circle)
    chat_of("put it back")
    assert_stands_at(conversation, start)
    chat_of("undo", "undo", "start over")
    assert_stands_at(conversation, start)
    assert not conversation.situation.asked and conversation.situation.builds == ()
    chat_of("undo")
    assert conversation.situation.goal.plain_spec.shape == "line"


def test_an_interrupted_build_is_gone_on_with(chat_of, conversation, sent):
    conversation.say("put the cups in a small circle on the left")
    start = conversation.table.poses()

    def interrupt(event):
        sent.append(event)
        if isinstance(event, Placed):
            raise KeyboardInterrupt

    conversation.listeners = [SimpleNamespace(on_event=interrupt)]
    assert not conversation.go()
    (build,) = conversation.situation.builds
    assert build.trouble == "interrupted" and len(build.moved) == 1
    shown, _ = chat_of("what happened?", "continue", "y")
    assert "It is not as asked: interrupted." in " ".join(shown.split()) and "It stands as asked." in shown
    chat_of("put it back", "put it back")
    assert_stands_at(conversation, start)


class Pressed:
    """Lines that somebody types, who presses Ctrl-C where a line is `None`; they never end."""

    typed = True

    def __init__(self, *lines):
        self._lines = iter(lines)

    def ask(self, prompt):
        line = next(self._lines)
        if line is None:
            raise KeyboardInterrupt
        return line


@pytest.mark.parametrize(
    ("lines", "notes"),
    [
        ([None, None, None], 1),
        (["put the cups", None, None, None], 1),  # the first drops the question
        ([None, "/help", None, "", None, None, None], 1),  # two that are no three in a row
        ([None, None, "/seed wrong", None, None, None], 2),
    ],
)
def test_three_interruptions_in_a_row_end_the_chat(conversation, sent, tmp_path, lines, notes):
    console = Console(file=io.StringIO(), width=100)
    chat = Chat(conversation, ChatScreen(console), Pressed(*lines), tmp_path / "session.jsonl")
    with pytest.raises(KeyboardInterrupt):
        chat.run()
    assert console.file.getvalue().count("Ctrl-C once more ends the chat") == notes


def test_another_table_begins_with_an_instruction_that_suits_it(chat_of):
    shown, _ = chat_of("/scene new 5")
    assert "“put the cups in a small circle on the left”" in " ".join(shown.split())  # the desk
    assert " ".join(shown.split()).count("Say what to build, for example “put the ") == 2

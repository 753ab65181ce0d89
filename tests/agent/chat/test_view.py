"""What the chat shows, with and without a terminal."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from agent import events
from agent.arm.events import PlanFailed, Planned
from agent.chat.view import ChatScreen
from grounding.spec import StructureSpec


def console_of(terminal: bool, width: int = 80) -> Console:
    return Console(
        file=io.StringIO(),
        width=width,
        force_terminal=terminal,
        color_system="truecolor" if terminal else None,
        _environ={"TERM": "xterm-256color", "COLORTERM": "truecolor"} if terminal else {},
    )


def shown(events_told, terminal=False, width=80, echo=True) -> str:
    console = console_of(terminal, width)
    screen = ChatScreen(console, echo)
    for event in events_told:
        screen.on_event(event)
    screen.idle()
    return console.file.getvalue()


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_no_line_is_longer_than_the_screen(run_events, width):
    tower = tuple((0.4, 0.1, 0.03 + 0.06 * level) for level in (0, 2, 1))
    stacked = replace(run_events[3], candidates=(replace(run_events[3].candidates[0], positions=tower),) * 3)
    lines = shown([*run_events, stacked, events.Tried(tower, (0.0,) * 3)], width=width).splitlines()
    assert any(line.startswith("stacked") for line in lines)
    assert lines and [line for line in lines if len(line) > width] == []


def test_everything_is_plain_where_there_is_no_terminal(run_events):
    text = shown(run_events)
    assert "\x1b" not in text and text.isprintable() is False  # only for its line ends
    assert all(char == "\n" or char.isprintable() for char in text)
    assert text.count("score 0.90") == 1 and "1 cup 1" in text and "a banana" in text


def test_a_terminal_gets_colours_and_half_blocks(run_events):
    text = shown(run_events, terminal=True)
    assert "\x1b[" in text and "▀" in text


def parsed(spec, before=None, **more):
    values = {
        "spec": spec, "confidence": {}, "evidence": {}, "parser": "embedding", "dropped": {}, "named": ("cup 1",),
        "viewpoint": "robot", "prompt_sha256": None, "fallback": "", "seconds": 0.1, "before": before,
    }  # fmt: skip
    return events.Parsed(**{**values, **more})


def test_a_correction_shows_only_what_it_changed():
    first = parsed(StructureSpec("circle", "small"))
    then = parsed(StructureSpec("circle", "medium", rotation="north"), StructureSpec("circle", "small"))
    text = shown([first, then])
    before, _, after = text.partition("changed")
    assert [line.split()[0] for line in before.splitlines() if line.startswith("  ")] == [
        "shape",
        "size",
        "x",
        "y",
        "rotation",
        "with",
    ]
    rows = [line.split() for line in after.splitlines() if line.startswith("  ")]
    assert rows == [["size", "small", "->", "medium"], ["rotation", "left", "open", "->", "north"]]


def test_a_correction_of_the_objects_names_them():
    last = StructureSpec("circle")
    text = shown([parsed(last), parsed(last, last, named=("cup 1", "banana"))])
    assert text.partition("changed")[2].split("\n")[1:] == ["  with cup 1, banana", ""]
    assert "nothing; the goal is unchanged" in shown([parsed(last), parsed(last, last)])


def test_after_an_undo_a_correction_names_the_objects_only_where_it_changes_them():
    last = StructureSpec("circle")
    back = events.Restored("undo", last, ("cup 1",), ())
    bigger = parsed(StructureSpec("circle", "large"), last)
    text = shown([parsed(last), parsed(StructureSpec("line"), named=("box 1",)), back, bigger])
    after = text.partition("changed")[2]
    assert "left open -> large" in after and "with" not in after


def maps_of(text: str) -> list[str]:
    """The upper edges of the maps that were drawn, in plain text."""
    return [line for line in text.splitlines() if line.startswith("+--") and "robot" not in line]


def test_one_map_of_the_best_and_three_only_when_asked_for_where_there_is_room(run_events):
    assert [line.count("+") for line in maps_of(shown(run_events[:4], echo=False))] == [2]
    for width, beside in ((60, [4, 2]), (99, [4, 2]), (100, [6]), (120, [6])):
        console = console_of(False, width)
        screen = ChatScreen(console)
        for event in run_events[:4]:
            screen.on_event(event)
        before = len(console.file.getvalue())
        screen.candidates(3)
        asked = console.file.getvalue()[before:]
        assert [line.count("+") for line in maps_of(asked)] == beside, width
        assert max(map(len, asked.splitlines())) <= width


def test_the_key_is_not_repeated_until_it_changes_or_somebody_asks(run_events):
    console = console_of(False)
    screen = ChatScreen(console, echo=True)
    for event in (*run_events[:4], run_events[3], run_events[3]):
        screen.on_event(event)
    assert console.file.getvalue().count("1 cup 1") == 1
    screen.maps.forget_key()
    screen.candidates(3)
    assert console.file.getvalue().count("1 cup 1") == 2
    others = tuple(replace(one, takes_part=one.name != "cup 1") for one in run_events[2].objects)
    screen.scene(replace(run_events[2], objects=others).to_dict())
    assert "(1 cup 1)" in console.file.getvalue()


def test_a_tower_is_recognised_as_a_stack(run_events):
    tower = tuple((0.4, 0.1, 0.03 + 0.06 * level) for level in (0, 2, 1))
    proposed = replace(run_events[3], candidates=(replace(run_events[3].candidates[0], positions=tower),))
    lines = shown([*run_events[:3], proposed]).splitlines()
    title = next(k for k, line in enumerate(lines) if line.startswith("stacked"))
    assert lines[title] == "stacked: 2 on 3 on 1; from the side:"
    assert [line.strip(" []") for line in lines[title + 1 : title + 4]] == ["2", "3", "1"]
    assert set(lines[title + 4]) == {"="}


def test_what_was_tried_without_the_arm_is_drawn_where_it_ended(run_events):
    positions = tuple((0.4 + 0.1 * k, 0.3, 0.03) for k in range(3))
    tried = events.Tried(positions, (0.0,) * 3)
    verdict = events.Checked(True, None, (), "everything stands as asked", "released", 0.1)
    text = shown([*run_events[:4], tried, verdict])
    _, _, after = text.partition("tried without the arm; the table is unchanged")
    rows = after.splitlines()
    column = round(54 * (0.45 - 0.3) / 0.9)  # left of the middle, where nothing stood before
    assert [line[column + 1] for line in rows if "1" in line or "2" in line or "3" in line][0] == "3"
    assert "It stands" not in text and "the table is unchanged." in " ".join(text.split())


def test_an_answer_is_plain_text(run_events):
    text = shown([events.Answered("where is the banana?", "The banana is 60 cm ahead.\nIt [b]stays[/b].")])
    assert text.splitlines() == ["", "> where is the banana?", "The banana is 60 cm ahead.", "It [b]stays[/b]."]


def test_confidence_and_evidence():
    text = shown([parsed(StructureSpec("circle"), confidence={"shape": 0.987}, evidence={"shape": ("ring",)})])
    assert "99 % sure, from “ring”" in text


def test_a_question_has_numbers():
    text = shown([events.Asked("x_position", "left or right?", ("left", "right"))])
    assert text.splitlines() == ["left or right?", "  1  left", "  2  right"]


def test_plans_that_were_not_found_take_two_lines(run_events):
    failures = [PlanFailed(rank, 0, "cup 1", "no grasp fits the hand") for rank in range(9)]
    text = shown([*run_events[:4], *failures, Planned(9, (0, 1, 2), ("side",) * 3, 1.0)])
    lines = [line.strip() for line in text.splitlines() if "no plan" in line or "none for" in line]
    first, second = lines
    assert first == "no plan for candidate 1 for cup 1: no grasp fits the hand"
    assert second == "none for 2, 3, 4, 5 and 4 more either"
    assert "planned candidate 10" in text


def test_a_failed_check_says_once_what_failed(run_events):
    text = " ".join(shown(run_events).split())
    assert text.count("largest gap over the mean: inf, allowed at most 1.6") == 1
    assert "does not stand as asked" not in text


def test_markup_in_what_was_said_is_text():
    text = shown([events.Started("[bold]put[/bold] [/] it", {}), events.Noted("[red]x[/red]")])
    assert "> [bold]put[/bold] [/] it" in text and "[red]x[/red]" in text


def test_previews_leave_nothing_behind(run_events):
    previews = [events.Previewed(step, 8, (((0.4, 0.0, 0.03),) * 3,) * 2, ((0.0,) * 3,) * 2) for step in range(1, 9)]
    assert shown([*run_events[:3], *previews]) == shown(run_events[:3])
    assert "step 8 of 8" in shown([*run_events[:3], *previews], terminal=True)


def test_why_names_every_factor_of_the_chosen_one(run_events):
    console = console_of(False)
    screen = ChatScreen(console)
    screen.why()
    for event in run_events[:5]:
        screen.on_event(event)
    screen.why()
    text = console.file.getvalue()
    assert text.startswith("no arrangement has been proposed yet")
    for factor in ("total", "structure", "collision", "bounds"):
        assert factor in text

"""What the chat shows, with and without a terminal."""

import io

import pytest
from rich.console import Console

from agent import events
from agent.arm.events import Planned, PlanFailed
from agent.chat.screen import ChatScreen
from grounding.spec import StructureSpec


def console_of(terminal: bool, width: int = 80) -> Console:
    return Console(
        file=io.StringIO(), width=width, force_terminal=terminal, color_system="truecolor" if terminal else None,
        _environ={"TERM": "xterm-256color", "COLORTERM": "truecolor"} if terminal else {},
    )


def shown(events_told, terminal=False, width=80, echo=True) -> str:
    console = console_of(terminal, width)
    screen = ChatScreen(console, echo)
    for event in events_told:
        screen(event)
    screen.idle()
    return console.file.getvalue()


@pytest.mark.parametrize("width", [40, 80, 120])
def test_no_line_is_longer_than_the_screen(told, width):
    lines = shown(told, width=width).splitlines()
    assert lines and [line for line in lines if len(line) > width] == []


def test_everything_is_plain_where_there_is_no_terminal(told):
    text = shown(told)
    assert "\x1b" not in text and text.isprintable() is False  # only for its line ends
    assert all(char == "\n" or char.isprintable() for char in text)
    assert text.count("score 0.90") == 3 and "1 cup 1" in text and "a banana" in text


def test_a_terminal_gets_colours_and_half_blocks(told):
    text = shown(told, terminal=True)
    assert "\x1b[" in text and "▀" in text


def parsed(spec, before=None, **more):
    values = {
        "spec": spec, "confidence": {}, "evidence": {}, "parser": "embedding", "dropped": {}, "named": ("cup 1",),
        "viewpoint": "robot", "prompt_sha256": None, "fallback": "", "seconds": 0.1, "before": before,
    }  # fmt: skip
    return events.Parsed(**{**values, **more})


def test_a_correction_says_what_was():
    text = shown([parsed(StructureSpec("circle", "medium"), StructureSpec("circle", "small"))])
    lines = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    assert lines["size"].split(maxsplit=2)[1:] == ["medium", "was small"]
    assert lines["shape"].endswith("as before") and lines["rotation"].endswith("as before")


def test_confidence_and_evidence():
    text = shown([parsed(StructureSpec("circle"), confidence={"shape": 0.987}, evidence={"shape": ("ring",)})])
    assert "99 % sure, from “ring”" in text


def test_a_question_has_numbers():
    text = shown([events.Asked("x_position", "left or right?", ("left", "right"))])
    assert text.splitlines() == ["left or right?", "  1  left", "  2  right"]


def test_plans_that_were_not_found_take_two_lines(told):
    failures = [PlanFailed(rank, 0, "cup 1", "no grasp fits the hand") for rank in range(9)]
    text = shown([*told[:4], *failures, Planned(9, (0, 1, 2), ("side",) * 3, 1.0)])
    lines = [line.strip() for line in text.splitlines() if "no plan" in line or "none for" in line]
    first, second = lines
    assert first == "no plan for candidate 1 for cup 1: no grasp fits the hand"
    assert second == "none for 2, 3, 4, 5 and 4 more either"
    assert "planned candidate 10" in text


def test_a_failed_check_says_once_what_failed(told):
    text = " ".join(shown(told).split())
    assert text.count("largest gap over the mean: inf, allowed at most 1.6") == 1
    assert "does not stand as asked" not in text


def test_markup_in_what_was_said_is_text():
    text = shown([events.Started("[bold]put[/bold] [/] it", {}), events.Noted("[red]x[/red]")])
    assert "> [bold]put[/bold] [/] it" in text and "[red]x[/red]" in text


def test_previews_leave_nothing_behind(told):
    previews = [
        events.Previewed(step, 8, (((0.4, 0.0, 0.03),) * 3,) * 2, ((0.0,) * 3,) * 2) for step in range(1, 9)
    ]
    assert shown([*told[:3], *previews]) == shown(told[:3])
    assert "step 8 of 8" in shown([*told[:3], *previews], terminal=True)


def test_why_names_every_factor_of_the_chosen_one(told):
    console = console_of(False)
    screen = ChatScreen(console)
    screen.why()
    for event in told[:5]:
        screen(event)
    screen.why()
    text = console.file.getvalue()
    assert text.startswith("nothing was imagined yet")
    for factor in ("total", "structure", "collision", "bounds"):
        assert factor in text

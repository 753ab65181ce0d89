"""No text of somebody else commands the terminal: control characters are written as their escapes, on both streams."""

import io
import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from rich.progress import Progress
from rich.text import Text

from agent.event_base import RecordedEvent
from agent.reporting.session_log import SessionWriter
from agent.runtime.terminal_text import VisibleStream, console_on, styled, visible
from tests.commands import structagent

ROOT = Path(__file__).parents[3]
TITLE, LINK = "\x1b]0;owned\x07", "\x1b]8;;http://evil.example\x1b\\here\x1b]8;;\x1b\\"
HOSTILE = f"put {TITLE}{LINK}\x1b[2J\x9b31m\u202etxt\rthe mugs"
COMMANDS = ("\x1b", "\x07", "\x9b", "\u202e", "\r")


def said(arguments: list[str], folder: Path, environment: dict | None = None, **more) -> tuple[str, str]:
    """Standard output and standard error, decoded as they are, of a command line."""
    command = [sys.executable, "-m", "agent", *arguments] if environment else structagent(*arguments)
    done = subprocess.run(
        command, cwd=folder, capture_output=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **(environment or {})}, **more,
    )  # fmt: skip
    assert b"Traceback" not in done.stderr, done.stderr
    return done.stdout.decode(errors="surrogateescape"), done.stderr.decode(errors="surrogateescape")


def assert_harmless(text: str) -> None:
    assert not [char for char in COMMANDS if char in text], repr(text)
    assert not any(0xD800 <= ord(char) <= 0xDFFF for char in text), repr(text)


def session_of(path: Path) -> Path:
    with SessionWriter(path, {}) as session:
        session.on_event(RecordedEvent({"kind": "started", "instruction": HOSTILE, "options": {}}))
        session.on_event(RecordedEvent({"kind": "noted", "message": HOSTILE}))
        session.on_event(RecordedEvent({"kind": "failed", "step": "parse", "message": HOSTILE, "exit_code": 3}))
    return path


@pytest.mark.parametrize(
    "text", ["\x1b[31m", "\x1b]0;x\x07", "\x9b2J", "\x7f", "a\rb", "\u202eabc", "\u2066", "\udc9b", "\x00", "\b\b"]
)
def test_control_characters_are_seen_and_do_nothing(text):
    shown = visible(text)
    assert shown.isprintable() and "\\u" in shown
    assert visible(shown) == shown


@pytest.mark.parametrize("text", ["a\tb\nc", "größer “so” 😀 日本", "line\r\n", "שלום", "e\u0301"])
def test_all_other_text_stays(text):
    assert visible(text) == text


def test_in_a_line_of_json_a_character_means_the_same():
    content = {"name": HOSTILE + "\x7f\udc9b"}
    assert json.loads(visible(json.dumps(content, ensure_ascii=False))) == content


def test_consoles_keep_their_own_colours_and_drop_those_of_texts():
    stream = io.StringIO()
    console = console_on(VisibleStream(stream), force_terminal=True, color_system="standard", width=200)
    console.print(f"[red]{HOSTILE}[/red] [link=http://evil.example]word[/link]")
    console.print(Text.from_ansi(LINK), Text(HOSTILE), HOSTILE)
    with Progress(console=console, transient=True) as progress:
        progress.add_task(HOSTILE, total=1)
    shown = stream.getvalue()
    assert "\x1b[31m" in shown and "\x1b[2K" in shown  # ours: red, and a bar that is removed again
    assert not [hostile for hostile in ("\x1b]", "\x07", "\x9b", "\u202e", "\x1b[2J") if hostile in shown]


def test_only_what_is_styled_passes():
    stream = io.StringIO()
    plain = VisibleStream(stream)
    print(TITLE, file=plain)
    print("\x1b[32mok\x1b[0m", file=styled(plain), end="")
    assert stream.getvalue() == "\\u001b]0;owned\\u0007\n\x1b[32mok\x1b[0m"


def test_replay_on_a_pipe(tmp_path):
    file = session_of(tmp_path / "session.jsonl")
    for arguments in (["replay", str(file)], ["replay", str(file), "--json"]):
        out, err = said(arguments, tmp_path)
        assert_harmless(out + err)
        assert "owned" in out
    assert json.loads(out.splitlines()[0])["event"]["instruction"] == HOSTILE


def test_replay_on_a_terminal(tmp_path):
    file = session_of(tmp_path / "session.jsonl")
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        structagent("replay", str(file)), stdin=follower, stdout=follower, stderr=follower,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm-256color"}, cwd=tmp_path,
    )  # fmt: skip
    os.close(follower)
    shown = b""
    try:
        while chunk := os.read(leader, 65536):
            shown += chunk
    except OSError:  # the terminal's other end is closed
        pass
    os.close(leader)
    assert process.wait() == 0
    assert b"owned" in shown
    assert not [hostile for hostile in (b"\x1b]", b"\x07", b"\x1b[2J", "\x9b".encode()) if hostile in shown], shown


def test_instructions_and_their_errors(tmp_path):
    out, err = said(["parse", HOSTILE, "fly " + HOSTILE], tmp_path)
    assert_harmless(out + err)
    out, err = said(["parse", "--json"], tmp_path, input=HOSTILE.replace("\r", "").encode())
    assert_harmless(out + err)


@pytest.mark.parametrize("locale", ["C.UTF-8", "C", "POSIX"])
def test_file_names_in_errors(locale, tmp_path):
    name = os.fsencode("a\x1b]0;owned\x07\u202e") + b"\x9b31m\xff.jsonl"
    for command in (["replay"], ["bag", "info"], ["batch", "--out", "out"], ["scene", "validate"], ["report"]):
        out, err = said([*command, os.fsdecode(name)], tmp_path, {"LC_ALL": locale, "PYTHONUTF8": "0"})
        assert_harmless(out + err)
        assert "owned" in err

"""Whole conversations, through a pipe and in a real terminal, compared with how they should read.

`python -m tests.agent.chat.test_transcripts` writes them anew, to be read before they are committed. Measured numbers
and times are left out of the comparison: they are those of the machine.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from pathlib import Path

from tests.agent.chat.terminal import ROOT, Terminal
from tests.commands import structagent

HERE = Path(__file__).parent
TRANSCRIPTS = HERE / "transcripts"
ARGUMENTS = ["chat", "--scene", str(HERE / "desk.yaml"), "--model", "geometric"]
PIPED = """\
hello
what do you see
/objects
put the cups in a small circle on the left
/why
bigger
/choose 2
/plan
y
put the orange on the box
box 2
n
put the bananas in a row
/viewpoint opposite
/save
undo
/nonsense
where is the orange
is there a banana?
/quit
"""


def normalized(lines: list[str]) -> str:
    """Without what depends on the machine: numbers with a point, how many columns they take,
    what a finger brushes by a hair.
    """
    out = []
    for line in lines:
        line = line.rstrip()
        if " no longer stands: " in line:
            continue
        if not re.match(r"[|+▌▐▗▝]", line):  # a picture stays as it is
            line = re.sub(r"\d+\.\d+", "#", line)
            line = re.sub(r"\S*session\.jsonl", "SESSION", line)
            line = re.sub(r"(?<=\S) {2,}", "  ", line)
        out.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(out)).strip() + "\n"


def through_a_pipe(folder: Path) -> str:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("STRUCTAGENT_")}
    done = subprocess.run(
        structagent(*ARGUMENTS, "--out", str(folder / "out")),
        input=PIPED,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=1200,
        cwd=folder,
        env={**kept, "PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(folder), "COLUMNS": "80"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == f"session: {folder / 'out' / 'session.jsonl'}\n"
    assert "\x1b" not in done.stdout
    return normalized(done.stdout.splitlines())


def in_a_terminal(folder: Path) -> str:
    with Terminal([*ARGUMENTS, "--out", str(folder / "out")], folder) as terminal:
        terminal.until_prompt()
        for line in ("put the cups", "1", "smaller, and on the left"):
            terminal.type(line)
            terminal.until_prompt()
        terminal.type("y")
        terminal.until("picked cup")
        terminal.interrupt()
        terminal.until_prompt()
        for line in ("undo", "y", "now as a line", "/undo", "/undo"):
            terminal.type(line)
            terminal.until_prompt()
        lines = terminal.lines()
        assert terminal.end() == 0
        assert "session: " in "".join(terminal.lines())  # where, depends on the folder
    planned = next(number for number, line in enumerate(lines) if "planned candidate" in line)
    stopped = next(number for number, line in enumerate(lines) if line.startswith("  stopped"))
    # What the arm had done by then, and where that left the cups, is a matter of milliseconds.
    until = next(number for number, line in enumerate(lines) if number > stopped and line.startswith("> "))
    lines[until + 1] = lines[until + 1].partition("; put back:")[0]
    return normalized([*lines[: planned + 1], "  (stopped)", *_pictures_described(lines[until:])])


def _pictures_described(lines: list[str]) -> list[str]:
    """Replace each picture by one line with its labels: where the cups stand is no longer the same on every machine."""
    out, labels = [], list[str]()
    for line in lines:
        if line.startswith("▐"):
            labels += re.findall(r"\w", line)
        elif line.startswith("▝"):
            out.append(f"(picture: {' '.join(sorted(labels))})")
            labels.clear()
        elif not line.startswith("▗"):
            out.append(line)
    return out


def _with_pictures_of(text: str, other: str) -> str:
    """Return a text with the rows of pictures of another in place of its own where they differ by the width of a cell:
    a millimetre decides which cell an object begins in, and processors round otherwise.
    """
    own, others = text.splitlines(keepends=True), other.splitlines(keepends=True)
    for number, (row, kept) in enumerate(zip(own, others)):
        differ = [k for k, (a, b) in enumerate(zip(row, kept)) if a != b]
        if row.startswith("|") and len(row) == len(kept) and len(differ) <= 4:
            own[number] = kept
    return "".join(own)


def test_a_conversation_through_a_pipe(tmp_path):
    found, kept = through_a_pipe(tmp_path), (TRANSCRIPTS / "piped.txt").read_text(encoding="utf-8")
    assert _with_pictures_of(found, kept) == kept


def test_pictures_may_differ_by_a_cell_and_not_by_an_object():
    kept = "a line\n|..AAA...:::..|\n"
    assert _with_pictures_of("a line\n|...AA...:::..|\n", kept) == kept
    for other in ("a line\n|.........:::..|.\n", "a line\n|........:::AAA|\n", "another\n|..AAA...:::..|\n"):
        assert _with_pictures_of(other, kept) != kept


def test_a_conversation_in_a_terminal(tmp_path):
    assert in_a_terminal(tmp_path) == (TRANSCRIPTS / "terminal.txt").read_text(encoding="utf-8")


if __name__ == "__main__":
    TRANSCRIPTS.mkdir(exist_ok=True)
    for name, make in (("piped", through_a_pipe), ("terminal", in_a_terminal)):
        with tempfile.TemporaryDirectory() as made:
            (TRANSCRIPTS / f"{name}.txt").write_text(make(Path(made)), encoding="utf-8")

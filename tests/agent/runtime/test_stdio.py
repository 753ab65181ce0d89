"""Results and everything else: whoever closes the pipe has seen enough, and no command complains about it."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from agent.cli.app import command_line
from agent.events import Proposed
from agent.reporting.terminal_report import TerminalReport
from agent.runtime.stdio import NO_TEXT, ReaderGone
from tests.commands import structagent

ROOT = Path(__file__).parents[3]
EXACT = ["--objects", "boxes", "--model", "geometric", "--no-execute"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with two boxes, a batch file, a finished batch, and a recording of a row in it."""
    folder = tmp_path_factory.mktemp("piped")
    (folder / "boxes").mkdir()
    for number in range(2):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(folder / "boxes" / f"box_{number}.stl")
    (folder / "orders.jsonl").write_text('{"text": "stack two boxes", "id": "a"}\n{"text": "fly to the moon"}\n')
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert command_line(["batch", "orders.jsonl", "--out", "out", *EXACT, "--workers", "1"]) == 3
    return folder


def piped(arguments: list[str], folder: Path, output: int) -> subprocess.CompletedProcess:
    return subprocess.run(
        structagent(*arguments),
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.PIPE,
        text=True,
    )


def closed_pipe() -> int:
    """The end of a pipe that is written to, whose reader has gone."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["--version"],
        ["run", "--help"],
        ["run", "stack two boxes", "--out", "run", *EXACT],
        ["run", "fly to the moon", "--json", *EXACT],
        ["batch", "orders.jsonl", "--out", "out", *EXACT],
        ["batch", "orders.jsonl", "--out", "out", "--json", *EXACT],
        ["parse", "make a line", "fly to the moon"],
        ["parse", "make a line", "--json"],
        ["replay", "out/rows/a/session.jsonl"],
        ["replay", "out/rows/a/session.jsonl", "--json"],
        ["report", "out/rows/a/session.jsonl", "--out", "page.html"],
        ["models", "list"],
        ["models", "show", "diffusion"],
        ["config", "show"],
        ["completion", "bash"],
        ["doctor"],
        ["scene", "new", "--objects", "boxes", "--shape", "tower"],
        ["bag", "info", "--help"],
        ["evaluate", "parse", "--limit", "2"],
        ["evaluate", "success", "--objects", "boxes", "--model", "geometric", "--structure", "tower", "--scenes", "1"],
    ],
    ids=lambda arguments: " ".join(arguments[:3]),
)
def test_a_command_ends_quietly_when_nobody_reads(arguments, folder):
    writing = closed_pipe()
    try:
        done = piped(arguments, folder, writing)
    finally:
        os.close(writing)
    assert done.returncode == 0, done.stderr
    assert not any(word in done.stderr for word in ("Traceback", "Broken pipe", "Exception ignored")), done.stderr


def test_of_many_lines_the_first_can_be_taken(folder):
    process = subprocess.Popen(
        [sys.executable, "-m", "agent", "models", "list"], cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline().split()[0] == "name"
    process.stdout.close()
    assert (process.wait(), process.stderr.read()) == (0, "")


def test_a_command_ends_when_nobody_reads_its_errors(folder):
    writing = closed_pipe()
    try:
        done = subprocess.run(
            structagent("run", "make a line", "--model", "oracle"), cwd=folder, stdout=writing,
            stderr=writing, env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    finally:
        os.close(writing)
    assert done.returncode == 0


def test_a_run_that_nobody_reads_any_more_says_so_in_its_report(folder, monkeypatch):
    def on_event(self, event):
        if isinstance(event, Proposed):
            raise ReaderGone(0)

    monkeypatch.chdir(folder)
    monkeypatch.setattr(TerminalReport, "on_event", on_event)
    with pytest.raises(ReaderGone):
        command_line(["run", "stack two boxes", "--out", "left", *EXACT])
    report = json.loads((folder / "left" / "report.json").read_text())
    assert (report["outcome"]["success"], report["outcome"]["message"]) == (False, "interrupted")


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_closed_stream_is_no_defect(closed, folder):
    line = f"{sys.executable} -m agent config show {closed}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(["sh", "-c", line], cwd=folder, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (closed == "2>&-")


def through_the_shell(line: str, folder: Path) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = line.replace("structagent", shlex.join(structagent()))
    return subprocess.run(["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("line", "code", "sentence"),
    [
        ("structagent parse <&-", 2, "parse needs an instruction, as an argument or on standard input, one per line"),
        ("structagent batch - --out closed <&-", 6, "the rows should come from standard input, which is closed"),
        ("structagent chat <&-", 2, "chat needs standard input, which is closed"),
        ("structagent --version > /dev/full", 6, "'standard output': no space left on device"),
        ("structagent parse 'make a line' > /dev/full", 6, "'standard output': no space left on device"),
        ("structagent run $'a line \\xff'", 6, f"the instruction 'a line {NO_TEXT}' has a byte that is not UTF-8 text"),
    ],
)
def test_a_stream_that_cannot_be_used_is_one_sentence(line, code, sentence, folder):
    done = through_the_shell(line, folder)
    assert done.returncode == code, done.stderr
    assert done.stderr.startswith(f"structagent: {sentence}") and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "line",
    [
        "structagent parse 'make a line' <&- >&- 2>&-",
        "structagent parse 'fly to the moon' 'make a line' 2> /dev/full; test $? = 3",
        "structagent config show <&- 2>&-",
        # More than a pipe holds: of less, a command cannot know whether somebody has read it.
        "{ set +o pipefail; yes 'fly to the moon' | head -2000; } | { set -o pipefail; structagent parse | head -1; }",
    ],
)
def test_closed_streams_stop_nothing(line, folder):
    done = through_the_shell(line, folder)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr


def test_a_file_that_is_opened_takes_no_closed_stream_s_place(folder):
    opens = "from agent.runtime.stdio import end_when_nobody_reads as e; e(); print(open('orders.jsonl').fileno() > 2)"
    done = subprocess.run(
        ["sh", "-c", f'{sys.executable} -c "{opens}" <&- 2>&-'], cwd=folder, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.stdout == "True\n"


def test_a_name_that_is_no_text_is_told_all_the_same(folder):
    line = f"structagent run 'stack two boxes' {' '.join(EXACT)} --out $'out\\xff'"
    done = through_the_shell(line, folder)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert "report: out\\udcff" in done.stdout

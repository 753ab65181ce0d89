"""Results and everything else: whoever closes the pipe has seen enough, and no command complains about it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from agent.cli import command_line
from agent.report import TerminalReport
from agent.streams import ReaderGone

ROOT = Path(__file__).parents[2]
EXACT = ["--objects", "boxes", "--model", "geometric", "--no-execute"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with two boxes, a batch file, a finished batch, and a recording of a row in it."""
    folder = tmp_path_factory.mktemp("piped")
    (folder / "boxes").mkdir()
    for number in range(2):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(folder / "boxes" / f"box_{number}.stl")
    (folder / "orders.jsonl").write_text('{"text": "stack two boxes", "id": "a"}\n{"text": "fly to the moon"}\n')
    done = piped(["batch", "orders.jsonl", "--out", "out", *EXACT, "--workers", "1"], folder, subprocess.DEVNULL)
    assert done.returncode == 3, done.stderr
    return folder


def piped(arguments: list[str], folder: Path, output: int) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "agent", *arguments],
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
            [sys.executable, "-m", "agent", "run", "make a line", "--model", "oracle"], cwd=folder, stdout=writing,
            stderr=writing, env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    finally:
        os.close(writing)
    assert done.returncode == 0


def test_a_run_that_nobody_reads_any_more_says_so_in_its_report(folder, monkeypatch):
    def tell(self, told):
        if told["kind"] == "imagined":
            raise ReaderGone(0)

    monkeypatch.chdir(folder)
    monkeypatch.setattr(TerminalReport, "tell", tell)
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

"""SIGTERM and a closed terminal end a command in order: one sentence, an exit code of its own, nothing half done."""

import json
import signal
import threading
from pathlib import Path

import pytest

from agent.cli.app import command_line
from agent.pipeline import run as pipeline
from agent.runtime.termination import Terminated, termination_raised
from structdiffusion.worker_process import without_interruptions

SIGNALS = {signal.SIGTERM: (143, "terminated"), signal.SIGHUP: (129, "the terminal was closed")}


@pytest.fixture(autouse=True)
def untreated():
    """Give the signals their default treatment, which a library that another test has started may have changed."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in SIGNALS}
    yield
    for number, treatment in before.items():
        signal.signal(number, treatment or signal.SIG_DFL)


@pytest.mark.parametrize("number", SIGNALS)
def test_it_is_raised_and_a_second_one_is_not_caught(number):
    with termination_raised():
        with pytest.raises(Terminated) as ended:
            signal.raise_signal(number)
        assert (ended.value.code, ended.value.reason) == SIGNALS[number]
        assert signal.getsignal(number) is signal.SIG_DFL
    assert signal.getsignal(number) is signal.SIG_DFL


def test_a_signal_that_somebody_ignores_or_handles_stays_theirs():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as `nohup` starts a command
    try:
        with termination_raised():
            signal.raise_signal(signal.SIGHUP)
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_in_another_thread_nothing_is_taken():
    found = []

    def work() -> None:
        with termination_raised():
            found.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.SIG_DFL]


def test_the_start_of_a_worker_is_not_cut_short():
    """A process that gets half of its work ends with a traceback on the terminal."""
    steps = []
    with termination_raised(), pytest.raises(Terminated):
        with without_interruptions():
            signal.raise_signal(signal.SIGTERM)
            steps.append("started")
        steps.append("went on")
    assert steps == ["started"]


@pytest.mark.parametrize("number", SIGNALS)
def test_a_run_that_is_ended_leaves_its_report(number, tmp_path, monkeypatch, capsys):
    def ended(*_: object, **__: object) -> None:
        signal.raise_signal(number)

    monkeypatch.setattr(pipeline, "propose_arrangements", ended)
    out = tmp_path / "out"
    line = ["run", "put everything in a circle", "--objects", "procedural", "--model", "geometric", "--no-execute"]
    code, reason = SIGNALS[number]
    assert command_line([*line, "--out", str(out)]) == code
    assert capsys.readouterr().err == f"structagent: {reason}\n"
    outcome = json.loads((out / "report.json").read_text())["outcome"]
    assert (outcome["success"], outcome["exit_code"], outcome["message"]) == (False, code, reason)
    assert not [path for path in Path(out).iterdir() if path.name.endswith(".part")]

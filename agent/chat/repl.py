"""The chat itself: takes a line, sees what it is, has it done, and asks for the next."""

from __future__ import annotations

import os
import shlex
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from agent import events
from agent.chat.commands import PARSERS, command_of, help_lines, one_of, whole_number
from agent.chat.conversation import Conversation
from agent.chat.greeting import invitation
from agent.chat.input import Lines
from agent.chat.view import SHOWN, ChatScreen
from agent.errors import DEFECT, DONE, NotWritten, UsageError, exit_code_of, one_sentence
from agent.rendering.text import aligned
from agent.reporting.replay import write_page
from agent.runtime.settings import MOST_SEED
from agent.scenes.files import SUFFIXES
from agent.scenes.sources import SIMULATED
from grounding.dialogue.acts import acts_of, is_question
from grounding.parse_result import shortened
from grounding.viewpoint import VIEWPOINTS

_YES = ("y", "yes", "yes please", "go", "go ahead", "do it", "build it", "ok", "okay", "sure")
_NO = ("n", "no", "no thanks", "no thank you", "never mind", "nevermind")
_INTERRUPTS = 3  # so many times Ctrl-C in a row, with no line done in between, end the chat
_DROPPED = "the question is dropped; say it another way"
_ANY = ("any", "either", "whatever", "i don't mind", "doesn't matter")


class Chat:
    """One chat.

    Args:
        conversation: what is talked about.
        screen: where it is shown.
        lines: where its lines come from.
        session: the file that keeps it.
        yes: build without asking.
        stopped: told whenever the chat comes to ask for a line, so that what was interrupted has stopped.

    Attributes:
        defects: how often the program itself was at fault.
        unwritten: how often a file could not be written.
    """

    def __init__(
        self,
        conversation: Conversation,
        screen: ChatScreen,
        lines: Lines,
        session: Path,
        yes: bool = False,
        stopped: Callable[[], None] = lambda: None,
    ) -> None:
        self._stopped = stopped
        self._talk, self._screen, self._lines = conversation, screen, lines
        self._session, self._yes = session, yes
        self._overwrites: Path | None = None
        self._interrupts = 0  # in a row
        self.defects = self.unwritten = 0

    @property
    def exit_code(self) -> int:
        """0, or that of the worst that was told while the chat went on."""
        return DEFECT if self.defects else NotWritten.exit_code if self.unwritten else DONE

    def run(self) -> None:
        """Talks until the lines end, or somebody quits.

        Raises:
            KeyboardInterrupt: when somebody interrupts it three times in a row.
        """
        self._show_table()
        while True:
            try:
                self._stopped()
                self._screen.space()
                line = self._lines.ask(self._prompt())
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
                if not self._lines.typed:  # nobody is there who could say how to go on
                    raise
                self._screen.complain("interrupted")
            except Exception as error:
                self._interrupts = 0
                self._screen.complain(one_sentence(error) if exit_code_of(error) is not None else self._defect(error))
                self.unwritten += isinstance(error, NotWritten | OSError)
            finally:
                self._screen.idle()

    def _count_interrupt(self) -> None:
        """Lets the interruption that is being handled end the chat where it is the third in a row."""
        self._interrupts += 1
        if self._interrupts >= _INTERRUPTS:
            raise KeyboardInterrupt

    def _show_table(self) -> None:
        """The table from above, and an instruction that suits it."""
        self._screen.scene(self._talk.look().to_dict())
        self._screen.note(f"{invitation(self._talk.example())} /help lists what else there is.")

    def _stop_asking(self) -> None:
        if self._talk.question is not None:
            self._talk.drop()
            self._screen.note(_DROPPED)
        elif self._interrupts + 1 < _INTERRUPTS:
            self._screen.note("Ctrl-D or /quit ends")
        else:
            self._screen.note("Ctrl-C once more ends the chat, as Ctrl-D and /quit do")

    def _defect(self, error: Exception) -> str:
        """Keeps what is wrong with this program beside the session, for a report; the chat goes on."""
        path = self._session.with_name("traceback.txt")
        self.defects += 1
        what = f"{type(error).__name__}: {one_sentence(error)}"
        try:
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW
            with os.fdopen(os.open(path, flags, 0o666), "a", encoding="utf-8") as file:
                traceback.print_exception(error, file=file)
        except OSError as trouble:
            return f"a defect of structagent, {what}; the chat goes on, but {one_sentence(trouble)}"
        return f"a defect of structagent, {what}; {path} says where, and the chat goes on"

    def _prompt(self) -> str:
        if self._talk.question is not None:
            return f"1-{len(self._talk.question.options)}> "
        return "build it? [y/n] > " if self._talk.situation.proposal is not None else "> "

    def handle(self, line: str) -> bool:
        """Carry out one line, whose words have single spaces between them; whether the chat goes on."""
        if not line:
            return True
        found = command_of(line)
        if found is not None:
            command, rest = found
            if command.name == "/quit":
                return False
            self._talk.send(events.Commanded(f"{command.name} {rest}".strip()))
            self._command(command.name, rest)
        elif self._talk.question is not None:
            self._answer(line)
        elif self._talk.situation.proposal is not None:
            self._decide(line)
        elif line.isdecimal() or line.lower().rstrip(".!") in (*_YES, *_NO):
            raise UsageError("there is no proposal; say what to build, or /again")
        else:
            self._say(line)
        return True

    # --- instructions, answers, decisions ----------------------------------------------------

    def _say(self, line: str) -> None:
        self._screen.busy("reading")
        if not self._replied(line) and self._talk.say(line):
            self._proposed()

    def _replied(self, line: str) -> bool:
        """Answers what is small talk or a question, and asks for nothing to be built; whether it was that."""
        acts = acts_of(line)
        if not acts and not (is_question(line) and self._talk.asks_for_nothing(line)):
            return False
        self._talk.reply(line, acts)
        return True

    def _proposed(self) -> None:
        if self._yes:
            self._go()

    def _answer(self, line: str) -> None:
        question, said = self._talk.question, line.lower().rstrip(".!")
        assert question is not None  # the caller has looked
        options = {str(number): option for number, option in enumerate(question.options, start=1)}
        options |= {option.lower(): option for option in question.options}
        if said in _NO:
            self._talk.send(events.Commanded(line))
            self._talk.drop()
            self._screen.note(_DROPPED)
        elif said in options or (said in _ANY and question.slot != "shape"):
            self._talk.send(events.Commanded(line))
            self._screen.busy("imagining")
            if self._talk.answer(options.get(said)):
                self._proposed()
        elif said.isdecimal() or said in _YES:
            raise UsageError(f"{line!r} is no answer; legal: 1 to {len(question.options)}, or say it differently")
        else:
            self._screen.busy("reading")
            if not self._replied(line) and self._talk.answer_in_words(line):
                self._proposed()

    def _decide(self, line: str) -> None:
        said = line.lower().rstrip(".!")
        if said in _YES:
            self._talk.send(events.Commanded(line))
            self._go()
        elif said in _NO:
            self._talk.send(events.Commanded(line))
            self._talk.drop()
            self._screen.note("nothing was moved; say what should be different")
        elif said.isdecimal():
            self._talk.send(events.Commanded(line))
            self._talk.choose(int(said))
        else:
            self._say(line)

    def _go(self) -> None:
        self._screen.busy("looking for a plan")
        self._talk.go()
        if self._talk.options.execute:  # without the arm the table is as it was, and what was tried was shown
            self._screen.scene(self._talk.look().to_dict())

    # --- commands ----------------------------------------------------------------------------

    def _command(self, name: str, rest: str) -> None:
        talk, screen = self._talk, self._screen
        match name:
            case "/scene":
                self._scene(rest)
            case "/objects":
                screen.scene_read(talk.look().to_dict())
                if talk.table.held is not None:
                    screen.note(f"in the hand: {talk.table.held}")
            case "/candidates":
                screen.maps.forget_key()
                screen.candidates(whole_number(name, rest, 1) if rest else SHOWN)
            case "/choose":
                talk.choose(whole_number(name, rest, 1))
            case "/why":
                screen.why()
            case "/plan":
                screen.busy("looking for a plan")
                talk.plan()
            case "/go":
                self._go()
            case "/continue":
                self._continue()
            case "/stop":
                talk.stop()
            case "/clear":
                talk.forget()
            case "/again":
                screen.busy("imagining")
                if talk.again():
                    self._proposed()
            case "/undo" | "/redo" | "/back" | "/reset":
                {"/undo": talk.undo, "/redo": talk.redo, "/back": talk.put_back, "/reset": talk.reset}[name]()
                screen.scene(talk.look().to_dict())
                proposal = talk.situation.proposal
                if proposal is not None:  # shown again, not told: nothing new was imagined
                    screen.on_event(proposal.imagined)
                    screen.on_event(proposal.chosen)
            case "/parser":
                if rest:
                    talk.read_with(one_of(name, rest, PARSERS))
                screen.note(f"parser: {talk.options.reading.parser}")
            case "/viewpoint":
                if rest:
                    talk.speak_from(one_of(name, rest, VIEWPOINTS))
                screen.note(f"viewpoint: {talk.options.reading.viewpoint}")
            case "/seed":
                if rest:
                    talk.seed_with(whole_number(name, rest, 0, MOST_SEED))
                screen.note(f"seed: {talk.options.seed}")
            case "/save":
                self._save(_path(rest))
            case "/load":
                self._set_table(str(_path(rest)), talk.options.seed)
            case "/report":
                page = self._file(name, _path(rest), (".html",)) if rest else self._session.with_name("report.html")
                screen.busy("writing the page")
                screen.note(f"report: {write_page(self._session, page)}")
            case "/help":
                self._help()

    def _continue(self) -> None:
        if self._talk.question is None and self._talk.situation.proposal is not None:
            self._go()
            return
        self._screen.busy("imagining")
        if self._talk.resume():
            self._proposed()

    def _scene(self, rest: str) -> None:
        word, _, seed = rest.partition(" ")
        if word:
            one_of("/scene", word, ("new",))
            number = whole_number("/scene new", seed.strip(), 0, MOST_SEED) if seed else self._talk.options.seed + 1
            self._set_table(SIMULATED, number)
        else:
            self._screen.maps.forget_key()
            self._screen.scene(self._talk.look().to_dict())

    def _set_table(self, scene: str, seed: int) -> None:
        self._screen.busy("setting the table")
        self._talk.another_table(scene, seed)
        self._screen.forget()
        self._show_table()

    def _save(self, path: Path) -> None:
        if self._talk.table.held is not None:
            raise UsageError(f"the arm holds {self._talk.table.held}; undo, or say what to build, before you save")
        self._talk.save(self._file("/save", path, SUFFIXES))
        self._screen.note(f"saved {path}; structagent chat --scene {shlex.quote(str(path))} goes on with it")

    def _file(self, command: str, path: Path, suffixes: Sequence[str]) -> Path:
        """The path, where it may be written to: a file that is there must be asked for twice."""
        if path.suffix.lower() not in suffixes:
            legal = " or ".join(suffixes)
            raise UsageError(f"{command} needs a file that ends in {legal}, got {shortened(str(path))!r}")
        if path.is_dir():
            raise UsageError(f"{command} needs a file, and {str(path)!r} is a folder")
        known, self._overwrites = path == self._overwrites, path
        if path.exists() and not known:
            raise UsageError(f"there is already a file {str(path)!r}; the same command again overwrites it")
        return path

    def _help(self) -> None:
        for line in aligned(help_lines()).splitlines():
            self._screen.note(line)
        self._screen.note(
            "Anything else is an instruction, a correction of the last one, or a question: put the cups in a small "
            "circle on the left; bigger; now a line; the other side; what do you see; where is the orange; undo"
        )
        self._screen.note("Ctrl-C stops what is going on; Alt-Enter begins another line; Ctrl-D ends")


def _path(text: str) -> Path:
    """What somebody types as a file, who is used to a shell."""
    return Path(text).expanduser() if text.startswith("~/") else Path(text)

"""Carry out the slash commands of a chat."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agent.chat.commands import PARSERS, help_lines, one_of, whole_number
from agent.chat.conversation import Conversation
from agent.chat.explanations import timeline_row
from agent.chat.file_access import FileAccess
from agent.chat.greeting import invitation
from agent.chat.interjections import Silence, Source
from agent.chat.steering import Steering
from agent.chat.view import SHOWN, ChatScreen
from agent.errors import UsageError
from agent.figures.picture import picture
from agent.runtime.output_ownership import OwnFolder
from agent.runtime.settings import MOST_SEED
from agent.scenes.files import SUFFIXES
from agent.scenes.sources import EXAMPLE, SIMULATED
from grounding.parse_result import shortened
from grounding.viewpoint import VIEWPOINTS

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from grounding.figures.figure import Figure


class CommandRunner:
    """Runner of slash commands.

    Args:
        conversation: the conversation that the commands change.
        screen: the screen for their output.
        session: the session file of the conversation.
        on_proposal: called after a command has produced a proposal.
        on_step: called after every physics step while the arm is at work.
        access: which files the commands may name.
        said: returns who says something while a proposal is built.

    Attributes:
        later: what was said then and has to be read now that nothing is built.
    """

    def __init__(
        self,
        conversation: Conversation,
        screen: ChatScreen,
        session: Path,
        on_proposal: Callable[[], None],
        on_step: Callable[[TableScene], None] | None = None,
        access: FileAccess = FileAccess(),
        said: Callable[[], Source] = Silence,
    ) -> None:
        self.later: list[str] = []
        self._said = said
        self._conversation, self._screen = conversation, screen
        self._session, self._on_proposal, self._on_step = session, on_proposal, on_step
        self._access = access
        self._overwrites: Path | None = None

    def show_table(self) -> None:
        """Show the table from above and suggest an instruction that suits it."""
        self._screen.scene(self._conversation.look().to_dict())
        self._screen.note(f"{invitation(self._conversation.example())} /help lists all commands.")

    def build(self) -> None:
        """Build the proposed arrangement and show the table afterwards."""
        self._screen.busy("looking for a plan")
        talk = self._conversation
        steering = (
            Steering(talk, self._said()) if talk.options.execute and talk.situation.proposal is not None else None
        )
        talk.go(self._on_step, steering=steering)
        self.later += [] if steering is None else steering.rest()
        if self._conversation.options.execute:  # without the arm the table is unchanged, and the trial was shown
            self._screen.scene(self._conversation.look().to_dict())

    def run(self, name: str, rest: str) -> None:
        """Carry out a command.

        Args:
            name: the command's name with its slash.
            rest: the text after the name.

        Raises:
            UsageError: if the command cannot be carried out.
        """
        talk, screen = self._conversation, self._screen
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
                self.build()
            case "/continue":
                self._continue()
            case "/wait":
                raise UsageError("nothing is being built, so there is nothing to pause")
            case "/stop":
                talk.stop()
            case "/clear":
                talk.forget()
            case "/again":
                screen.busy("proposing arrangements")
                if talk.again():
                    self._say_which()
                    self._on_proposal()
            case "/undo" | "/redo" | "/back" | "/reset":
                if rest:
                    talk.back_to(whole_number(name, rest, 0))
                else:
                    {"/undo": talk.undo, "/redo": talk.redo, "/back": talk.put_back, "/reset": talk.reset}[name]()
                screen.scene(talk.look().to_dict())
                proposal = talk.situation.proposal
                if proposal is not None:  # shown again, not sent: nothing new was proposed
                    screen.on_event(proposal.proposed)
                    screen.on_event(proposal.chosen)
            case "/timeline":
                screen.listing([timeline_row(turn, left, turn.number == talk.turn) for turn, left in talk.timeline()])
            case "/fork":
                talk.fork()
            case "/parser" | "/viewpoint" | "/seed":
                self._set_option(name, rest)
            case "/save":
                self._save(self._access.path(name, rest))
            case "/load":
                known = rest in (SIMULATED, EXAMPLE)
                self._set_table(rest if known else str(self._access.path(name, rest)), talk.options.seed)
            case "/example":
                self._example(rest)
            case "/arrange":
                self._show_example(talk.show_arrangement(rest, OwnFolder(self._session.parent, "chat")))
            case "/report":
                from agent.reporting.replay import write_page  # the pages' modules are many, and few chats want one

                page = self._session.with_name("report.html")
                if rest:
                    page = self._file(name, self._access.path(name, rest), (".html",))
                screen.busy("writing the page")
                screen.note(f"report: {write_page(self._session, page)}")
            case "/help":
                self._help()

    def _say_which(self) -> None:
        """Say why another arrangement than the best of all is proposed, if it is."""
        proposal = self._conversation.situation.proposal
        if proposal is not None and proposal.rank > 1:
            self._screen.note(f"candidate {proposal.rank} is the best that differs visibly from those shown")

    def _set_option(self, name: str, value: str) -> None:
        """Change an option if a value is given, and show its value."""
        talk = self._conversation
        match name:
            case "/parser":
                if value:
                    talk.read_with(one_of(name, value, PARSERS))
                self._screen.note(f"parser: {talk.options.reading.parser}")
            case "/viewpoint":
                if value:
                    talk.speak_from(one_of(name, value, VIEWPOINTS))
                self._screen.note(f"viewpoint: {talk.options.reading.viewpoint}")
            case "/seed":
                if value:
                    talk.seed_with(whole_number(name, value, 0, MOST_SEED))
                self._screen.note(f"seed: {talk.options.seed}")

    def _continue(self) -> None:
        if self._conversation.question is None and self._conversation.situation.proposal is not None:
            self.build()
            return
        self._screen.busy("proposing arrangements")
        if self._conversation.resume():
            self._on_proposal()

    def _scene(self, rest: str) -> None:
        word, _, seed = rest.partition(" ")
        if word:
            one_of("/scene", word, ("new",))
            number = whole_number("/scene new", seed.strip(), 0, MOST_SEED) if seed else None
            self._set_table(SIMULATED, self._conversation.options.seed + 1 if number is None else number)
        else:
            self._screen.maps.forget_key()
            self._screen.scene(self._conversation.look().to_dict())

    def _set_table(self, scene: str, seed: int) -> None:
        self._screen.busy("setting the table")
        self._conversation.another_table(scene, seed)
        self._screen.forget()
        self.show_table()

    def _save(self, path: Path) -> None:
        held = self._conversation.table.held
        if held is not None:
            raise UsageError(f"the arm holds {held}; use /undo, or give an instruction that places it, before you save")
        self._conversation.save(self._file("/save", path, SUFFIXES))
        self._screen.note(f"saved {path}; structagent chat --scene {shlex.quote(str(path))} continues with it")

    def _example(self, rest: str) -> None:
        exact = rest.endswith(" exact")
        path = self._access.path("/example", rest.removesuffix(" exact").strip())
        self._screen.busy("reading the example")
        self._show_example(self._conversation.show_example(path, exact, OwnFolder(self._session.parent, "chat")))

    def _show_example(self, figure: Figure) -> None:
        for line in picture(figure):
            self._screen.note(line)
        how = ", to be copied exactly" if figure.places else ""
        self._screen.note(
            f"“the example” is this, of {figure.legal_numbers()} objects{how}; say “the example with the cups”"
        )

    def _file(self, command: str, path: Path, suffixes: Sequence[str]) -> Path:
        """Return the path if it may be written to; overwriting a file requires the same command twice.

        Raises:
            UsageError: for a wrong suffix, a folder, and the first attempt to overwrite a file.
        """
        if path.suffix.lower() not in suffixes:
            legal = " or ".join(suffixes)
            raise UsageError(f"{command} needs a file that ends in {legal}, got {shortened(str(path))!r}")
        if path.is_dir():
            raise UsageError(f"{command} needs a file, but {str(path)!r} is a folder")
        known, self._overwrites = path == self._overwrites, path
        if path.exists() and not known:
            raise UsageError(f"there is already a file {str(path)!r}; the same command again overwrites it")
        return path

    def _help(self) -> None:
        self._screen.listing(help_lines())
        self._screen.note(
            "Anything else is an instruction, a correction of the last one, or a question: put the cups in a small "
            "circle on the left and the bowl next to it; bigger; the other side; also put the orange on the plate; "
            "drop part 2; 5 cm more; swap them; what do you see; where is the orange; what is left; undo; never mind"
        )
        if self._screen.keys:
            self._screen.note(self._screen.keys)

"""Steer a build by what is said meanwhile: every line is read at once, and a changed goal counts from the next safe
point.

Safe is where the hand is empty and the arm is folded: before each object that is taken. Lines are read in the thread
that moves the arm, between two steps of its physics.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from agent import events
from agent.arm.events import Noticed, Picked, PickFailed, Placed, PlaceFailed, StandingChanged
from agent.arm.remainder import Remainder
from agent.chat.commands import command_of
from agent.chat.explanations import describe_wish
from agent.chat.interjections import Moment, Source
from agent.chat.naming import naming_of
from agent.chat.state import Situation
from agent.chat.table_facts import join_words, with_article
from agent.errors import UsageError, exit_code_of, one_sentence
from agent.event_base import Event
from grounding.dialogue.answers import DECLINED, NO, YES, bare_words
from grounding.dialogue.state import Dialogue, Outcome, decline
from grounding.resolve.errors import ResolveError

if TYPE_CHECKING:
    from agent.chat.conversation import Conversation

NAP = 0.02  # s between two looks for a line while the arm waits
_BUILDS_ON = "the build goes on"
_FROM_WHERE_IT_WAS = ("moved", "swapped")  # relations that cannot be changed half way: they begin where things stood
_DEICTIC = re.compile(r"\b(?:this|that) one\b", re.IGNORECASE)
_FIRST = re.compile(
    r"(?:(?:no|wait|hey|oh|please|actually|sorry|not that one|not this one)[,.! ]+)*"
    r"(?:(?:begin|start|continue|go on) with (?P<start>.+?)(?: first)?"
    r"|(?:(?:take|pick|do|put|place|move|get|grab|bring|build) (?:up )?)?(?P<these>.+?)(?: goes| comes| should be)?"
    r" (?:first|next)(?: of all)?)(?:[, ]+please)?[.! ]*",
    re.IGNORECASE,
)


class Steering:
    """What is said during one build of a conversation, and what comes of it.

    Args:
        talk: the conversation; its proposal is built.
        source: says something.
        on_check: called while the arm waits; a `KeyboardInterrupt` that it raises stops the arm.

    Attributes:
        first, built, turn: as of `agent.chat.build_session.Steers`.
    """

    def __init__(self, talk: Conversation, source: Source, on_check: Callable[[], None] | None = None) -> None:
        self._talk, self._source, self._on_check = talk, source, on_check
        self._placed, self._held, self._waits = 0, "", False
        self._standing = dict[str, None]()  # in the order in which they were placed
        self._reading = self._stopped = False
        self._later: list[str] = []
        self.first: tuple[str, ...] = ()
        self.turn: tuple[Situation, Sequence[Event]] | None = None
        self.begin()

    def begin(self) -> None:
        """Take what is proposed now as what is built from here on."""
        self.turn = None
        proposal = self._talk.situation.proposal
        assert proposal is not None  # it is built
        self._proposal, self.built = proposal, self._talk.situation.dialogue
        self._line, self._outcome = "", Outcome("unchanged")
        self._asked_first = self.first

    def rest(self) -> list[str]:
        """Return the lines that are to be read once nothing is built any more."""
        later, self._later = self._later, []
        return later

    # --- what the arm does ---------------------------------------------------------------------

    def follow(self, event: Event) -> None:
        """Keep count of what the arm has placed and what it holds."""
        match event:
            case Picked():
                self._held = event.name
                self._standing.pop(event.name, None)
            case Placed():
                self._held, self._placed = "", self._placed + 1
                self._stands(event.name, not event.aside and not event.trouble)
            case StandingChanged():
                self._stands(event.name, event.stands)
            case PickFailed() | PlaceFailed() | Noticed(what="not in the hand"):
                self._held = ""

    def _stands(self, name: str, stands: bool) -> None:
        self._standing.pop(name, None)
        if stands:
            self._standing[name] = None

    @property
    def progress(self) -> str:
        """Say what the arm is doing, in sentences."""
        standing = list(self._standing)
        now = f"{with_article(self._held).capitalize()} is in the hand" if self._held else "Nothing is in the hand"
        done = f"{join_words([with_article(name) for name in standing])} stand{'s' * (len(standing) == 1)} in place"
        waits = " I wait until you say “go on”." if self._waits else ""
        wish = describe_wish(replace(self._talk.situation, dialogue=self.built))
        said = f"I am building {wish}. {now}{f'; {done}' if standing else ''}.{waits}"
        return f"{said} Then I build {describe_wish(self._talk.situation)}." if self._changed else said

    @property
    def line(self) -> str:
        """Return the line that asks for something else than is built; empty if none does."""
        return self._line if self._changed else ""

    @property
    def _changed(self) -> bool:
        wanted, built = self._talk.situation.goal, self.built.goal
        return wanted.canonical() != built.canonical() or self.first != self._asked_first

    @property
    def _when(self) -> str:
        return f"after {with_article(self._held)} is placed" if self._held else "before anything else is taken"

    # --- lines ------------------------------------------------------------------------------------

    def poll(self) -> None:
        """Read whatever was said by now.

        Raises:
            KeyboardInterrupt: for "stop".
        """
        if self._reading or self._stopped:
            return
        self._reading = True
        try:
            while (line := self._source.next(Moment(self._placed, bool(self._held), self._waits))) is not None:
                if line := " ".join(line.split()):
                    self._take(line)
        finally:
            self._reading = False

    def _take(self, line: str) -> None:
        try:
            self._read(line)
        except Exception as error:
            if exit_code_of(error) is None:
                raise
            self._tell(line, "refused", f"{one_sentence(error)}; {_BUILDS_ON}")

    def _tell(self, line: str, outcome: str, message: str = "") -> None:
        self._talk.send(events.Interjected(line, outcome, message, self._placed))

    def _read(self, line: str) -> None:
        """Read one line as a chat does, with the goal that is wanted by now in view."""
        talk = self._talk
        meant = _DEICTIC.sub(self._held, line) if self._held else line
        if (these := self._to_be_first(meant)) is not None:
            self._put_first(line, these)
            return
        command = command_of(line) if meant == line else None
        if command is not None:
            self._command(line, command[0].name)
        elif naming_of(line) is not None:
            self._tell(line, "refused", f"objects can be named only while the arm is at rest; {_BUILDS_ON}")
        elif talk.question is None and bare_words(line) in YES and self._waits:
            self._command(line, "/continue")
        elif talk.question is None and bare_words(line) in (*YES, *DECLINED):
            self._tell(line, "unchanged", f"there is no question; {_BUILDS_ON}")
        elif (acts := talk.acts_in(line)) is not None:
            self._tell(line, "answered")
            talk.reply(line, acts)
        else:
            self._wish(line, meant)

    def _command(self, line: str, name: str) -> None:
        match name:
            case "/stop":
                self._stopped = True
                self._tell(line, "stops")
                raise KeyboardInterrupt
            case "/wait":
                self._waits = True
                when = f"once {with_article(self._held)} is placed" if self._held else "here"
                self._tell(line, "waits", f"the arm waits {when}, until you say “go on”")
            case "/continue" if self._waits:
                self._waits = False
                self._tell(line, "goes on", _BUILDS_ON)
            case "/continue":
                self._tell(line, "unchanged", _BUILDS_ON)
            case "/undo" if self._changed:
                self._wish(line, "undo")
            case _:
                self._tell(
                    line, "refused", f"{name} works only while the arm is at rest: say “stop” first; {_BUILDS_ON}"
                )

    def _wish(self, line: str, text: str) -> None:
        """Take a sentence that may change what is built, or answers the open question."""
        talk, state = self._talk, self._talk.situation.dialogue
        if any(part.relation in _FROM_WHERE_IT_WAS for part in self.built.goal.relations):
            self._later.append(line)
            self._tell(
                line,
                "later",
                "a move relative to the present place cannot be changed during the build; this line is read after it",
            )
            return
        if state.question is not None and bare_words(line) in NO:
            talk.take_up(decline(state))
            self._tell(line, "unchanged", f"the question is dropped; {_BUILDS_ON}")
            return
        option = talk.option_of(line)
        new, outcome = talk.read(text) if option is None else talk.read_answer(option)
        if outcome.status == "ok" and len(new.history) < len(self.built.history):
            raise UsageError("that would undo the running build; say “stop” to end it")
        self._taken(line, state, new, outcome)

    def _taken(self, line: str, state: Dialogue, new: Dialogue, outcome: Outcome) -> None:
        talk, question = self._talk, outcome.question
        talk.take_up(new)
        if outcome.status == "ok":
            self._line, self._outcome = line, outcome
            wish = describe_wish(talk.situation)
            said = f"Understood: {wish}; it takes effect {self._when}" if self._changed else f"{wish} is built on"
            self._tell(line, "changed", "; ".join(filter(None, (said, outcome.message))))
        elif outcome.status == "ask" and question is not None:
            self._tell(line, "asked", f"{_BUILDS_ON} until you answer")
            talk.send(events.Asked(question.slot, question.text, question.options))
        else:
            status = "unchanged" if outcome.status == "unchanged" else "refused"
            self._tell(line, status, f"{outcome.message}; {_BUILDS_ON}")

    def understood(self, situation: Situation, seconds: float) -> events.Parsed:
        """Return the event of what the last change was understood as, which took some seconds."""
        return self._talk.parsed(situation, self._outcome, seconds, self.built.goal)

    # --- what is moved first ---------------------------------------------------------------------

    def _to_be_first(self, line: str) -> tuple[int, ...] | None:
        """Return the objects that a line wants to be moved before the others; `None` where it says something else."""
        found = _FIRST.fullmatch(line)
        if found is None:
            return None
        try:
            return tuple(self._talk.objects_meant(found["start"] or found["these"]))
        except ResolveError:
            return None

    def _put_first(self, line: str, these: Sequence[int]) -> None:
        names = [self._talk.situation.names[index] for index in these]
        said = join_words([with_article(name) for name in names])
        taking = {cloud.name for cloud in self._proposal.scene.objects}
        if outside := [name for name in names if name not in taking]:
            raise UsageError(f"{join_words([with_article(name) for name in outside])} is not part of this build")
        if set(names) <= {*self._standing, self._held}:
            self._tell(line, "unchanged", f"{said} {'is in the hand' if self._held in names else 'stands'} already")
            return
        self._line, self.first = line, tuple(names)
        self._outcome = Outcome("ok", self._talk.situation.goal)
        self._tell(line, "changed", f"Understood: {said} first; it takes effect {self._when}")

    # --- at a safe point ---------------------------------------------------------------------------

    def ends_here(self, remainder: Callable[[], Remainder]) -> bool:
        """Wait as long as that is wanted, and return whether something else is built from here on."""
        self.poll()
        while self._waits:
            if self._source.silent:
                self._tell("", "stops", "the input has ended and nobody can say “go on”, so the arm stops")
                raise KeyboardInterrupt
            if self._on_check is not None:
                self._on_check()
            time.sleep(NAP)
            self.poll()
        if not self._changed:
            return False
        try:
            began = time.perf_counter()
            situation, told = self._talk.proposed_around(remainder(), self.built)
            self.turn = situation, [self.understood(situation, time.perf_counter() - began), *told]
        except Exception as error:
            if exit_code_of(error) is None:
                raise
            self._talk.take_up(self.built)
            self.first = self._asked_first
            self._tell(self._line, "refused", f"{one_sentence(error)}; the build continues with the goal before")
            return False
        return True

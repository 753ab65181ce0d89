"""Process each line of a conversation about one table, up to a proposal, a question or an answer.

The module does not depend on a terminal: everything that happens is sent to listeners as events.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from agent import events
from agent.chat.answers import answer, reply_to_unknown_question
from agent.chat.goal_turns import GoalTurns
from agent.chat.knowledge import Knowledge
from agent.chat.naming import named_indices, naming_of
from agent.chat.participants import Participants, UnclearObjectError, select_participants
from agent.chat.state import apply_answer, complete_spec, with_a_shape
from agent.errors import NotBuildable, UsageError
from agent.event_base import Listener, json_value
from agent.pipeline.event_builders import perceived_event
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.scenes.renaming import renamed
from grounding.dialogue.acts import Act, acts_of, is_question
from grounding.dialogue.revise import Revision
from grounding.parse_result import OBJECT, REFUSALS, Question
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import StructureSpec

# What holds names of objects.
_WITH_NAMES = (
    "situation", "question", "_history", "_start", "_shown", "_asked", "_asked_parts", "_unclear", "_resolved",
    "_unmet",
)  # fmt: skip


class Conversation(GoalTurns):
    """A conversation about one table: instructions, corrections, answers and questions, in addition to `GoalTurns`.

    A goal is stored from the speaker's viewpoint, so that corrections apply to it directly.
    """

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        super().__init__(options, cache, listeners)
        # The revision that led to a question, and the participants before it; `None` for those of the situation.
        self._asked: tuple[Revision, Participants | None] | None = None
        self._unclear = ""  # the words for the object that the question is about
        self._resolved: dict[str, str] = {}  # such words -> the object that an answer chose for them

    # --- instructions and answers ------------------------------------------------------------------------

    def say(self, text: str) -> bool:
        """Process an instruction or a correction up to a proposal or a question. Return whether there is a proposal."""
        self._turn.begin()
        self.question = None
        self._resolved, self._asked_parts = {}, None
        self.send(events.Started(text, json_value(asdict(self.options))))
        with self._turn.part("parse"):
            last = self.situation.goal or StructureSpec()
            whole = self._revised_goal(text)
            if whole.plain is None:
                self._apply_goal(whole, text)
                return self.question is None
            revision = whole.plain
            if revision.status in ("refused", "unchanged"):
                raise NotBuildable(revision.message)
            self._apply(with_a_shape(revision, last))
            return self.question is None
        return False

    def _revised(self, last: StructureSpec, text: str) -> Revision:
        reading = self.options.reading
        return self._cache.interpreter(reading).revise(last, text, self.situation.stands)

    def answer(self, value: str | None) -> bool:
        """Apply the answer to the question: an option, or `None` to leave the slot open. Return as `say` does."""
        if self.question is not None and self._asked_parts is not None:
            return self._answer_about_parts(value)
        question, asked = self.question, self._asked
        if question is None or asked is None:
            raise UsageError("there is no question to answer")
        self.question = None
        revision, objects = asked
        with self._turn.part("parse"):
            if question.slot == OBJECT:
                self._resolved[self._unclear] = value or question.options[0]
                self._apply(revision, objects)
                return self.question is None
            spec = apply_answer(revision.spec, question.slot, value)
            # The user has confirmed the parser's guesses, so its confidences no longer apply.
            revision = replace(revision, spec=spec, status="ok", message="", question=None, parse=None)
            self._apply(revision.with_objects_of(None), objects)
            return True
        self.question, self._asked = question, asked  # the question remains if the answer cannot be carried out
        return False

    def answer_in_words(self, text: str) -> bool:
        """Apply an answer in free words, which completes the instruction before the question. Return as `say` does.

        The participants stay the same unless the answer adds or changes some. The question remains if the words say
        nothing or ask for something impossible; a complete instruction replaces it.
        """
        if self.question is not None and self._asked_parts is not None:
            return self._answer_about_parts_in_words(text)
        question, asked = self.question, self._asked
        if question is None or asked is None:
            return self.say(text)
        if question.slot == OBJECT and (name := self._described(text, question.options)):
            return self.answer(name)
        revision, objects = asked
        said = self._revised(revision.spec, text)
        if said.kind == "new" and said.words:
            done = self.say(text)
            if not done and self.question is None:
                self.question, self._asked = question, asked
            return done
        if said.status in ("refused", "unchanged"):
            raise NotBuildable(f"{said.message}; {question.text}")
        spec = complete_spec(said.spec, revision.spec)
        unanswered = question.slot == "shape" and spec.shape is None
        if unanswered or (said.kind == "edit" and said.objects_how and not said.changed):
            still_open: Question | None = question
        else:
            still_open = said.question
        self.question = None
        with self._turn.part("parse"):
            updated = replace(revision, spec=spec, message=said.message, question=still_open)
            self._apply(updated.with_objects_of(said if said.kind == "edit" else None), objects)
            return self.question is None
        self.question, self._asked = question, asked
        return False

    def _described(self, text: str, names: Sequence[str]) -> str | None:
        """Return the single object that the words describe; `None` if they describe none or several."""
        try:
            found = select_objects(text, self.table.referents_of(names), self._cache.encoder)
        except SelectionError:
            return None
        return names[found.indices[0]] if len(found.indices) == 1 else None

    def _ask(self, question: Question, revision: Revision, among: Participants | None) -> None:
        self.question, self._asked, self._asked_parts = question, (revision, among), None
        self.send(events.Asked(question.slot, question.text, question.options))

    def _apply(self, revision: Revision, among: Participants | None = None) -> None:
        """Apply a revision: ask if it is unclear, otherwise propose.

        Args:
            revision: the revision to apply.
            among: the participants before it; by default those of the situation.
        """
        began, parse, cache = time.perf_counter(), revision.parse, self._cache
        before = self.situation
        if among is not None:
            before = replace(before, goal=revision.spec, objects=among.names, missing=among.missing)
        try:  # before any question is asked
            taking = select_participants(revision, self.table, before, cache.encoder, self._resolved)
        except UnclearObjectError as doubt:
            self._unclear = doubt.phrase
            self._ask(Question(OBJECT, str(doubt), doubt.names), revision, among)
            return
        except SelectionError as error:
            raise NotBuildable("; ".join(filter(None, (str(error), self.source.hint)))) from error
        if revision.question is not None:
            self._ask(revision.question, revision, taking)
            return
        for note in filter(None, (revision.message, *taking.notes)):
            self.send(events.Noted(note))
        reading = self.options.reading
        situation = replace(
            self.situation, goal=revision.spec, objects=taking.names, poses=self.table.poses(), proposal=None,
            viewpoint=reading.viewpoint, missing=taking.missing, parts=None, names=(),
        )  # fmt: skip
        self.send(
            events.Parsed(
                situation.spec,
                parse.confidence if parse else {},
                parse.evidence if parse else {},
                parse.parser if parse else "",
                parse.dropped if parse else {},
                taking.names,
                reading.viewpoint,
                parse.prompt_sha256 if parse else None,
                cache.interpreter(reading).fallback,
                time.perf_counter() - began,
                self.situation.spec if revision.kind == "edit" else None,
            )
        )
        self._propose(situation)

    # --- questions --------------------------------------------------------------------

    def reply(self, text: str, acts: Sequence[Act]) -> None:
        """Answer small talk and questions; a pending proposal or question remains.

        Args:
            text: the line.
            acts: its dialogue acts; empty for a question of a kind that the chat cannot answer.
        """
        self.send(
            events.Answered(text, answer(acts, self._known()) if acts else reply_to_unknown_question(self._known()))
        )

    def named(self, line: str) -> bool:
        """Give objects of a recording the noun that a line says they are; a pending proposal or question remains.

        Returns:
            Whether the line says that.

        Raises:
            UsageError: for an object that is not there, and for a table that is no recording.
        """
        if (naming := naming_of(line)) is None:
            return False
        table = self.table
        indices = named_indices(naming, table.names, table.display_names)
        before = table.names
        self.source.call(table, dict.fromkeys([before[index] for index in indices], naming.noun))
        self._rename({old: new for old, new in zip(before, table.names, strict=True) if old != new})
        lines = [
            f"object {number} is {table.display_names[index]} from now on."
            for number, index in zip(naming.numbers, indices, strict=True)
        ]
        self.send(events.Answered(line, "\n".join(lines)))
        self._show_anew()
        return True

    def _rename(self, names: Mapping[str, str]) -> None:
        """Give objects other names in all that is remembered: old name -> new name."""
        if names:
            new = renamed([getattr(self, each) for each in _WITH_NAMES], names)
            for each, value in zip(_WITH_NAMES, new, strict=True):
                setattr(self, each, value)

    def _show_anew(self) -> None:
        """Tell all listeners the names of the objects, also those in the pending proposal and question."""
        proposal = self.situation.proposal
        seen = self.look() if proposal is None else perceived_event(proposal.scene, 0.0, self.table)
        self.send(seen)
        if proposal is not None:
            self.send(proposal.chosen)
        self._asked_again()

    def replied(self, line: str) -> bool:
        """Answer a line that is small talk or a question, or names objects, and asks for nothing to be built. Return
        whether it was one.
        """
        if self.named(line):
            return True
        acts = acts_of(line)
        if not acts and not (is_question(line) and self.asks_for_nothing(line)):
            return False
        self.reply(line, acts)
        return True

    def asks_for_nothing(self, text: str) -> bool:
        """Return whether the parser finds no goal in a line, so that it may be a question."""
        revision = self._revised_goal(text)
        if revision.status != "refused":
            return False
        if revision.read is None and revision.plain is None or REFUSALS["idle"] in revision.message:
            return True
        # A correction that was not understood may ask for nothing on its own: "who won the match?"
        return REFUSALS["idle"] in self._cache.interpreter(self.options.reading).interpret(text).message

    def _known(self) -> Knowledge:
        return Knowledge(
            self.look(), self.situation, self.question, self.example, self.table.held, self.table.fallen,
            self._cache.encoder, tuple(self.table.out_of_reach),
        )  # fmt: skip

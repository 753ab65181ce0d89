"""Process each line of a conversation about one table: it leads to a proposal, a question or an answer.

Knows nothing of terminals: everything that happens is sent to listeners as events.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace

from agent import events
from agent.chat.answers import answer, reply_to_unknown_question
from agent.chat.goal_turns import GoalTurns
from agent.chat.knowledge import Knowledge
from agent.chat.participants import Participants, UnclearObjectError, select_participants
from agent.chat.state import apply_answer, complete_spec, with_a_shape
from agent.errors import NotBuildable, UsageError
from agent.event_base import Listener, json_value
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.dialogue.acts import Act
from grounding.dialogue.revise import Revision
from grounding.parse_result import OBJECT, REFUSALS, Question
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import StructureSpec


class Conversation(GoalTurns):
    """A table and what was said about it: instructions, corrections, answers and questions; as `GoalTurns`.

    A goal is kept as the speaker put it, so that a correction is read in the speaker's own words.
    """

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        super().__init__(options, cache, listeners)
        # What was said before a question, and who took part before it; `None` for those of the situation.
        self._asked: tuple[Revision, Participants | None] | None = None
        self._unclear = ""  # the words of an object that is asked about
        self._resolved: dict[str, str] = {}  # such words -> the object that an answer said they mean

    # --- instructions and answers ------------------------------------------------------------------------

    def say(self, text: str) -> bool:
        """Read an instruction or a correction, up to a proposal or a question; returns whether there is a proposal."""
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
        """Take the answer to the question: one of the slot's values, `None` to leave it open; returns as `say`."""
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
            # The parser's guesses have become facts, and what it thought of them is of no interest any more.
            revision = replace(revision, spec=spec, status="ok", message="", question=None, parse=None)
            self._apply(revision.with_objects_of(None), objects)
            return True
        self.question, self._asked = question, asked  # it stands where the answer cannot be carried out
        return False

    def answer_in_words(self, text: str) -> bool:
        """Take an answer that is none of the options: it completes what was said before the question; returns as `say`.

        The objects stay those of what was said before, unless the answer adds to them or changes them. The question
        stands where the words say nothing, or what cannot be done; a whole instruction takes its place.
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
        """The only one of these objects that the words describe; `None` where there is no such one."""
        try:
            found = select_objects(text, self.table.referents_of(names), self._cache.encoder)
        except SelectionError:
            return None
        return names[found.indices[0]] if len(found.indices) == 1 else None

    def _ask(self, question: Question, revision: Revision, among: Participants | None) -> None:
        self.question, self._asked, self._asked_parts = question, (revision, among), None
        self.send(events.Asked(question.slot, question.text, question.options))

    def _apply(self, revision: Revision, among: Participants | None = None) -> None:
        """Apply what was said: ask where it is unclear, otherwise propose.

        Args:
            revision: what was said.
            among: the objects that take part before it; by default those of the situation.
        """
        began, parse, cache = time.perf_counter(), revision.parse, self._cache
        before = self.situation
        if among is not None:
            before = replace(before, goal=revision.spec, objects=among.names, missing=among.missing)
        try:  # before anything is asked
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
        """Answer small talk and questions; what is proposed or asked stands.

        Args:
            text: what was said.
            acts: what it does; nothing for a question that is none of those that can be answered.
        """
        self.send(events.Answered(text, answer(acts, self._known()) if acts else reply_to_unknown_question(self._known())))

    def asks_for_nothing(self, text: str) -> bool:
        """Return whether the parser finds no goal in a line, so that it may be a question."""
        revision = self._revised_goal(text)
        understood = revision.read is not None or revision.plain is not None
        return revision.status == "refused" and (not understood or REFUSALS["idle"] in revision.message)

    def _known(self) -> Knowledge:
        return Knowledge(
            self.look(), self.situation, self.question, self.example, self.table.held, self.table.fallen,
            self._cache.encoder, tuple(self.table.out_of_reach),
        )  # fmt: skip


"""Process each line of a conversation about one table, up to a proposal, a question or an answer.

The module does not depend on a terminal: everything that happens is sent to listeners as events.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace

from agent import events
from agent.chat.answers import answer, reply_to_unknown_question
from agent.chat.build_session import BuildSession
from agent.chat.drawings import KnowingReader, with_pictures
from agent.chat.knowledge import Knowledge
from agent.chat.naming import named_indices, naming_of
from agent.chat.state import Situation, objects_of
from agent.chat.teaching import figure_at_hand, taught_name, with_structure_before
from agent.errors import NotBuildable, UsageError
from agent.event_base import json_value
from agent.figures.picture import picture
from agent.figures.taught import teach
from agent.pipeline.event_builders import perceived_event
from agent.scenes.renaming import renamed
from grounding.dialogue import turns
from grounding.dialogue.acts import Act, acts_of, is_question
from grounding.dialogue.answers import chosen_options
from grounding.dialogue.state import Dialogue, Outcome
from grounding.figures.drawings import drawings_among, without_drawings
from grounding.figures.figure import Figure
from grounding.figures.names import figure_named
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import Part
from grounding.interpreter import Interpreter
from grounding.resolve.attributes import SceneObject
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from grounding.spec import StructureSpec
from grounding.verify.wording import with_article

_WITH_NAMES = ("situation", "_history", "_start", "_shown", "_unmet")  # what holds names of objects


class Conversation(BuildSession):
    """A conversation about one table: instructions, corrections, answers and questions, beside `BuildSession`."""

    # --- instructions and answers ------------------------------------------------------------------------

    def say(self, text: str) -> bool:
        """Process a sentence up to a proposal or a question. Return whether there is a new proposal."""
        self._turn.begin()
        self.send(events.Started(text, json_value(asdict(self.options))))
        return self._take(lambda: self.read(text))

    def read(self, text: str) -> tuple[Dialogue, Outcome]:
        """Read a sentence with the goal so far in view; nothing is changed."""
        now = self.situation
        before = now.builds[-1].goal if now.builds and not now.asked else now.goal
        text = with_structure_before(text, before, self.options.reading.like)
        reader = self._interpreter if not self._drawn else KnowingReader(self._interpreter, self._drawn)
        return self._keeping(*turns.say(now.dialogue, text, reader, self._objects(), now.stands))

    def read_answer(self, option: int) -> tuple[Dialogue, Outcome]:
        """Read the number of an option of the open question, from 0; nothing is changed."""
        now = self.situation
        return self._keeping(*turns.answer(now.dialogue, option, self.table.original_names, now.viewpoint))

    def _keeping(self, dialogue: Dialogue, outcome: Outcome) -> tuple[Dialogue, Outcome]:
        """Keep the drawings of a goal that is wanted, for the whole conversation; show those that are asked about."""
        if outcome.status == "ok":
            new = drawings_among(part.shape for part in outcome.goal.structures).values()
            self._drawn = tuple(dict.fromkeys((*self._drawn, *new)))
        return with_pictures(dialogue, outcome)

    def answer(self, option: int) -> bool:
        """Answer the question by the number of an option, from 0. Return as `say` does.

        Raises:
            UsageError: if no question is open, or it has no such option.
        """
        if self.question is None:
            raise UsageError("there is no open question to answer")
        count = len(self.question.options)
        if not 0 <= option < count:
            raise UsageError(f"there is no option {option + 1}; legal: 1 to {count}")
        return self._take(lambda: self.read_answer(option))

    def option_of(self, line: str) -> int | None:
        """Return the number of the option that a line chooses, from 0; `None` where it chooses none."""
        said = self.situation.dialogue
        if said.question is None:
            return None
        options = chosen_options(line, said.question, said.choices, self._objects(), self._cache.encoder)
        return options[0] if len(options) == 1 else None

    def objects_meant(self, phrase: str) -> tuple[int, ...]:
        """Return the indices of the objects that a noun phrase means, or the name of a structure of the goal.

        Raises:
            ResolveError: if it means none, or it is not clear which.
        """
        words = set(phrase.lower().split())
        for part in self.situation.goal.structures:
            if without_drawings(part.shape or "") in words and part.objects is not None:
                return part.objects  # type: ignore[return-value]
        return resolve_phrase(phrase, Referents(self._objects(), self._cache.encoder)).indices

    @property
    def _interpreter(self) -> Interpreter:
        return self._cache.interpreter(self.options.reading)

    def _objects(self) -> list[SceneObject]:
        return self.table.referents_of(self.table.original_names)

    def _take(self, turn: Callable[[], tuple[Dialogue, Outcome]]) -> bool:
        """Take a turn: propose what is wanted, ask, or refuse. Return whether there is a new proposal."""
        with self._turn.part("parse"):
            began = time.perf_counter()
            dialogue, outcome = turn()
            if outcome.status == "ok":
                self._want(dialogue, outcome, began)
                return self.situation.proposal is not None
            self.take_up(dialogue)
            question = outcome.question
            if outcome.status == "ask" and question is not None:
                self.send(events.Asked(question.slot, question.text, question.options))
                return False
            hint = self.source.hint if "there is only" in outcome.message else ""
            fallback = "" if outcome.reading is None else outcome.reading.fallback
            raise NotBuildable("; ".join(filter(None, (outcome.message, hint, fallback))))
        return False

    def _want(self, dialogue: Dialogue, outcome: Outcome, began: float) -> None:
        """Say what is wanted now, and propose arrangements of it."""
        if outcome.message:
            self.send(events.Noted(outcome.message))
        if not outcome.goal.parts:  # the first goal was taken back
            self._remember(replace(self.situation, dialogue=dialogue, proposal=None, shown=None, missing={}))
            raise NotBuildable("there is no goal any more; say what to build")
        situation = self._wanting(dialogue)
        self.send(self.parsed(situation, outcome, time.perf_counter() - began))
        self._propose(situation)

    def parsed(
        self, situation: Situation, outcome: Outcome, seconds: float, before: Goal | None = None
    ) -> events.Parsed:
        """Return the event of what was understood: the slots of one structure, or a line for each part.

        Args:
            situation: what is wanted now.
            outcome: of the sentence.
            seconds: of reading it.
            before: what was wanted before; by default the present goal.
        """
        reading, before = outcome.reading, self.situation.goal if before is None else before
        parse = reading.parse if reading is not None else None
        goal, spec = situation.goal, situation.goal.plain_spec
        lines = () if spec is not None else _marked(situation, outcome, before.parts)
        return events.Parsed(
            spec or (goal.structures[0].spec if goal.structures else StructureSpec()),
            parse.confidence if parse else {},
            parse.evidence if parse else {},
            parse.parser if parse else "",
            parse.dropped if parse else {},
            objects_of(goal, situation.names),
            situation.viewpoint,
            parse.prompt_sha256 if parse else None,
            reading.fallback if reading is not None else "",
            seconds,
            (before.structures[0].spec if before.structures else StructureSpec()) if before.parts else None,
            goal.to_dict(),
            lines,
            situation.names,
        )

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

    def taught(self, line: str) -> bool:
        """Keep a structure as a figure under the name that a line gives it; a pending proposal or question remains.

        Returns:
            Whether the line says that.

        Raises:
            UsageError: for a name that something else has, and where it is not clear which structure is meant.
            FigureError: for a structure that is no figure.
        """
        if (taught := taught_name(line)) is None:
            return False
        like = self.options.reading.like
        if taught.of_example and not like:
            raise UsageError("there is no example yet; /example and /arrange set one")
        scene = self.table.look()
        seen, arranged = (*scene.objects, *scene.distractors), not self.source.catalogue

        def figure_meant(name: str) -> Figure:
            if taught.of_example:
                return figure_named(like)
            return figure_at_hand(self.situation, seen, arranged, name)

        figure, path = teach(taught.name, figure_meant)
        said = with_article(figure.name)
        lines = [
            *picture(figure),
            f"From now on this is {said}, of {figure.legal_numbers()} objects. It is kept in {path}.",
        ]
        self.send(events.Answered(line, "\n".join(lines)))
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
        if self.named(line) or self.taught(line):
            return True
        acts = self.acts_in(line)
        if acts is not None:
            self.reply(line, acts)
        return acts is not None

    def acts_in(self, line: str) -> Sequence[Act] | None:
        """Return what a line does that asks for nothing to be built: none for a question of another kind; `None` for a
        line that may ask for something.
        """
        acts = acts_of(line)
        return acts if acts or (is_question(line) and self.asks_for_nothing(line)) else None

    def asks_for_nothing(self, text: str) -> bool:
        """Return whether a line asks for nothing that can be built, so that it may be a question about the scene."""
        return self._interpreter.interpret(text, self._objects()).nothing

    def _known(self) -> Knowledge:
        at_work = self._steering is not None
        seen = perceived_event(self.table.remembered(), 0.0, self.table) if at_work else self.look()
        return Knowledge(
            seen, self.situation, self.question, self.example, self.table.held, self.table.fallen,
            self._cache.encoder, tuple(self.table.out_of_reach),
            self._steering.progress if self._steering is not None else "",
            self.table.supposed if self.table.untouched else frozenset(),
        )  # fmt: skip


def _marked(situation: Situation, outcome: Outcome, before: Sequence[Part]) -> tuple[str, ...]:
    """Return a line for each part; of a goal that was changed with a word for those that are new or changed."""
    lines = tuple(describe_part(part, situation.names) for part in situation.spoken.parts)
    kept = len(lines) - len(outcome.changed)
    return tuple(
        f"{line} ({'new' if number >= len(before) else 'changed'})" if kept and number in outcome.changed else line
        for number, line in enumerate(lines)
    )

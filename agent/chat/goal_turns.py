"""Read goals of several parts in a conversation: instructions, corrections of parts, additions, and the answers to
questions about them.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from agent import events
from agent.chat.build_session import BuildSession
from agent.chat.state import Situation
from agent.errors import NotBuildable
from agent.event_base import Listener
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.dialogue.goal_changes import dependants, only_parts
from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.goal_revision import PART, GoalRevision, new_goal
from grounding.dialogue.revise_goal import revise_goal
from grounding.dialogue.scene_reader import SceneReader
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart
from grounding.parse_result import OBJECT
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import StructureSpec

# What an answer may say besides the words for a part.
_POINTING = frozenset("the a an one part please i mean meant for only just it is that this with of".split())
_STANDS = "what was built before stays as it stands"


class GoalTurns(BuildSession):
    """A table about which goals of several parts can be said; as `BuildSession`."""

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        super().__init__(options, cache, listeners)
        self._asked_parts: tuple[GoalRevision, str] | None = None  # what leads to a question about parts, and the text

    def _spoken_goal(self) -> Goal:
        """Return what was asked for last, as it was spoken; its objects are indices into the table's `original_names`.
        """
        situation = self.situation
        if (parts := situation.spoken_parts) is not None:
            return parts
        if situation.goal is None:
            return Goal()
        names = self.table.original_names
        return Goal((StructurePart.of(situation.goal, [names.index(name) for name in situation.objects]),))

    def _revised_goal(self, text: str) -> GoalRevision:
        interpreter = self._cache.interpreter(self.options.reading)
        objects = self.table.referents_of(self.table.original_names)
        return revise_goal(
            self._spoken_goal(), text, SceneReader(interpreter, objects), objects, encoder=self._cache.encoder,
            stands=[self.situation.stands], built=self.situation.built, declined=self.situation.declined,
        )  # fmt: skip

    def _revised_by_choice(self, text: str) -> GoalRevision:
        """Read the sentence that an answer leads to; a whole instruction as a goal, also of one plain structure."""
        revision = self._revised_goal(text)
        if revision.plain is None:
            return revision
        objects = self.table.referents_of(self.table.original_names)
        reader = SceneReader(self._cache.interpreter(self.options.reading), objects)
        return new_goal(self._spoken_goal(), reader.read(text), text)

    def _apply_goal(self, revision: GoalRevision, text: str) -> None:
        """Apply what was said about a goal of several parts: ask where it is unclear, otherwise propose.

        Raises:
            NotBuildable: if it is refused, or changes nothing.
        """
        if revision.status in ("refused", "unchanged"):
            message = revision.message
            hint = self.source.hint if revision.kind == "new" and "there is only" in message else ""
            raise NotBuildable("; ".join(filter(None, (message, hint))))
        if revision.status == "ask":
            self._ask_about_parts(revision, text)
            return
        self._propose_goal(revision)

    def _ask_about_parts(self, revision: GoalRevision, text: str) -> None:
        question = revision.question
        assert question is not None  # of a revision that asks
        if len(revision.choices) != len(question.options):
            raise NotBuildable(f"{question.text} Say all of it in one sentence")
        self.question, self._asked_parts = question, (revision, text)
        self.send(events.Asked(question.slot, question.text, question.options))

    def _answer_about_parts(self, value: str | None) -> bool:
        """Apply the answer to a question about parts. Return whether there is a proposal afterwards."""
        assert self.question is not None and self._asked_parts is not None  # the caller has looked
        question, (revision, text) = self.question, self._asked_parts
        number = question.options.index(value) if value in question.options else 0
        choice = revision.choices[number]
        with self._turn.part("parse"):
            self.question, self._asked_parts = None, None
            if isinstance(choice, str):
                self._apply_goal(self._revised_by_choice(choice), choice)
            else:
                if choice == self._spoken_goal():
                    raise NotBuildable("that is already so")
                last = self._spoken_goal().parts
                changed = tuple(n for n, part in enumerate(choice.parts) if n >= len(last) or part != last[n])
                gone = tuple(n for n, part in enumerate(last) if part not in choice.parts and n >= len(choice.parts))
                self._propose_goal(
                    replace(revision, goal=choice, status="ok", message="", changed=changed, dropped=gone)
                )
            return self.question is None
        self.question, self._asked_parts = (
            question,
            (revision, text),
        )  # it stands where the answer cannot be carried out
        return False

    def _answer_about_parts_in_words(self, text: str) -> bool:
        """Apply an answer in free words: the words for one of the options, or a sentence of its own.

        The question remains if the sentence has no effect.
        """
        question, asked = self.question, self._asked_parts
        assert question is not None and asked is not None  # the caller has looked
        if (option := self._option_described(text)) is not None:
            return self._answer_about_parts(option)
        if self.say(text):
            return True
        if self.question is None:
            self.question, self._asked_parts = question, asked
        return False

    def _option_described(self, text: str) -> str | None:
        """Return the single option that the words describe; `None` if they describe none or several."""
        assert self.question is not None  # the caller has looked
        options, number = self.question.options, None
        if self.question.slot == OBJECT:
            try:
                found = select_objects(text, self.table.referents_of(options), self._cache.encoder).indices
            except (SelectionError, KeyError):
                return None
            return options[found[0]] if len(found) == 1 < len(options) else None
        if self.question.slot == PART:
            goal = self._spoken_goal()
            said = GoalText(text, goal, self.table.referents_of(self.table.original_names), self._cache.encoder)
            spans = [one.span for one in (*said.parts, *said.mentions)]
            targets = None if said.left_over(spans, _POINTING) else said.targets()
            number = None if targets is None or len(targets) != 1 else targets[0] + 1
        meant = [option for option in options if number is not None and option.startswith(f"part {number} ")]
        return meant[0] if len(meant) == 1 else None

    def _propose_goal(self, revision: GoalRevision) -> None:
        began, reading, read = time.perf_counter(), self.options.reading, revision.read
        names = self.table.original_names
        goal, notes = revision.goal, [revision.message]
        if self.situation.built and revision.kind != "new":
            goal = self._still_to_build(revision)
            notes.append(_STANDS if len(goal.parts) < len(revision.goal.parts) else "")
        fewer = len(goal.parts) < len(revision.goal.parts)
        for note in filter(None, notes):
            self.send(events.Noted(note))
        situation = self._situation_of(goal, names)
        before = self.situation.spoken_parts or self._spoken_goal()
        parse = getattr(read, "parse", None)
        lines = tuple(describe_part(part, names) for part in goal.parts)
        if revision.kind != "new" and not fewer:
            lines = _marked(lines, revision, before)
        self.send(
            events.Parsed(
                situation.spec or StructureSpec(),
                parse.confidence if parse else {},
                parse.evidence if parse else {},
                parse.parser if parse else "",
                parse.dropped if parse else {},
                situation.objects,
                reading.viewpoint,
                parse.prompt_sha256 if parse else None,
                self._cache.interpreter(reading).fallback,
                time.perf_counter() - began,
                None if revision.kind == "new" else _first_spec(before),
                goal.to_dict(),
                lines,
            )
        )
        self._propose(situation)

    def _still_to_build(self, revision: GoalRevision) -> Goal:
        """Return the parts that a correction changes after the goal was built: the others stand already.

        Raises:
            NotBuildable: if it only drops parts: what stands is not taken down.
        """
        goal, kept = revision.goal, set(revision.changed)
        if not kept:
            raise NotBuildable("it stands already; “put it back” takes the last build back")
        kept |= {each for number in revision.changed for each in dependants(goal, number)}
        for number in sorted(kept):
            part = goal.parts[number]
            if isinstance(part, RelationPart) and part.relation == "on" and isinstance(part.reference, PartReference):
                kept.add(part.reference.part)  # what is put on a tower needs to know the tower
        return only_parts(goal, kept)

    def _situation_of(self, goal: Goal, names: tuple[str, ...]) -> Situation:
        """Return the situation in which a goal, as spoken, is wanted; one plain structure is kept as its slots."""
        viewpoint = self.options.reading.viewpoint
        common = {"poses": self.table.poses(), "proposal": None, "viewpoint": viewpoint, "missing": {}}
        spec, objects = goal.plain_spec, goal.parts[0].objects
        if spec is not None and isinstance(objects, tuple):
            taking = tuple(names[index] for index in objects)  # type: ignore[misc]
            return replace(self.situation, goal=spec, objects=taking, parts=None, names=(), **common)
        world = goal.turned() if viewpoint == "opposite" else goal
        everything = any(part.objects is None for part in goal.structures)
        taking = names if everything else tuple(names[index] for index in goal.named_objects())  # type: ignore[misc]
        return replace(self.situation, goal=None, objects=taking, parts=world, names=names, **common)


def _marked(lines: Sequence[str], revision: GoalRevision, before: Goal) -> tuple[str, ...]:
    """Return for each part whether a correction added or changed it."""
    return tuple(
        f"{line} ({'new' if number >= len(before.parts) else 'changed'})" if number in revision.changed else line
        for number, line in enumerate(lines)
    )


def _first_spec(goal: Goal) -> StructureSpec:
    """Return the slots of the first structure of a goal; all unspecified if it has no structure."""
    return goal.structures[0].spec if goal.structures else StructureSpec()

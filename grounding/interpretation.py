"""Hold the interpretation of an instruction: the goal, or the reason why there is none.

An interpretation joins the parse of the five slots, the reading of goals of several parts, and the selection of objects. It
can be applied to a scene that is known later, without asking a parser again.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.reading_choice import (
    FirstReading,
    asks_nothing,
    counts,
    doubted,
    excepts,
    keeps,
    notes_of,
    sorts,
)
from grounding.goal_network.second_reader import SecondReader
from grounding.goal_network.suggestions import suggested_goals
from grounding.goal_reading.reader import GoalReading, ReadsGoals, more_than_plain
from grounding.goal_reading.unread_words import unread_note
from grounding.goal_reading.verdict import not_understood, requests, verdict
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.parse_result import OBJECT, REFUSALS, Parse, Question, refusal
from grounding.references.attributes import SceneObject
from grounding.references.object_names import as_named
from grounding.references.selection import (
    AmbiguousReferenceError,
    Selection,
    SelectionError,
    mentioned,
    select_objects,
)
from grounding.spec import StructureSpec
from grounding.unsupported import no_object

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder


@dataclass(frozen=True)
class Interpretation:
    """The interpretation of an instruction: the goal, or the reason why there is none.

    Attributes:
        parse: the parser's result, in the speaker's frame.
        spec: the slots in the world's frame; for a goal of several parts those of its first structure, if any.
        status: "ok", "ask" or "refused"; an instruction that names missing objects is refused.
        message: the reason of a refusal, the question, or a remark.
        viewpoint: whose left and right it speaks of, one of `VIEWPOINTS`.
        objects: names of the selected objects, or the text's words for them if no objects are known;
            `None` for all.
        seconds: how long it took.
        fallback: why another parser than the configured one was used, and which, or empty.
        question: what has to be known before building, with status "ask".
        selection: the selected objects, as indices into those that are there, with the noun phrases that chose
            them; `None` if no objects are known or none could be selected.
        words: the text's own words for the objects; empty for everything.
        named: the nouns that chose the objects, or else the words; empty where everything is selected.
        goal: what should hold in the end, in the world's frame; without parts where it is refused or asked about. Its
            objects are indices into those that are there, or the text's words where none are known.
        by_model: whether a language model wrote the goal, and it passed all checks.
    """

    parse: Parse
    spec: StructureSpec
    status: str
    message: str
    viewpoint: str
    objects: tuple[str, ...] | None
    seconds: float
    fallback: str = ""
    question: Question | None = None
    selection: Selection | None = None
    words: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    goal: Goal = Goal()
    by_model: bool = False
    _reader: ReadsGoals | None = field(default=None, repr=False, compare=False)
    _encoder: SentenceEncoder | None = field(default=None, repr=False, compare=False)
    _second: SecondReader | None = field(default=None, repr=False, compare=False)
    # Parses the instruction with the default parser, for what the reader cannot read.
    _default: Callable[[], Interpretation] | None = field(default=None, repr=False, compare=False)
    # Of a refused instruction: the objects that are there, and whether it is a request of which some was not understood.
    _refused: tuple[Sequence[SceneObject | str | None] | None, bool] | None = field(default=None, repr=False, compare=False)
    # What the configured parser made of it, where this is the default parser's interpretation.
    _configured: Interpretation | None = field(default=None, repr=False, compare=False)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return a sentence for each adjective of the selected objects that could not be judged."""
        return self.selection.notes if self.selection else ()

    @cached_property
    def suggestions(self) -> tuple[Goal, ...]:
        """Return goals that a refused instruction may mean, the likeliest first, in the world's frame."""
        if self._refused is None or self._second is None:
            return ()
        objects, requested = self._refused
        goals = suggested_goals(self._second.likeliest(_as_named(self.parse.text, objects), objects), requested)
        return tuple(goal.turned() for goal in goals) if self.viewpoint == "opposite" else goals

    def among(self, objects: Sequence[SceneObject | str | None], catalogue: bool = False) -> Interpretation:
        """Select the objects of a scene that the instruction means; no parser is asked again.

        An interpretation that has selected objects of a library is applied to a scene drawn from it with the noun
        phrases that it has found already.

        Args:
            objects: what is there, as for `select_objects`.
            catalogue: whether it is a library that a scene can be drawn from.
        """
        if self._configured is not None and self.selection is None:
            return self._configured.among(objects, catalogue)
        return self.read(objects, catalogue)

    def read(
        self, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False
    ) -> Interpretation:
        """Read what goes beyond the five slots, and select the objects where they are known; see `among`."""
        started, text = time.perf_counter(), self.parse.text
        if (named := _as_named(text, objects)) != text:
            found = replace(self, parse=replace(self.parse, text=named)).read(objects, catalogue)
            return replace(found, parse=replace(found.parse, text=text))
        whole, reading = self._of_several_parts(objects, catalogue, started)
        if whole is not None and reading.fallback and self._default is not None:
            found = self._default().read(objects, catalogue)
            fallback = f"{reading.fallback}; the {found.parse.parser} parser read this"
            seconds = self.seconds + time.perf_counter() - started
            return replace(found, fallback=fallback, seconds=seconds, _configured=self)
        first = whole
        if first is None:
            first = self if objects is None else self._selected(objects, catalogue, started)
        return first._read_again(objects, catalogue, reading)

    def _selected(
        self, objects: Sequence[SceneObject | str | None], catalogue: bool, started: float
    ) -> Interpretation:
        """Select the objects of one plain structure."""
        if self.parse.status == "refused":
            return self
        text = self.parse.text if self.selection is None else self.selection.references or self.parse.text
        names = [each.name if isinstance(each, SceneObject) else each or "" for each in objects]
        try:
            selection = select_objects(text, objects, self._encoder, catalogue=catalogue)
        except AmbiguousReferenceError as doubt:
            question = Question(OBJECT, str(doubt), tuple(names[i] for i in doubt.indices))
            status, message, selected, named, selection = "ask", str(doubt), None, (), None
        except SelectionError as error:
            message = no_object(self.parse.text, str(error))
            status, question, selected, named, selection = "refused", None, None, (), None
        else:
            status, question = self.parse.status, self.parse.question
            message = "; ".join(filter(None, (self.parse.message, *selection.notes)))
            selected = tuple(names[i] for i in selection.indices)
            some = len(selection.indices) < len(names)
            named = selection.named or (self.words if some else ())
        goal = Goal()
        if status == "ok":
            everything = len(selection.indices) == len(names) and not selection.named and not selection.excluded
            goal = Goal((StructurePart.of(self.spec, None if everything else selection.indices),))
        return replace(
            self, status=status, message=message, question=question, objects=selected, selection=selection,
            named=named, goal=goal, seconds=self.seconds + time.perf_counter() - started,
        )  # fmt: skip

    def _of_several_parts(
        self, objects: Sequence[SceneObject | str | None] | None, catalogue: bool, started: float
    ) -> tuple[Interpretation | None, GoalReading]:
        """Interpret it as a goal that goes beyond one plain structure; `None` if it is not. Return the reading too."""
        if self._reader is None:
            return None, GoalReading()
        reading = self._reader.read(self.parse.text, objects, catalogue)
        found = verdict(self.parse, reading, objects is not None and not catalogue)
        if found is None:
            return None, reading
        seconds = self.seconds + time.perf_counter() - started
        fallback = f"{reading.fallback}; the grammar's reader read this" if reading.fallback else self.fallback
        if found.status != "ok":
            message = no_object(self.parse.text, found.message)
            return self._without_goal(found.status, message, found.question, seconds=seconds, fallback=fallback), reading
        read = replace(self, fallback=fallback, seconds=seconds, by_model=reading.by_model)
        return read._with_goal(reading, objects), reading

    def _with_goal(
        self, reading: GoalReading | NetworkReading, objects: Sequence[SceneObject | str | None] | None
    ) -> Interpretation:
        """Return the interpretation whose goal was read."""
        assert reading.goal is not None
        goal = reading.goal.turned() if self.viewpoint == "opposite" else reading.goal
        spec = goal.structures[0].spec if goal.structures else StructureSpec()
        if objects is None:
            words = tuple(map(str, goal.named_objects()))
            return replace(
                self, spec=spec, status="ok", message="; ".join(reading.notes), question=None, objects=words or None,
                words=words, named=words, goal=goal,
            )  # fmt: skip
        names = [each.name if isinstance(each, SceneObject) else each or "" for each in objects]
        selection = _selection_of(goal, reading, len(names))
        return replace(
            self, spec=spec, status="ok", message="; ".join(reading.notes), question=None,
            objects=tuple(names[i] for i in selection.indices), selection=selection, named=selection.named, goal=goal,
        )  # fmt: skip

    def _read_again(
        self, objects: Sequence[SceneObject | str | None] | None, catalogue: bool, first: GoalReading
    ) -> Interpretation:
        """Let the goal network read it too, except where grammar and parser agree on one plain structure of no known scene.

        A language model's goal is a first reading like the grammar's: a network that is certain of another goal counts.
        """
        agreed = self.status == "ok" and first.complete and not more_than_plain(first.goal)
        agreed = agreed and first.goal.parts[0].spec == self.parse.spec
        count = None if objects is None or catalogue else len(objects)
        if self._second is None or (agreed and count is None) or not self.parse.text.strip():
            return self
        started = time.perf_counter()
        second = self._second.read(self.parse.text, objects, catalogue)
        goal = self.goal.turned() if self.viewpoint == "opposite" else self.goal
        idle = self.parse.status == "refused" and REFUSALS["idle"] in self.parse.message
        text = self.parse.text
        asks_place = self.question is not None and self.question.slot != OBJECT
        known = FirstReading(
            first, self.status, goal, requests(text), idle, text, excepts(text), keeps(text), asks_place, sorts(text),
            self.parse.spec if self.parse.status == "ok" else None, agreed,
        )
        found = self
        if asks_nothing(second, known):
            refused = refusal(text, "idle", self.parse.parser)
            found = self._without_goal("refused", refused.message, parse=refused)
        elif counts(second, known, count):
            found = self._with_goal(replace(second, notes=notes_of(second, first)), objects)
            if self._default is not None:
                found = replace(found, fallback=f"{_unused(first)}; the goal network read this", by_model=False)
        elif doubted(second, known, count):
            message = not_understood(self.parse, first.residue).message
            found = self._without_goal("refused", message, self.question)
        elif known.half_read:
            found = self._with_note(unread_note(first.residue, self.goal, _words_read(self.parse)))
        if found.status == "refused" and not catalogue:
            found = replace(found, _refused=(objects, known.requests and not first.impossible))
        return replace(found, seconds=self.seconds + time.perf_counter() - started)

    def _without_goal(
        self, status: str, message: str, question: Question | None = None, **changed: Any
    ) -> Interpretation:
        """Return the interpretation of what is refused, or asked about first."""
        return replace(
            self, spec=StructureSpec(), status=status, message=message, question=question, objects=None,
            selection=None, named=(), goal=Goal(), **changed,
        )  # fmt: skip

    def _with_note(self, note: str) -> Interpretation:
        """Return the interpretation with a remark on the words that were not read, where there are any."""
        if not note:
            return self
        selection = self.selection and replace(self.selection, notes=(*self.selection.notes, note))
        return replace(self, message="; ".join(filter(None, (self.message, note))), selection=selection)

    def to_dict(self) -> dict[str, Any]:
        """Return the row of `structagent parse --json`."""
        parse = self.parse
        question = self.question
        return {
            "text": parse.text,
            "goal": self.goal.to_dict(),
            "spec": self.spec.to_dict() | {"objects": None if self.objects is None else list(self.objects)},
            "status": self.status,
            "message": self.message,
            "suggestions": [goal.to_dict() for goal in self.suggestions],
            "question": {"slot": question.slot, "options": list(question.options)} if question else None,
            "confidence": {slot: round(share, 4) for slot, share in parse.confidence.items()},
            "evidence": {slot: " ".join(words) for slot, words in parse.evidence.items()},
            "dropped": dict(parse.dropped),
            "parser": parse.parser,
            "prompt_sha256": parse.prompt_sha256,
            "fallback": self.fallback,
            "viewpoint": self.viewpoint,
            "seconds": round(self.seconds, 4),
        }


def _as_named(text: str, objects: Sequence[SceneObject | str | None] | None) -> str:
    return as_named(text, [each.name if isinstance(each, SceneObject) else each for each in objects or ()])


def _unused(first: GoalReading) -> str:
    """Say what of a language model is not used where the goal network's goal is."""
    if first.by_model:
        return "the language model's goal is not used, because the network is certain of another one"
    return "the language model's five slots are not used"


def _words_read(parse: Parse) -> set[str]:
    """Return the words in which the parser found slots, and those for the objects."""
    said = [*(words for each in parse.evidence.values() for words in each), *mentioned(parse.text)]
    return {word for words in said for word in re.findall(r"[^\W_]+", words.lower())}


def _selection_of(goal: Goal, reading: GoalReading | NetworkReading, count: int) -> Selection:
    """Return all objects of a goal: those to place and their references."""
    named = tuple(one for one in goal.named_objects() if isinstance(one, int))
    everything = any(part.objects is None for part in goal.structures)
    indices = tuple(range(count)) if everything else tuple(sorted(named))
    return Selection(indices, reading.nouns, (), tuple(sorted(named)), reading.described, reading.notes)

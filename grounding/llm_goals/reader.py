"""Parse instructions into goals with a language model, with the grammar's reader as a fallback for wrong answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.reader import GoalReader, GoalReading
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.tokens import split
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.llm_goals.checks import mismatch
from grounding.parse_result import shortened
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.references.attributes import SceneObject
from grounding.references.candidates import SelectionError
from grounding.references.object_names import vocabulary
from grounding.references.phrases import ANY, Vocabulary
from grounding.references.word_forms import FORMS
from grounding.spec import SpecError

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

KEPT = 32  # goals that are kept, so that the objects of a scene that is known later cost no second question


class UnusableGoalError(ValueError):
    """A goal of a language model that is not used; the message says why, and follows "it"."""


class GoalWriter(Protocol):
    """A language model that writes goals.

    Attributes:
        identity: which model answers; no secrets in it.
        knows_words: whether words that the grammar's reader does not know may be trusted to it.
    """

    identity: str
    knows_words: bool

    def parts(self, text: str, chunks: Sequence[Chunk]) -> list[dict[str, Any]] | str:
        """Write the parts of a goal as JSON values, with words of the instruction for objects and metres for lengths.

        Raises:
            LLMError: for a model that cannot be used, or that answers no legal goal.
            UnusableGoalError: for an answer that is no goal.
        """


class LLMGoalReader:
    """A reader of goals that asks a language model and checks its answers.

    Instructions of one plain structure stay with the parser of the five slots. A goal that is not legal, leaves
    something out or adds something is replaced by that of the grammar's reader, and `GoalReading.fallback` says why.

    Args:
        writer: makes the language model.
        grammar: the fallback reader.
        encoder: finds what unknown nouns mean; `None` does without.
        opposite: whether the speaker sits across the table.
    """

    def __init__(
        self,
        writer: Callable[[], GoalWriter],
        grammar: GoalReader,
        encoder: SentenceEncoder | None = None,
        opposite: bool = False,
    ) -> None:
        self._make_writer, self._grammar = writer, grammar
        self._encoder, self._opposite = encoder, opposite
        self._writer: GoalWriter | None = None
        self._broken = ""
        self._kept: dict[str, list[dict[str, Any]] | str | Exception] = {}

    def read(
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False
    ) -> GoalReading:
        """Read an instruction; see `GoalReader.read`."""
        known = self._grammar.read(text, objects, catalogue)
        refused = bool(known.problem) and not known.residue
        if not known.beyond or known.question is not None or refused:
            return known  # doubts are the user's to settle, and what was understood and cannot be built stays refused
        try:
            return self._read(text, objects, catalogue, known)
        except (UnusableGoalError, LLMError) as error:
            problem = str(error) if isinstance(error, LLMError) else f"the language model's goal {error}"
            return replace(known, fallback=f"{problem}; the grammar's reader read this")
        except ReadingQuestion as doubt:
            return GoalReading(question=doubt.question, beyond=True)

    def _read(
        self, text: str, objects: Sequence[SceneObject | str | None] | None, catalogue: bool, known: GoalReading
    ) -> GoalReading:
        there = None
        if objects is not None:
            there = [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]
        nouns = Vocabulary(FORMS) if there is None else vocabulary([each.name for each in there])
        chunks = without_corrections(self._grammar.chunks(text, nouns))
        unread = [chunk.said for chunk in chunks if chunk.kind == "unknown"]
        if unread and not self.writer.knows_words:
            raise UnusableGoalError(f"was not asked for, because the words {unread[0]!r} are unknown")
        parts = self._parts(text, chunks)
        if isinstance(parts, str):
            if known.complete:
                raise UnusableGoalError(f"is {parts!r}, where every word is understood")
            return replace(known, fallback=f"the language model's answer is {parts!r}; the grammar's reader read this")
        if problem := mismatch(chunks, parts):
            raise UnusableGoalError(problem)
        find = SceneReferences(there, self._encoder, catalogue, self._opposite)
        goal = _Resolution(parts, find, nouns).goal()
        if problem := contradiction(goal, None if there is None else [each.name for each in there]):
            raise UnusableGoalError(f"contradicts itself: {problem}")
        notes = [f"the language model alone understood {shortened(words)!r}" for words in dict.fromkeys(unread)]
        return GoalReading(
            goal, beyond=True, verbs=known.verbs, nouns=tuple(dict.fromkeys(find.nouns)), described=find.described,
            notes=tuple(dict.fromkeys((*find.notes, *notes))),
        )  # fmt: skip

    @property
    def writer(self) -> GoalWriter:
        """Return the language model; it is loaded at first use.

        Raises:
            LLMError: if it cannot be used; then at every use.
        """
        if self._broken:
            raise LLMError(self._broken)
        if self._writer is None:
            try:
                self._writer = self._make_writer()
            except LLMError as error:
                self._broken = f"the language model cannot be used for goals of several parts ({error})"
                raise LLMError(self._broken) from error
        return self._writer

    def _parts(self, text: str, chunks: Sequence[Chunk]) -> list[dict[str, Any]] | str:
        if text not in self._kept:
            answer: list[dict[str, Any]] | str | Exception
            try:
                answer = self.writer.parts(text, chunks)
            except (UnusableGoalError, IllegalReplyError) as error:
                answer = error
            except LLMError as error:  # as with the parser of the five slots: for good
                self._broken = str(error)
                raise
            while len(self._kept) >= KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[text] = answer
        answer = self._kept[text]
        if isinstance(answer, Exception):
            raise answer
        return answer


class _Resolution:
    """The objects of a scene in place of a goal's words."""

    def __init__(self, parts: Sequence[dict[str, Any]], find: SceneReferences, nouns: Vocabulary) -> None:
        self.parts, self.find, self.nouns = parts, find, nouns

    def goal(self) -> Goal:
        """Return the goal.

        Raises:
            UnusableGoalError: for words that are no noun phrase, objects that are not there, and parts that are not
                legal.
            ReadingQuestion: for words that several objects fit.
        """
        resolved = []
        try:
            for part in self.parts:
                values = dict(part)
                for key in ("objects", "reference", "around"):
                    if isinstance(values.get(key), (list, tuple)):
                        values[key] = self._objects(values[key])
                resolved.append(self._usual(values))
            goal = Goal.from_dict({"parts": resolved})
        except ReadingQuestion:
            raise
        except (ReadingError, SelectionError, SpecError) as error:
            raise UnusableGoalError(f"cannot be used: {error}") from error
        return Goal(tuple(self._written_out(part) for part in goal.parts))

    def _objects(self, phrases: Sequence[str]) -> list[Any] | None:
        found: list[Any] = []
        for text in phrases:
            for phrase in self._phrases(text):
                if phrase.kind in ("all", "rest") and phrase.mention is not None and phrase.mention.noun != ANY:
                    raise UnusableGoalError(f"does not say which {text!r} are")
                if phrase.kind in ("all", "rest"):
                    left_out = [one for each in phrase.without for one in self.find.find(each)]
                    if len(phrases) > 1:
                        raise UnusableGoalError(f"has {text!r} among other objects")
                    if not left_out:
                        return None
                    if self.find.count is None:
                        return [text]
                    return [one for one in range(self.find.count) if one not in left_out]
                if phrase.kind != "objects":
                    raise UnusableGoalError(f"does not say what {text!r} means")
                found += [one for one in self.find.find(phrase) if one not in found]
        return found

    def _phrases(self, text: str) -> list[NounPhrase]:
        """Read the noun phrases of some words: "the mug and the bowl" are two."""
        said = split(text)
        reader = NounPhraseReader(said, self.nouns)
        place, found = 0, []
        while place < len(said.words):
            if found and said.word(place) in ("and", ","):
                place += 1
                continue
            phrase = reader.at(place)
            if phrase is None or phrase.end <= place:
                raise UnusableGoalError(f"has {text!r} for objects, which is no noun phrase")
            if said.word(phrase.end) in ("except", "but"):
                phrase, end = self._without(reader, phrase)
            else:
                end = phrase.end
            found.append(phrase)
            place = end
        return found

    def _without(self, reader: NounPhraseReader, phrase: NounPhrase) -> tuple[NounPhrase, int]:
        place = phrase.end + 1
        place += reader.said.word(place) == "for"
        without = []
        while (other := reader.at(place)) is not None and other.end > place:
            without.append(other)
            place = other.end
            place += reader.said.word(place) in ("and", ",")
        return replace(phrase, without=tuple(without)), place

    def _usual(self, part: dict[str, Any]) -> dict[str, Any]:
        """Spell a place on the table in the usual way: one object is "at" it, several are a structure without a shape.
        """
        objects = part.get("objects")
        places = {key: part.get(key) for key in ("x_position", "y_position")}
        if part["kind"] == "relation" and part["relation"] == "at" and isinstance(objects, list) and len(objects) > 1:
            return {"kind": "structure", "objects": objects} | places
        if (
            part["kind"] == "structure"
            and part.get("shape") is None
            and isinstance(objects, list)
            and len(objects) == 1
        ):
            if any(places.values()) and isinstance(objects[0], int):
                return {"kind": "relation", "relation": "at", "objects": objects} | places
        return part

    def _written_out(self, part: Any) -> Any:
        if isinstance(part, StructurePart) and part.objects is not None and not part.objects:
            raise UnusableGoalError(f"leaves no object for the {part.shape or 'structure'}")
        return part

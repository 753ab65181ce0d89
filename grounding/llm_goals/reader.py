"""Parse instructions into goals with a language model, whose answers are checked; wrong ones are left to another reader.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.reader import GoalReader, GoalReading
from grounding.goal_reading.scene_references import ReadingQuestion, SceneReferences
from grounding.goal_reading.written_references import UnusableGoalError, WrittenReferences
from grounding.llm_goals.checks import mismatch
from grounding.parse_result import shortened
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.references.attributes import SceneObject
from grounding.references.object_names import vocabulary
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

KEPT = 32  # goals that are kept, so that the objects of a scene that is known later cost no second question


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
    something out or adds something is replaced by that of the grammar's reader, and `GoalReading.fallback` says why:
    the interpreter then lets the default parser read the whole instruction.

    Args:
        writer: makes the language model.
        grammar: the reader whose chunks the answers are compared with.
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
        if not known.beyond:
            return known
        if known.question is not None or refused:
            # Doubts are the user's to settle, and what was understood and cannot be built is no question for a model.
            finds = "has a question" if known.question is not None else "knows why it cannot be built"
            return replace(known, fallback=f"the language model was not asked for a goal, because the grammar {finds}")
        try:
            return self._read(text, objects, catalogue, known)
        except (UnusableGoalError, LLMError) as error:
            problem = str(error) if isinstance(error, LLMError) else f"the language model's goal {error}"
            return replace(known, fallback=problem)
        except ReadingQuestion as doubt:
            if known.complete:
                return replace(known, fallback="the language model's goal has a question where the grammar has none")
            return GoalReading(question=doubt.question, beyond=True, by_model=True)

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
            return replace(known, fallback=f"the language model's answer is {parts!r}")
        if problem := mismatch(chunks, parts):
            raise UnusableGoalError(problem)
        find = SceneReferences(there, self._encoder, catalogue, self._opposite)
        goal = WrittenReferences(parts, find, nouns, text=text).goal()
        if problem := contradiction(goal, None if there is None else [each.name for each in there]):
            raise UnusableGoalError(f"contradicts itself: {problem}")
        notes = [f"the language model alone understood {shortened(words)!r}" for words in dict.fromkeys(unread)]
        return GoalReading(
            goal, beyond=True, verbs=known.verbs, nouns=tuple(dict.fromkeys(find.nouns)), described=find.described,
            notes=tuple(dict.fromkeys((*find.notes, *notes))), by_model=True,
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

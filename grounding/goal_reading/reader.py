"""Read an instruction into a goal of several parts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from grounding.goal_reading.chunks import Chunk, Chunker
from grounding.goal_reading.compose import Composer
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.frames import Framer
from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.spelling import corrected
from grounding.goal_reading.tokens import Words, split, with_lengths
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.parse_result import Question, shortened
from grounding.references.attributes import SceneObject
from grounding.references.candidates import SelectionError
from grounding.references.object_names import vocabulary
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS
from grounding.spec import SpecError

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

MOST_CHARACTERS = 2000  # beyond, a text is no instruction of a few parts
_FOUR = ("circle", "line", "tower", "table setting")


@dataclass(frozen=True)
class GoalReading:
    """What the reader made of an instruction.

    Attributes:
        goal: the parts; empty where there is a problem.
        problem: why it cannot be read, or "".
        question: what must be known first.
        residue: words that carry a meaning and were not understood.
        beyond: whether the instruction asks for more than one plain structure, as far as it was understood.
        nouns: that chose objects, singulars with the adjectives that told them apart.
        verbs: whether it has a verb that asks for something.
        described: whether a colour, a size or a place chose objects.
        notes: what has to be said about the choice of objects, a sentence each.
    """

    goal: Goal = Goal()
    problem: str = ""
    question: Question | None = None
    residue: tuple[str, ...] = ()
    beyond: bool = False
    described: bool = False
    verbs: bool = False
    nouns: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Return whether every word was accounted for and a goal was found."""
        return bool(self.goal.parts) and not self.problem and not self.residue and self.question is None


class GoalReader:
    """A reader of goals.

    Args:
        encoder: knows words that are spelled right, and what unknown nouns mean; `None` does without.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, encoder: SentenceEncoder | None = None, opposite: bool = False) -> None:
        self._encoder, self._opposite = encoder, opposite

    def read(self, text: str, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False) -> GoalReading:
        """Read an instruction; directions are the speaker's.

        Args:
            text: any string.
            objects: what is there; `None` where it is not known.
            catalogue: whether they are a library that a scene can be drawn from.
        """
        if len(text) > MOST_CHARACTERS:
            return GoalReading(problem=f"the instruction is too long: {len(text)} characters; legal: up to {MOST_CHARACTERS}")
        there = None if objects is None else [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]
        nouns = Vocabulary(FORMS) if there is None else vocabulary([each.name for each in there])
        chunks = self._chunks(text, nouns)
        chunks = without_corrections(chunks)
        framer = Framer(chunks)
        frames = framer.read()
        residue = [chunk.said for chunk in (*framer.residue,)]
        find = SceneReferences(there, self._encoder, catalogue, self._opposite)
        composer = Composer(text, frames, find)
        beyond = _beyond(chunks, frames)
        try:
            goal = composer.goal()
            problem = contradiction(goal)
        except ReadingQuestion as doubt:
            return GoalReading(question=doubt.question, residue=tuple(residue), beyond=beyond)
        except (ReadingError, SpecError, SelectionError) as error:
            return GoalReading(problem=_sentence(text, error), residue=tuple(residue), beyond=beyond)
        residue += composer.unread
        if problem:
            return GoalReading(problem=f"{shortened(text)!r} contradicts itself: {problem}", residue=tuple(residue), beyond=beyond)
        return GoalReading(goal, residue=tuple(filter(None, residue)), beyond=beyond or more_than_plain(goal), verbs=any(chunk.kind == "verb" for chunk in chunks), nouns=tuple(dict.fromkeys(find.nouns)), described=find.described, notes=tuple(dict.fromkeys(find.notes)))

    def _chunks(self, text: str, nouns: Vocabulary) -> list[Chunk]:
        known: Collection[str] = self._encoder.whole_words if self._encoder is not None else ()
        said: Words = split(text, lambda word: corrected(word, nouns, known))
        said, metres = with_lengths(said, lengths_of(said))
        return Chunker(said, metres, nouns).chunks()


def _sentence(text: str, error: Exception) -> str:
    if isinstance(error, SpecError):
        return f"{shortened(text)!r} asks for what no goal can hold: {error}"
    return str(error)


def more_than_plain(goal: Goal) -> bool:
    """Tell whether a goal is more than the five slots of one of the four structures of part one."""
    if len(goal.parts) != 1:
        return bool(goal.parts)
    part = goal.parts[0]
    return isinstance(part, RelationPart) or bool(part.keys) or part.shape not in (None, *_FOUR)


_SIGNS = frozenset("grid rows columns gap radius diameter length away apart move order group along inner listed".split()) | {"order end", "length of", "beside each other", "relation it"}


def _beyond(chunks: Sequence[Chunk], frames: Sequence) -> bool:
    """Return whether something was said that one plain structure cannot hold."""
    structures = sum(frame.has("shape", "verb shape") for frame in frames)
    shapes = {each.value.name for frame in frames for each in (*frame.get("shape"), *frame.get("verb shape"))}
    relations = any(each.kind == "relation" and each.reference and each.reference[0].kind != "pronoun" for frame in frames for each in frame.predicates)
    acts = any(frame.verb in ("swap", "surround") for frame in frames)
    return structures > 1 or bool(shapes - set(_FOUR)) or relations or acts or any(chunk.kind in _SIGNS for chunk in chunks)

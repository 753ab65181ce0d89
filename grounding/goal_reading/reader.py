"""Read an instruction into a goal of several parts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

from grounding.goal_reading.beyond import alternatives, asks_beyond, known, unknown_subjects
from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.chunks import Chunker
from grounding.goal_reading.clauses import Clauses
from grounding.goal_reading.composer import NOTHING, Composer
from grounding.goal_reading.conditions import without_idle_conditions
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.drafts import ContradictionError, ImpossibleError, TwoValuesError
from grounding.goal_reading.feasibility import infeasible
from grounding.goal_reading.frames import Framer
from grounding.goal_reading.lost_wishes import lost_wishes, never_held, without_asides
from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.pairings import paired_words
from grounding.goal_reading.reports import without_reports
from grounding.goal_reading.rewordings import reworded
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences, UnjudgedError
from grounding.goal_reading.spelling import corrected
from grounding.goal_reading.tokens import Words, fluent, split, with_lengths
from grounding.goal_reading.unread_descriptions import with_descriptions_unread
from grounding.goal_reading.vague_directions import vague_direction
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.parse_result import OBJECT, Question, shortened
from grounding.references.attributes import SceneObject
from grounding.references.candidates import SelectionError
from grounding.references.object_names import vocabulary
from grounding.references.phrases import ANY, Vocabulary
from grounding.references.sentence_roles import Sentences
from grounding.references.word_forms import FORMS
from grounding.spec import FIRST_SHAPES, SpecError

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

MOST_CHARACTERS = 2000  # beyond, a text is no instruction of a few parts


@dataclass(frozen=True)
class GoalReading:
    """What the reader made of an instruction.

    Attributes:
        goal: the parts; empty where there is a problem.
        problem: why it cannot be read, or "".
        definite: whether the problem stands however else the words are read: a wish that excludes another one.
        contradictory: whether the parts that were read contradict each other.
        question: what must be known first.
        residue: words that carry a meaning and were not understood.
        beyond: whether the instruction asks for more than one plain structure, as far as it was understood.
        nouns: that chose objects, singulars with the adjectives that told them apart.
        verbs: whether it has a verb that asks for something.
        corrected: whether the speaker took something back.
        described: whether a colour, a size or a place chose objects.
        by_place: whether it chose objects by the place where they stand.
        notes: what has to be said about the choice of objects, a sentence each.
        left_over: for each phrase that no part has a use for, the objects that it fits.
        lost: those of the residue's words that surely ask for something, also of one plain structure.
        work: verbs that ask for other work than placing objects.
        conditions: words that make a wish depend on something, or put it off.
        fallback: why this reader was used in place of the configured one, or "".
        by_model: whether a language model wrote the goal.
        never: words that ask for what no goal can hold, as far as a scene is known.
        paired: whether a relation is asked for that holds one by one between objects: "a spoon in each mug".
    """

    goal: Goal = Goal()
    problem: str = ""
    definite: bool = False
    contradictory: bool = False
    question: Question | None = None
    residue: tuple[str, ...] = ()
    beyond: bool = False
    described: bool = False
    by_place: bool = False
    verbs: bool = False
    corrected: bool = False
    nouns: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    left_over: tuple[tuple[int, ...], ...] = ()
    lost: tuple[str, ...] = ()
    work: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()
    fallback: str = ""
    by_model: bool = False
    never: tuple[str, ...] = ()
    paired: bool = False

    @property
    def complete(self) -> bool:
        """Return whether every word was accounted for and a goal was found."""
        return bool(self.goal.parts) and not self.problem and not self.residue and self.question is None

    @property
    def impossible(self) -> bool:
        """Return whether all of it was understood, and cannot be built."""
        return bool(self.problem) and not self.residue


class ReadsGoals(Protocol):
    """A reader of goals: that of the grammar, or one that asks a language model."""

    def read(
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False
    ) -> GoalReading:
        """Read an instruction; see `GoalReader.read`."""


class GoalReader:
    """A reader of goals.

    Args:
        encoder: knows words that are spelled right, and what unknown nouns mean; `None` does without.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, encoder: SentenceEncoder | None = None, opposite: bool = False) -> None:
        self._encoder, self._opposite = encoder, opposite

    def read(
        self,
        text: str,
        objects: Sequence[SceneObject | str | None] | None = None,
        catalogue: bool = False,
        before: Goal = NOTHING,
        about: int | None = None,
    ) -> GoalReading:
        """Read an instruction; directions are the speaker's.

        Args:
            text: any string.
            objects: what is there; `None` where it is not known.
            catalogue: whether they are a library that a scene can be drawn from.
            before: a goal that the instruction continues: the goal that is read then begins with its parts.
            about: the part of that goal which is spoken of, where that is known.
        """
        if len(text) > MOST_CHARACTERS:
            return GoalReading(
                problem=f"the instruction is too long: {len(text)} characters; legal: up to {MOST_CHARACTERS}"
            )
        there = (
            None
            if objects is None
            else [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]
        )
        nouns = Vocabulary(FORMS) if there is None else vocabulary([each.name for each in there])
        said = self.chunks(text, nouns, not before.parts)
        chunks = without_corrections(said)
        corrections = any(chunk.kind in ("correction", "not") for chunk in said)
        find = SceneReferences(there, self._encoder, catalogue, self._opposite)
        framer = Framer(chunks, find.ambiguous)
        frames = framer.read()
        find.remember(before.named_objects())
        composer = Composer(text, frames, find, before, about)
        known_there = None if catalogue else there
        paired = paired_words(without_asides(chunks)) if known_there is not None else ()
        never = never_held(chunks) if known_there is not None else ()
        held = (*never, *paired)
        reading = GoalReading(
            residue=(*(chunk.said for chunk in framer.residue), *held),
            beyond=asks_beyond(chunks, frames),
            verbs=any(chunk.kind == "verb" for chunk in chunks),
            **_unused(framer, composer, known_there, held),
            work=tuple(chunk.said for chunk in chunks if chunk.kind == "work"),
            conditions=tuple(chunk.value for chunk in chunks if chunk.kind == "condition"),
            never=never,
            paired=bool(paired),
        )
        if reason := vague_direction(text, chunks):
            return replace(reading, problem=reason, definite=True, beyond=True)
        if (choice := alternatives(chunks)) is not None:
            words = f"{choice[0].said} or {choice[1].said}"
            fitting = () if there is None or catalogue else (i for one in choice for i in find.fitting(one.value))
            options = tuple(dict.fromkeys(there[i].name for i in fitting)) or tuple(one.said for one in choice)
            question = Question(OBJECT, f"{words!r} in {shortened(text)!r}: which of them is meant?", options)
            rest = tuple(words for words in reading.residue if words.lower() != "either")
            return replace(reading, question=question, beyond=True, residue=rest)
        try:
            goal = composer.goal()
            names = None if there is None else [each.name for each in there]
            problem = contradiction(goal, names)
            if names is not None and not catalogue and (reason := infeasible(goal, names)):
                raise ImpossibleError(reason)
        except ReadingQuestion as doubt:
            return replace(reading, question=doubt.question)
        except (ImpossibleError, UnjudgedError) as error:
            residue = tuple(words for words in reading.residue if not composer.paired or words not in paired)
            return replace(reading, problem=str(error), beyond=True, residue=residue)
        except (ReadingError, SpecError, SelectionError) as error:
            definite, contradictory = isinstance(error, ContradictionError), isinstance(error, TwoValuesError)
            return replace(reading, problem=_sentence(text, error), definite=definite, contradictory=contradictory)
        if composer.paired:
            held = tuple(words for words in held if words not in paired)
        reading = replace(
            reading,
            residue=(*(chunk.said for chunk in framer.residue), *held, *filter(None, composer.unread)),
            **_unused(framer, composer, known_there, held),
        )
        if problem:
            return replace(reading, problem=f"{shortened(text)!r} contradicts itself: {problem}", contradictory=True)
        return replace(
            reading,
            goal=goal,
            corrected=corrections,
            nouns=tuple(dict.fromkeys(find.nouns)),
            described=find.described,
            by_place=find.by_place,
            notes=tuple(dict.fromkeys((*find.notes, *composer.notes))),
        )

    def chunks(self, text: str, nouns: Vocabulary, alone: bool = False) -> list[Chunk]:
        """Divide an instruction into chunks, typing errors mended.

        Args:
            text: any string.
            nouns: that are known.
            alone: whether no goal was said before: a correction may well compare ("like the first one").
        """
        known: Collection[str] = self._encoder.whole_words if self._encoder is not None else ()
        said: Words = reworded(fluent(split(text, lambda word: corrected(word, nouns, known))))
        said, metres = with_lengths(said, lengths_of(said))
        narrated = Sentences(list(said.words), nouns.forms).narrated
        chunks = without_idle_conditions(Chunker(said, metres, nouns).chunks(), narrated)
        chunks = without_reports(chunks, said, Clauses(said, nouns), narrated)
        return with_descriptions_unread(chunks, said) if alone else chunks


def _unused(
    framer: Framer, composer: Composer, there: Sequence[SceneObject] | None, held: tuple[str, ...]
) -> dict[str, Any]:
    """Return what no frame or no part took: `left_over` and `lost` of a reading."""
    framed = [one.value for one in framer.residue if one.kind == "noun phrase"]
    phrases = [phrase for phrase in (*framed, *composer.unused) if there and known([phrase])]
    named = [phrase.mention for phrase in phrases if phrase.mention is not None and phrase.mention.noun != ANY]
    fitting = (tuple(composer.find.candidates.matching(mention)) for mention in named)
    colours = {colour for each in there or () if each.attributes is not None for colour in each.attributes.colors}
    subjects = unknown_subjects(framer.chunks) if there else ()
    lost = lost_wishes(
        composer.text,
        [*(one.said for one in framer.residue), *(phrase.text for phrase in composer.unused), *held],
        [*(phrase.text for phrase in phrases), *subjects, *held],
        colours,
    )
    return {"left_over": tuple(filter(None, fitting)), "lost": lost}


def _sentence(text: str, error: Exception) -> str:
    if isinstance(error, SpecError):
        return f"{shortened(text)!r} asks for what no goal can hold: {error}"
    return str(error)


def more_than_plain(goal: Goal) -> bool:
    """Tell whether a goal is more than the five slots of one of the four structures of part one."""
    if len(goal.parts) != 1:
        return bool(goal.parts)
    part = goal.parts[0]
    return isinstance(part, RelationPart) or bool(part.keys) or part.shape not in (None, *FIRST_SHAPES)

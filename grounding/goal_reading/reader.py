"""Read an instruction into a goal of several parts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.chunks import Chunker
from grounding.goal_reading.clauses import Clauses
from grounding.goal_reading.compose import Composer
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.drafts import ImpossibleError
from grounding.goal_reading.frame import PREDICATES, Frame
from grounding.goal_reading.frames import Framer
from grounding.goal_reading.lost_wishes import lost_wishes
from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.spelling import corrected
from grounding.goal_reading.tokens import Words, joined, split, with_lengths
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.parse_result import Question, shortened
from grounding.references.attributes import SUPERLATIVES, SceneObject
from grounding.references.candidates import SelectionError
from grounding.references.object_names import vocabulary
from grounding.references.phrases import Vocabulary
from grounding.references.sentence_roles import Sentences
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
        corrected: whether the speaker took something back.
        described: whether a colour, a size or a place chose objects.
        by_place: whether it chose objects by the place where they stand.
        notes: what has to be said about the choice of objects, a sentence each.
        lost: those of the residue's words that surely ask for something, also of one plain structure.
        fallback: why this reader was used in place of the configured one, or "".
    """

    goal: Goal = Goal()
    problem: str = ""
    question: Question | None = None
    residue: tuple[str, ...] = ()
    beyond: bool = False
    described: bool = False
    by_place: bool = False
    verbs: bool = False
    corrected: bool = False
    nouns: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    fallback: str = ""

    @property
    def complete(self) -> bool:
        """Return whether every word was accounted for and a goal was found."""
        return bool(self.goal.parts) and not self.problem and not self.residue and self.question is None


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
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False
    ) -> GoalReading:
        """Read an instruction; directions are the speaker's.

        Args:
            text: any string.
            objects: what is there; `None` where it is not known.
            catalogue: whether they are a library that a scene can be drawn from.
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
        said = self.chunks(text, nouns)
        chunks = without_corrections(said)
        corrections = any(chunk.kind in ("correction", "not") for chunk in said)
        find = SceneReferences(there, self._encoder, catalogue, self._opposite)
        framer = Framer(chunks, find.ambiguous)
        frames = framer.read()
        residue = [chunk.said for chunk in framer.residue]
        verbs = any(chunk.kind == "verb" for chunk in chunks)
        composer = Composer(text, frames, find)
        beyond = _beyond(chunks, frames)
        known = None if catalogue else there
        lost = _lost(framer, composer, known)
        try:
            goal = composer.goal()
            problem = contradiction(goal, None if there is None else [each.name for each in there])
            lost = _lost(framer, composer, known)
        except ReadingQuestion as doubt:
            return GoalReading(question=doubt.question, residue=tuple(residue), beyond=beyond, verbs=verbs, lost=lost)
        except ImpossibleError as error:
            return GoalReading(problem=str(error), residue=tuple(residue), beyond=True, verbs=verbs, lost=lost)
        except (ReadingError, SpecError, SelectionError) as error:
            return GoalReading(
                problem=_sentence(text, error), residue=tuple(residue), beyond=beyond, verbs=verbs, lost=lost
            )
        residue += composer.unread
        if problem:
            return GoalReading(
                problem=f"{shortened(text)!r} contradicts itself: {problem}", residue=tuple(residue), beyond=beyond
            )
        return GoalReading(
            goal,
            residue=tuple(filter(None, residue)),
            beyond=beyond,
            verbs=verbs,
            corrected=corrections,
            nouns=tuple(dict.fromkeys(find.nouns)),
            described=find.described,
            by_place=find.by_place,
            notes=tuple(dict.fromkeys((*find.notes, *composer.notes))),
            lost=lost,
        )

    def chunks(self, text: str, nouns: Vocabulary) -> list[Chunk]:
        """Divide an instruction into chunks, typing errors mended."""
        known: Collection[str] = self._encoder.whole_words if self._encoder is not None else ()
        said: Words = _possessives_apart(split(text, lambda word: corrected(word, nouns, known)))
        said, metres = with_lengths(said, lengths_of(said))
        return _without_reports(Chunker(said, metres, nouns).chunks(), said, nouns)


def _lost(framer: Framer, composer: Composer, there: Sequence[SceneObject] | None) -> tuple[str, ...]:
    """Return the words that no frame or no part took and that surely ask for something."""
    objects = [one.said for one in framer.residue if there and one.kind == "noun phrase" and _known([one.value])]
    objects += [phrase.text for phrase in composer.unused if there and _known([phrase])]
    colours = {colour for each in there or () if each.attributes is not None for colour in each.attributes.colors}
    return lost_wishes(
        composer.text,
        [*(one.said for one in framer.residue), *(phrase.text for phrase in composer.unused)],
        objects,
        colours,
    )


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


_TELLING = frozenset("opposite colour height width alternate alternating alternately".split())
_SIGNS = frozenset("grid rows columns gap radius diameter length apart order group".split()) | {
    "order end",
    "length of",
}


_MOST_UNREAD = 2  # with more words that are not understood, two clauses are likelier a story than two wishes


def _beyond(chunks: Sequence[Chunk], frames: Sequence[Frame]) -> bool:
    """Return whether something was certainly said that one plain structure cannot hold."""
    if _certain(chunks, frames):
        return True
    unread = sum(chunk.kind == "unknown" for chunk in chunks)
    return unread <= _MOST_UNREAD and (_unknown_act(chunks) or _several(frames))


def _certain(chunks: Sequence[Chunk], frames: Sequence[Frame]) -> bool:
    if any(chunk.kind == "unknown" and chunk.value in _TELLING for chunk in chunks):
        return True
    if any(chunk.kind in _SIGNS or chunk.metres is not None for chunk in chunks):
        return True
    if any(frame.has("shape", "verb shape", "stacked", "side by side") for frame in frames) and any(
        word in SUPERLATIVES for chunk in chunks for word in chunk.said.lower().split()
    ):
        return True
    return any(set(each.value.name for each in frame.get("shape")) - set(_FOUR) - {"cluster"} for frame in frames)


def _unknown_act(chunks: Sequence[Chunk]) -> bool:
    """Return whether an act is asked for that is not known, with its object: "... and wash the dishes"."""
    return any(
        chunk.kind == "unknown"
        and before.kind in ("and", "then")
        and after.kind == "noun phrase"
        and _known([after.value])
        for before, chunk, after in zip(chunks, chunks[1:], chunks[2:], strict=False)
    )


def _several(frames: Sequence[Frame]) -> bool:
    """Return whether several things are asked for, or one that is no structure."""
    relations = [
        (frame, each) for frame in frames for each in frame.predicates if each.kind == "relation" and each.reference
    ]
    if any(
        frame.verb in ("swap", "surround")
        and frame.objects
        or frame.has("shape")
        and set(each.value.name for each in frame.get("shape")) - set(_FOUR)
        for frame in frames
    ):
        return True
    if any(frame.objects and _known(each.reference) for frame, each in relations):
        return True
    if sum(bool(frame.objects) for frame in frames) > 1 and any(
        each.reference[0].kind == "pronoun" for _, each in relations
    ):
        return True
    asked = [
        frame
        for frame in frames
        if frame.verb not in ("", "take", "leave", "make") and _known(frame.objects) and not frame.negated
    ]
    if len(asked) > 1 and len(_nouns(asked)) > 1:
        return True
    ends = {frame.end for frame in frames}  # "screws boxes" are not two things
    told = [
        frame
        for frame in frames
        if frame.predicates
        and _known(frame.objects)
        and not frame.negated
        and (not frame.first or frame.first not in ends)
    ]
    if told and any(frame.negated and _known(frame.objects) for frame in frames):
        return True
    rest = any(
        phrase.kind == "rest" for frame in frames if frame.has("shape", "verb shape") for phrase in frame.objects
    )
    if rest and any(frame.has("shape", "verb shape", "place") for frame in told):
        return True
    shapes = {each.value.name for frame in told for each in (*frame.get("shape"), *frame.get("verb shape"))}
    places = {each.value for frame in told for each in (*frame.get("place"), *frame.get("inner"))}
    related = any(each.reference and each.value != "in" for frame in told for each in frame.get("relation"))
    return (
        len(told) > 1
        and len(_nouns(told)) > 1
        and (len(shapes) > 1 or len(places) > 1 or (bool(shapes) and (bool(places) or related)))
    )


def _nouns(frames: Sequence[Frame]) -> set[str]:
    return {phrase.mention.noun for frame in frames for phrase in frame.objects if phrase.mention is not None}


def _possessives_apart(said: Words) -> Words:
    """Say "to the box's left" as "to the left of the box"."""
    words, spans = list(said.words), list(said.spans)
    for at in range(len(words) - 3):
        owner = words[at + 2]
        if (
            words[at] in ("to", "on")
            and words[at + 1] in ("the", "my")
            and owner.endswith("'s")
            and words[at + 3] in ("left", "right")
        ):
            words[at : at + 4] = [words[at], "the", words[at + 3], "of", "the", owner.removesuffix("'s")]
            spans[at : at + 4] = [spans[at], spans[at + 1], spans[at + 3], spans[at + 3], spans[at + 1], spans[at + 2]]
    return joined(said.text, words, spans)


def _known(phrases: Sequence[NounPhrase]) -> bool:
    return bool(phrases) and all(
        phrase.kind == "structure" or (phrase.mention is not None and phrase.mention.known) for phrase in phrases
    )


def _without_reports(chunks: list[Chunk], said: Words, nouns: Vocabulary) -> list[Chunk]:
    """Drop what only reports something: "my guests arrive at eight, so ...", if it says nothing that a goal could hold."""
    narrated = Sentences(list(said.words), nouns.forms).narrated
    clauses = Clauses(said, nouns)
    kept: list[Chunk] = []
    run: list[Chunk] = []
    for chunk in [*chunks, None]:
        if chunk is not None and not _parts(chunk, run):
            run.append(chunk)
            continue
        told = run and (all(all(narrated[one.first : one.end]) for one in run) or said.word(run[0].first) in _SUBJECTS)
        told = told and said.word(run[0].first) not in _CONDITIONS
        kept += [] if told and _reports(run) and not clauses.wishes(run[0].first, run[-1].end) else run
        run = []
        if chunk is not None:
            kept.append(chunk)
    return kept


def _parts(chunk: Chunk, run: Sequence[Chunk]) -> bool:
    """Return whether a new thought begins here."""
    so = chunk.kind == "noise" and chunk.said.lower().split()[0] == "so" and bool(run) and run[-1].kind == "comma"
    return chunk.kind == "stop" or chunk.said == ":" or so


def _reports(run: Sequence[Chunk]) -> bool:
    """Return whether these chunks have words that are not understood, and nothing that could ask for something."""
    if not any(one.kind == "unknown" for one in run) or any(one.kind == "verb" for one in run):
        return False
    if any(one.value in _PAST for one in run if one.kind == "unknown"):
        return True
    asks = any(one.kind in PREDICATES and one.kind not in ("place", "size", "inner", "relation") for one in run)
    return not asks and not any(
        one.kind == "relation" and other.kind == "noun phrase" and _known([other.value])
        for one, other in zip(run, run[1:], strict=False)
    )


_PAST = frozenset(
    "came bought lost broke fell saw said got gave told cried brought belonged went won stood was were had wasn't weren't".split()
)
_CONDITIONS = frozenset(
    "if when whenever once unless until provided".split()
)  # what depends on them is not passed over
_SUBJECTS = frozenset(
    "i we my our he she they it it's i'm i've we're we've this that there there's today tonight yesterday tomorrow because since as when if the "
    "his her their everyone someone guests people nobody mum mom dad grandma what".split()
)

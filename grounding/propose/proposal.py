"""Define what a proposer makes of a text: goals in the text's words, and goals whose objects were found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from grounding.goals.goal import Goal
from grounding.parse_result import Question
from grounding.propose.qualifiers import Qualified
from grounding.propose.stand_ins import StandIns
from grounding.structure_words import words_of


@dataclass(frozen=True)
class WordedGoal:
    """A goal in the words of a text, before it is known which objects these mean.

    Attributes:
        certainty: of the proposer, 0 to 1.
        parts: as JSON values, with words of the text for objects and lengths in metres.
        kept: the words for what is to stay as it is, or is left out.
        answer: "nothing", "impossible" or "unclear" in place of a goal, or "".
        problem: why it is no goal after all, or "".
        known: phrases whose objects are known, as those of a goal so far.
        before: the goal so far.
        about: the goal so far in words: a phrase may take its noun from it, "the blue one".
        stand_ins: the taught shapes in whose words the text was read.
        qualified: what the text says of figures besides their names.
    """

    certainty: float
    parts: tuple[dict[str, Any], ...] = ()
    kept: tuple[str, ...] = ()
    answer: str = ""
    problem: str = ""
    known: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    before: Goal = Goal()
    about: str = ""
    stand_ins: StandIns = StandIns()
    qualified: tuple[Qualified, ...] = ()

    @property
    def unheld(self) -> tuple[str, ...]:
        """Return a note for each figure of the goal that is said to be of a kind that nobody knows."""
        shapes = {part.get("shape") for part in self.parts}
        held = {word.lower() for phrase in self.phrases for word in phrase.split()}
        there = [one for one in self.qualified if one.shape in shapes]
        left = [(one, [word for word in one.words if word.lower() not in held]) for one in there]
        sized = [one for one in there if one.size not in ("", *held) and "size" not in words_of(one.shape).slots]
        return tuple(
            f"{one.size!r} is ignored, because a {one.shape} has no size: more or larger objects make it larger"
            for one in sized
        ) + tuple(
            f"{' '.join(words)!r} in {' '.join((*words, one.noun))!r} is not known: this is a plain {one.shape}"
            for one, words in left
            if words
        )

    @property
    def phrases(self) -> tuple[str, ...]:
        """Return the text's words for objects."""
        own = (
            each for part in self.parts for key in ("objects", "reference", "around") for each in part.get(key) or ()
        )
        return (*(each for each in own if isinstance(each, str)), *self.kept)


@dataclass(frozen=True)
class Proposal:
    """A goal that is proposed for a text.

    Attributes:
        goal: in the speaker's frame; its objects are indices, or words where no scene is known; `None` where there is
            none.
        certainty: of the proposer, 0 to 1.
        answer: "nothing", "impossible" or "unclear" in place of a goal, or "".
        question: which objects are meant, where several fit.
        choices: the goal behind each option of the question.
        problem: why the goal cannot be had here, one sentence, or "".
        absent: whether that, or the question, is because nothing here is what was said.
        nouns: that chose the objects.
        described: whether more than nouns chose the objects.
        notes: remarks for the user, a sentence each.
        singly: whether each phrase of the goal speaks of one object.
        worded: the goal in words.
    """

    goal: Goal | None = None
    certainty: float = 0.0
    answer: str = ""
    question: Question | None = None
    choices: tuple[Goal, ...] = ()
    problem: str = ""
    absent: bool = False
    nouns: tuple[str, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    singly: bool = False
    worded: WordedGoal | None = None

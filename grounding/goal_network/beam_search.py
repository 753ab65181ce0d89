"""Search for the likeliest goals of an instruction: a beam of goals that are being written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from grounding.goal_network.legal_actions import Legal, legal_actions
from grounding.goal_network.vocabulary import END, KEYWORD, KEYWORDS, MOST_WORDS, START, Action, keyword
from grounding.goal_network.word_presence import word_presence
from grounding.resolve.attributes import SceneObject
from grounding.resolve.tokens import words_of

MOST_SAID = 100  # words; of longer instructions the network reads nothing
_END = keyword("<end>")


@dataclass(frozen=True)
class WrittenGoal:
    """A goal that the network wrote.

    Attributes:
        words: of the instruction.
        actions: what was written, without the end.
        certainty: the product of the probabilities of all choices among the legal actions.
    """

    words: tuple[str, ...]
    actions: tuple[Action, ...]
    certainty: float

    def phrase(self, place: int) -> str:
        """Return the words that the two actions at this place point at."""
        return " ".join(self.words[self.actions[place].value : self.actions[place + 1].value + 1])


@dataclass(frozen=True)
class Request:
    """An instruction whose goals are to be written.

    Attributes:
        words: of the instruction.
        presence: whether each word names something in the scene, see `word_presence`.
        answers: whether an answer may be written in place of a goal.
    """

    words: tuple[str, ...]
    presence: tuple[int, ...]
    answers: bool = True

    @classmethod
    def of(cls, text: str, objects: Sequence[SceneObject] | None, answers: bool = True) -> Request:
        """Make the request of a text in a scene; `None` where it is not known what is there."""
        words = words_of(text)
        return cls(tuple(words), tuple(word_presence(words, objects)) if len(words) <= MOST_SAID else (), answers)


@dataclass(frozen=True)
class _Unfinished:
    """A goal that a beam search is writing.

    Attributes:
        row: of the goal that it goes on with, among those that the decoder scored last.
        actions: so far.
        score: the logarithm of its certainty.
        ended: whether it is complete.
    """

    row: int = 0
    actions: tuple[Action, ...] = ()
    score: float = 0.0
    ended: bool = False

    def likeliest(self, scores: np.ndarray, asked: Request, count: int) -> list[tuple[float, int]]:
        """Return the score that it has with each of the likeliest actions that may follow, and the action's number.

        Args:
            scores: (keywords + 2 words,) of the actions that may follow.
            asked: the instruction.
            count: of actions at most.
        """
        steps = legal_actions(asked.answers)
        legal = next(steps)
        for action in self.actions:
            legal = steps.send(action)
        shares = _shares(scores, legal, len(asked.words))
        best = [int(number) for number in np.argsort(-shares)[:count]]
        return [(self.score + math.log(shares[number]), number) for number in best if shares[number] > 0.0]

    def after(self, row: int, score: float, action: Action) -> _Unfinished:
        """Return it with one more action, its own row among those that were scored, and its score then."""
        ended = action == _END
        return _Unfinished(row, self.actions if ended else (*self.actions, action), score, ended)


class Beam:
    """A beam search of one instruction.

    Args:
        asked: the instruction.
        count: of goals at most, and the width of the beam.

    Attributes:
        unfinished: goals that are being written; none at the end.
        found: complete goals, the most certain first.
    """

    def __init__(self, asked: Request, count: int) -> None:
        self._asked, self._count = asked, count
        self.unfinished = [_Unfinished()]
        self.found: list[WrittenGoal] = []

    def advance(self, scores: Sequence[np.ndarray], first: int) -> list[int]:
        """Write one action more, and return the rows with which the goals go on that are unfinished then.

        Args:
            scores: of the actions that may follow each unfinished goal.
            first: the row of the first of them among all that were scored.
        """
        likely = [
            (score, number, action)
            for number, (one, row) in enumerate(zip(self.unfinished, scores, strict=True))
            for score, action in one.likeliest(row, self._asked, self._count)
        ]
        likely.sort(key=lambda step: -step[0])
        words = len(self._asked.words)
        steps = [
            self.unfinished[number].after(first + number, score, _action(action, words))
            for score, number, action in likely[: self._count]
        ]
        ended = [WrittenGoal(self._asked.words, one.actions, math.exp(one.score)) for one in steps if one.ended]
        self.unfinished = [one for one in steps if not one.ended]
        self.found = sorted([*self.found, *ended], key=lambda goal: -goal.certainty)[: self._count]
        least = self.found[-1].certainty if len(self.found) == self._count else 0.0
        if self.unfinished and math.exp(self.unfinished[0].score) <= least:
            self.unfinished = []
        return [one.row for one in self.unfinished]


def _shares(scores: np.ndarray, legal: Legal, words: int) -> np.ndarray:
    """Return the probabilities of the actions among the legal ones, in the order of `GoalDecoder.scores`."""
    allowed = np.zeros(len(scores), dtype=bool)
    allowed[: len(KEYWORDS)] = _mask(legal.keywords)
    starts, ends = len(KEYWORDS), len(KEYWORDS) + words
    allowed[starts:ends] = legal.start
    if legal.end_from is not None:
        allowed[ends + legal.end_from : ends + min(legal.end_from + MOST_WORDS, words)] = True
    scores = np.where(allowed, scores, -np.inf)
    shares = np.exp(scores - scores.max())
    return shares / shares.sum()


@cache
def _mask(keywords: frozenset[int]) -> np.ndarray:
    """Return which of all keywords (KEYWORDS,) bool some are; there are a few hundred such choices."""
    mask = np.zeros(len(KEYWORDS), dtype=bool)
    mask[list(keywords)] = True
    return mask


def _action(number: int, words: int) -> Action:
    """Return the action with a number in `GoalDecoder.scores`."""
    starts, ends = len(KEYWORDS), len(KEYWORDS) + words
    if number < starts:
        return Action(KEYWORD, number)
    return Action(START, number - starts) if number < ends else Action(END, number - ends)

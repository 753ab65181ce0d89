"""Define what can be in the way when the objects of words are looked for."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.parse_result import Question


class ResolveError(ValueError):
    """Words that mean nothing here, or that are not understood; the message is a sentence that says which and why."""


class AbsentError(ResolveError):
    """Words that nothing here is."""

    def __init__(self, words: str) -> None:
        super().__init__(f"nothing here is {words!r}")


class UnjudgedError(ResolveError):
    """An adjective of which nothing here tells which objects it fits; `word` is it."""

    def __init__(self, word: str) -> None:
        self.word = word
        super().__init__(f"it is not known which of the objects here are {word!r}")


class UnclearObjectsError(ResolveError):
    """Words that several objects fit, or only something else than they say.

    Attributes:
        question: which objects are meant.
        phrase: the words.
        indices: the objects that they may mean.
        count: how many of them they speak of.
        absent: whether nothing here is what they say.
    """

    def __init__(
        self, question: Question, phrase: str, indices: Sequence[int], count: int = 1, absent: bool = False
    ) -> None:
        self.question, self.phrase, self.indices, self.count = question, phrase, tuple(indices), count
        self.absent = absent
        super().__init__(question.text)


class Doubt(Exception):
    """More objects fit a phrase than it speaks of, or only objects of a like kind.

    Attributes:
        phrase: the words.
        found: the objects.
        instead: the noun of which none is here; empty where several fit.
        count: how many objects the phrase speaks of.
    """

    def __init__(self, phrase: str, found: Sequence[int], instead: str = "", count: int = 1) -> None:
        self.phrase, self.found, self.instead, self.count = phrase, list(found), instead, count
        super().__init__(f"several fit {phrase!r}: {self.found}")

"""Define the questions to a language model and its legal answers: six questions, each with a closed list.

A reply is a distribution over the legal answers of every question. A back end that only names one
answer gives it all the weight.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from typing import Protocol

from grounding.parse_result import REFUSALS
from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SLOTS

BUILD = "build"  # the answer to "request" that is no refusal
NONE = "NONE"  # how a prompt writes "unspecified", as in the paper's listing
# Question -> the answers that exist, as a prompt writes them.
ANSWERS: Mapping[str, tuple[str, ...]] = {
    "request": (BUILD, *REFUSALS),
    **{slot: (*LEGAL_VALUES[slot], NONE) for slot in SLOTS},
    "shape": (*FIRST_SHAPES, NONE),  # those that the prompt explains and the shipped adapter was taught
}
# Question -> answer -> probability; sums to 1 per question.
Reply = Mapping[str, Mapping[str, float]]


class LLMError(RuntimeError):
    """A language model that cannot be used; the message is one sentence that says which and why."""


class IllegalReplyError(LLMError):
    """A language model that answers, but not legally to this text: others may still be read with it."""


class Backend(Protocol):
    """A language model that answers the questions.

    Attributes:
        identity: which model answers, for results and caches; no secrets in it.
        gives_probabilities: whether its replies say how sure it is.
    """

    identity: str
    gives_probabilities: bool

    def ask(self, prompt: str, text: str) -> Reply:
        """Ask about one instruction.

        Args:
            prompt: what the model is told first: the task, the legal answers, examples.
            text: the instruction, as `quotable` gives it.

        Raises:
            LLMError: if no legal reply can be had; an `IllegalReplyError` where that concerns this text alone.
        """


def quotable(text: str) -> str:
    """Put the text on one line without quotation marks, so that it cannot leave the quotes of a prompt."""
    return " ".join(readable(text).translate(_QUOTES).split())


def readable(text: str) -> str:
    """Put the text on one line that any server can take: control characters and surrogates end words."""
    kinds = ((char, unicodedata.category(char)) for char in text)
    return " ".join("".join(" " if kind[0] == "C" else char for char, kind in kinds if kind != "Cf").split())


_QUOTES = str.maketrans({'"': "'", "“": "'", "”": "'", "„": "'", "`": "'"})


def certain(answers: Mapping[str, str]) -> Reply:
    """Make the reply that names one answer per question."""
    return {
        question: {answer: float(answer == answers[question]) for answer in legal}
        for question, legal in ANSWERS.items()
    }

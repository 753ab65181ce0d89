"""Decide which reading of an instruction counts: the five slots of one structure, or a goal of several parts."""

from __future__ import annotations

import re
from dataclasses import dataclass

from grounding.goal_reading.reader import GoalReading, more_than_plain
from grounding.parse_result import REFUSALS, Parse, Question, shortened

_ASKING = re.compile(
    r"\s*(?:(?:is|are|was|were|am|does|did|has|how|what|what's|where|where's|when|which|who|whose|why)\b(?! (?:about|an?)\b)|do (?:the|they|we|i|you (?:see|know|think|have))\b)",
    re.IGNORECASE,
)
_STATED = re.compile(r"\b(?:is|are|was|were)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Verdict:
    """What counts of an instruction that asks for more than five slots.

    Attributes:
        status: "ok", "ask" or "refused".
        message: why it is refused, or the question; empty otherwise.
        question: only with "ask".
    """

    status: str
    message: str = ""
    question: Question | None = None


def verdict(parse: Parse, reading: GoalReading, known: bool = False) -> Verdict | None:
    """Decide about an instruction; `None` where the five slots of the parse count.

    Args:
        parse: what the parser of the five slots made of it.
        reading: what the reader of goals made of it.
        known: whether it is known what stands on the table: the reader of goals then says which objects are meant.
    """
    if reading.complete:
        plain = parse.status != "refused" and not more_than_plain(reading.goal)
        taken_back = plain and (reading.corrected or known) and parse.status == "ok" and parse.spec == reading.goal.parts[0].spec
        if _only_reported(parse, reading) or (plain and not taken_back):
            return None
        return Verdict("ok")
    refused = parse.status == "refused" and not (_idle(parse) and not reading.verbs) and not _ASKING.match(parse.text)
    goal = any(REFUSALS[reason] in parse.message for reason in ("several", "relation"))
    if not (reading.beyond or (refused and (goal or not reading.residue))) or _asks_nothing(parse, reading):
        return None
    if reading.residue and reading.question is not None and parse.status == "ok":
        return None
    if reading.residue:
        listed = " and ".join(repr(words) for words in dict.fromkeys(map(shortened, reading.residue)))
        return Verdict("refused", f"{listed} in {shortened(parse.text)!r} is not understood; nothing is built before every part of it is clear")
    if reading.question is not None:
        return Verdict("ask", reading.question.text, reading.question)
    if reading.problem:
        return Verdict("refused", reading.problem)
    if goal:
        text = f"it is not clear what should go where in {shortened(parse.text)!r}; say each part plainly, as 'put the mug left of the bowl, then stack the cans'"
        return Verdict("refused", text)
    return None


def _only_reported(parse: Parse, reading: GoalReading) -> bool:
    """Return whether the instruction asks or tells where something is: "is the mug next to the bowl?"."""
    if parse.status != "refused":
        return False
    if _ASKING.match(parse.text):
        return True
    return _idle(parse) and not reading.verbs and _STATED.search(parse.text) is not None


def _asks_nothing(parse: Parse, reading: GoalReading) -> bool:
    return parse.status == "refused" and (_idle(parse) or _ASKING.match(parse.text) is not None) and bool(reading.residue)


def _idle(parse: Parse) -> bool:
    return REFUSALS["idle"] in parse.message

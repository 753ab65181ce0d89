"""Decide which reading of an instruction counts: the five slots of one structure, or a goal of several parts."""

from __future__ import annotations

import re
from dataclasses import dataclass

from grounding.goal_reading.goal_words import SHAPE_NOUNS
from grounding.goal_reading.reader import GoalReading, more_than_plain
from grounding.parse_result import REFUSALS, Parse, Question, shortened
from grounding.spec import LEGAL_VALUES, SLOTS

_QUESTION = re.compile(
    r"\s*(?:(?:is|are|was|were|am|does|did|has|how|what|what's|where's|which|who|whose|why)\b(?! (?:about|an?)\b)"
    r"|(?:when|where) (?:is|are|was|were|do|does|did|will|can|could|should|would)\b"
    r"|do (?:the|they|we|i|you (?:see|know|think|have))\b)",
    re.IGNORECASE,
)
# Requests that are worded like questions: "why don't you stack the cans", "what I need is two towers".
_REQUEST = re.compile(
    r"\s*(?:why (?:don't|not)\b|is there (?:any|a) (?:way|chance|possibility)\b|is it (?:ok|okay|possible|all right|too much)\b"
    r"|what (?:if|(?:i|we)(?:'d)? (?:\w+ )?(?:want|need|like|ask)|you (?:have|need) to)\b|do you think (?:you|we) (?:can|could|might)\b)",
    re.IGNORECASE,
)
_MOST_UNREAD = 4  # with more words that are not understood, what was read is likelier a story than several wishes
_DENIED = re.compile(
    r"[\s,]*(?:and |but )?(?:not|rather than|instead of|no longer) (?:on|in|at|to|near|along|against|by|left|right|far|the|close|too)\b",
    re.IGNORECASE,
)
_DEPTHS = {
    **dict.fromkeys(("near", "front", "me", "close", "you"), "bottom"), **dict.fromkeys(("far", "back", "rear"), "top"),
    "centre": "center",
}  # fmt: skip
_EDGES = ("near", "far", "left", "right")
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
        taken_back = (
            plain and (reading.corrected or known) and parse.status == "ok" and parse.spec == reading.goal.parts[0].spec
        )
        if _only_reported(parse, reading) or (plain and not taken_back and not _shape_missed(parse, reading) and not (known and _places_chose(parse, reading))):
            return None
        return Verdict("ok")
    refused = parse.status == "refused" and not (_idle(parse) and not reading.verbs) and not _asks(parse.text)
    goal = any(REFUSALS[reason] in parse.message for reason in ("several", "relation"))
    if reading.work and not _asks(parse.text):
        return _other_work(parse, reading.work)
    if reading.conditions and parse.status != "refused":
        listed = " and ".join(repr(each) for each in dict.fromkeys(reading.conditions))
        text = f"{listed} in {shortened(parse.text)!r} makes the wish depend on something; say only what should be built now"
        return Verdict("refused", text)
    if parse.status != "refused" and not _asks(parse.text):
        denied = [
            question
            for words in reading.residue
            if _DENIED.match(words) and (question := _elsewhere(parse, words)) is not None
        ]
        if denied:
            return denied[0]
        if known and any(words.lower() in ("edge", "rim", "border") for words in reading.residue):
            return _which_edge(parse)
        shapes = {SHAPE_NOUNS.get(words.lower(), "") for words in reading.residue}
        another = bool(shapes) and not shapes & {
            "",
            parse.spec.shape,
        }  # beside it only noise: "cups: circle; cans: pillar"
        if reading.lost or another:
            return not_understood(parse, reading.lost or reading.residue)
    definite = known and len(reading.residue) < 2 and (reading.problem or reading.question is not None)
    several = known and len(reading.residue) <= _MOST_UNREAD and more_than_plain(reading.goal)
    if not (reading.beyond or several or definite or (refused and (goal or not reading.residue))) or _asks_nothing(parse, reading):
        return None
    if reading.residue and reading.question is not None and parse.status == "ok" and not known:
        return None
    if reading.residue:
        return not_understood(parse, reading.residue)
    if reading.question is not None:
        return Verdict("ask", reading.question.text, reading.question)
    if reading.problem:
        return Verdict("refused", reading.problem)
    if goal:
        text = f"it is not clear what should go where in {shortened(parse.text)!r}; say each part plainly, as 'put the mug left of the bowl, then stack the cans'"
        return Verdict("refused", text)
    return None


def _shape_missed(parse: Parse, reading: GoalReading) -> bool:
    """Return whether only the reader of goals found a shape, and else both found the same: "put the cups abreast"."""
    spec = reading.goal.parts[0].spec
    slots = ((getattr(parse.spec, slot), getattr(spec, slot)) for slot in SLOTS)
    return parse.spec.shape is None and spec.shape is not None and all(read in (None, other) for read, other in slots)


def _places_chose(parse: Parse, reading: GoalReading) -> bool:
    """Return whether the readings differ only in sides that say which objects are meant: "stack the two rightmost cups"."""
    spec = reading.goal.parts[0].spec
    differing = [slot for slot in SLOTS if getattr(spec, slot) != getattr(parse.spec, slot)]
    sides = ("x_position", "y_position", "rotation")
    asked = parse.question is None or parse.question.slot in sides
    return reading.by_place and asked and all(slot in sides and getattr(spec, slot) is None for slot in differing)


def _elsewhere(parse: Parse, words: str) -> Verdict | None:
    """Ask for the place where an instruction says only where not ("but not on the left"); `None` where it says it."""
    slot = "x_position" if re.search(r"\b(?:left|right)", words.lower()) else "y_position"
    denied = {_DEPTHS.get(word, word) for word in words.lower().split()}
    if getattr(parse.spec, slot) not in (None, *denied):
        return None
    options = tuple(value for value in LEGAL_VALUES[slot] if value not in denied)
    text = f"{words!r} in {shortened(parse.text)!r} says only where it should not be; where should it be: {', '.join(options)}?"
    return Verdict("ask", text, Question(slot, text, options))


def _which_edge(parse: Parse) -> Verdict:
    """Ask for the edge of the table that is meant ("close to the edge")."""
    text = f"which edge of the table is meant in {shortened(parse.text)!r}: {', '.join(_EDGES)}?"
    return Verdict("ask", text, Question("edge", text, _EDGES))


def not_understood(parse: Parse, words: tuple[str, ...]) -> Verdict:
    """Refuse an instruction because of words that nobody understood."""
    listed = [repr(each) for each in dict.fromkeys(map(shortened, words))]
    said = " and ".join(filter(None, (", ".join(listed[:-1]), listed[-1])))
    are = "is" if len(listed) == 1 else "are"
    return Verdict(
        "refused",
        f"{said} in {shortened(parse.text)!r} {are} not understood; nothing is built before every part of it is clear",
    )


def _other_work(parse: Parse, verbs: tuple[str, ...]) -> Verdict:
    listed = " and ".join(repr(each) for each in dict.fromkeys(map(shortened, verbs)))
    text = f"{listed} in {shortened(parse.text)!r} asks for other work than placing objects; leave it out"
    return Verdict("refused", text)


def _asks(text: str) -> bool:
    """Return whether a text is worded like a question, and is none that requests something."""
    return _QUESTION.match(text) is not None and _REQUEST.match(text) is None


def requests(text: str) -> bool:
    """Return whether a text may request something: it is not worded like a question about the scene."""
    return not _asks(text)


def _only_reported(parse: Parse, reading: GoalReading) -> bool:
    """Return whether the instruction asks or tells where something is: "is the mug next to the bowl?"."""
    if parse.status != "refused":
        return False
    if _asks(parse.text):
        return True
    return _idle(parse) and not reading.verbs and _STATED.search(parse.text) is not None


def _asks_nothing(parse: Parse, reading: GoalReading) -> bool:
    return (
        parse.status == "refused" and (_idle(parse) or _asks(parse.text)) and bool(reading.residue)
    )


def _idle(parse: Parse) -> bool:
    return REFUSALS["idle"] in parse.message

"""Find what makes a wish depend on something, or puts it off: "if the plate is empty", "tomorrow", "every hour".

The arm works once and at once, so that nothing is built of a wish that says otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.tokens import Words

_NUMBER = r"(?:an?|one|two|three|four|five|six|ten|twenty|thirty|half an|a few|a couple of|\d+)"
_TIME = r"(?:seconds?|minutes?|mins?|secs?|hours?|days?|weeks?|months?|years?)"
_CONDITION = re.compile(
    r"(?<!as )(?:but |and |or )?(?:only |just |even )?(?:if(?! (?:you|possible|i|we|it's possible|necessary|needed|need be|so)\b)|unless|(?:until|till)(?! (?:they|it|you|there|that|the|then|yesterday|now|today|recently|last)\b)|whenever|provided(?: that)?|providing(?: that)?"
    r"|as long as|so long as|on condition that|assuming(?: that)?|as soon as|the moment(?= (?:i|you|he|she|the|my)\b)|each time|every time)(?= )"
    r"|only when|when(?= (?:(?:i|someone|he|she) (?:clap|claps|say|says|tell|tells|snap|snaps|whistle|whistles|press|give|gives|wave|nod|signal)"
    r"|(?:the \w+|it|they) (?:is|are|rings?|starts?|stops?|beeps?))\b)"
    r"|once(?= (?:i|he|she|my|our|someone|somebody|everyone)\b)"
)
_TIMES = re.compile(
    rf"(?:in|after|for|within|every) {_NUMBER} (?:more )?{_TIME}|(?:every|each) (?:second|minute|hour|day|morning|evening|night|week|monday|sunday|time)"
    rf"|(?:tomorrow|later(?: on| today)?|next (?:week|month|year|monday|sunday)|at (?:noon|midnight|night|dawn|dusk|\d+ (?:o'clock|pm|am|sharp)))"
    r"|(?:\d+|three|four|five|ten|several|a few|many) times|once more and once more|over and over(?: again)?|again and again"
)

_PERSONS = frozenset("i we you they he she".split())
_ASKING = frozenset("could shall should must if that".split())
_MODALS = frozenset("won't will would can't cannot couldn't doesn't don't didn't might may".split())


def condition_at(said: Words, place: int) -> tuple[str, int] | None:
    """Return a condition or a time that begins at a word, and the place after it; `None` where none does."""
    match = said.match(_CONDITION, place) or said.match(_TIMES, place)
    return None if match is None else (match[0].group().strip(), match[1])


def without_idle_conditions(chunks: Sequence[Chunk], narrated: Sequence[bool]) -> list[Chunk]:
    """Make unknown words of the conditions and times that belong to no request, but to a story around it.

    Args:
        chunks: of the instruction.
        narrated: for each word, whether its sentence only reports something.
    """
    kept = []
    for number, chunk in enumerate(chunks):
        if chunk.kind == "condition" and not _counts(chunks, number, narrated):
            chunk = replace(chunk, kind="unknown")
        kept.append(chunk)
    return kept


def _counts(chunks: Sequence[Chunk], number: int, narrated: Sequence[bool]) -> bool:
    chunk = chunks[number]
    timed = _TIMES.fullmatch(chunk.value) is not None
    run = _run(chunks, number, ("stop", "comma") if timed else ("stop",))
    asks = any(
        (one.kind == "verb" and before.said.lower() not in _MODALS and not _told(chunks, one) and not (timed and one.said.lower().split()[0].endswith("ed")))
        or (one.kind == "shape" and not one.value.definite)
        for before, one in zip([chunk, *run], run, strict=False)
    )
    alone = timed and len([one for one in run if one.kind != "noise"]) == 1
    first = next((one.kind for one in run if one.kind not in ("noise", "and")), "")
    asks = asks and (not timed or first in ("verb", "condition", "shape"))  # "my aunt comes tomorrow and I want ..."
    return (asks or alone) and not (timed and narrated[chunk.first])


def _told(chunks: Sequence[Chunk], verb: Chunk) -> bool:
    """Return whether somebody is said to do it: "what you do here every day"; but "could you do it every day"."""
    said = [one.said.lower() for one in chunks if one.end <= verb.first][-2:]
    return bool(said) and said[-1] in _PERSONS and said[0] not in _MODALS and said[0] not in _ASKING


def _run(chunks: Sequence[Chunk], at: int, ends: tuple[str, ...]) -> list[Chunk]:
    """Return the chunks around one, between marks of these kinds."""
    first = max((i + 1 for i in range(at) if chunks[i].kind in ends), default=0)
    last = min((i for i in range(at, len(chunks)) if chunks[i].kind in ends), default=len(chunks))
    return list(chunks[first:last])

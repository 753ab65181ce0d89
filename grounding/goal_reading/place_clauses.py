"""Read the clauses after a noun that say which object is meant by its place: "nearest to me", "that is on the left"."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.tokens import Words
from grounding.references.attributes import COLOR_WORDS, MEASURES, SUPERLATIVES, UNJUDGED

_LINK = re.compile(
    r"(?:,? ?(?:that's|who's|which's)|,? ?(?:that|which|who) (?:is|are|stands?|sits?|lies|lie|was|were|happens to be|rests?))"
    r"(?: (?:standing|sitting|lying|located|placed|positioned|currently|now|the|over|situated))*(?= )"
)
_PARTICIPLE = re.compile(r"(?:standing|sitting|lying|located|positioned|situated|resting)(?= )")
_SIDE = re.compile(
    r"(?:(?:all the way |over |further |furthest |farthest |most )*(?:on|at|to|in|toward) (?:the |my |your )?(?:far |very |extreme )?"
    r"(?P<side>left|right|front|back|rear|middle)(?: most)?(?: hand)?(?: side| end)?(?: of the table)?)(?! of\b)"
)
_OUTER = re.compile(
    r"(?:the )?(?:(?:furthest|farthest|most|further|farther|more|closest|nearest)(?: away)?(?: over)?)(?: (?:to|toward|on|at|from))?(?: the| my| your)? "
    r"(?P<side>left|right|front|back|rear|forward|forwards)(?: most)?(?: hand)?(?: side| end)?(?: of the table)?(?! of\b)"
)
_PERSON = re.compile(
    r"(?:the )?(?:very )?(?P<how>closest|nearest|closer|nearer|near|close|farthest|furthest|farther|further|far)(?: away)?"
    r"(?:(?: to| from)? (?P<who>me|us|myself|you|yourself|the robot|the arm|the robot arm|the gripper|where (?:i|we) (?:sit|stand|am|are)(?: standing| sitting)?))(?! of\b)"
)
_AWAY = re.compile(
    r"(?:the )?(?P<how>closest|nearest|closer|nearer|farthest|furthest|farther|further)(?: away)?(?: away| back| off)?(?= |$)(?! (?:to|from|left|right|away|the|back)\b)"
)
_SUPERLATIVE = re.compile(
    r"(?:the )?(?:very )?(?P<how>closest|nearest|closer|nearer|farthest|furthest|farther|further)(?: away)?(?: to| from)?(?= )"
)
_STANDS = re.compile(
    r"(?:(?:just|right|directly|immediately) )*(?:(?:(?:to|on) (?:the |its )?)?(?P<side>left|right)(?: hand)?(?: side)? of|(?P<other>behind|in front of|next to|beside|close to|near to|near|by|on top of|on|inside|in))(?= )"
)
_RELATIONS = {
    "behind": "behind", "in front of": "in front of", "next to": "next to", "beside": "next to", "close to": "next to", "near to": "next to",
    "near": "next to", "by": "next to", "on top of": "on", "on": "on", "inside": "in", "in": "in",
}  # fmt: skip
_SIDES = {
    "front": "near",
    "back": "far",
    "rear": "far",
    "forward": "near",
    "forwards": "near",
    "left": "left",
    "right": "right",
    "middle": "middle",
}


def with_clause(said: Words, phrase: NounPhrase, phrase_at: Callable[[int], NounPhrase | None]) -> NounPhrase:
    """Add the clause of place that follows a noun phrase; the phrase itself where none does.

    Without "that is", only "nearest to ..." and the like, or a participle ("standing on the left"), belong to the noun:
    "the cup on the left" may say where it goes.

    Args:
        said: the words.
        phrase: for objects.
        phrase_at: reads the noun phrase that begins at a place.
    """
    link = said.match(_LINK, phrase.end) or said.match(_PARTICIPLE, phrase.end)
    at = link[1] if link else phrase.end
    unjudged = phrase.mention is not None and not phrase.mention.plural and said.word(at) in UNJUDGED
    if link and (_judged(said.word(at)) or unjudged) and phrase.mention is not None:
        mention = replace(phrase.mention, modifiers=(*phrase.mention.modifiers, said.word(at)))
        return _ended(said, replace(phrase, mention=mention), at + 1)
    if (outer := said.match(_OUTER, at)) is not None and (
        link or "st" in outer[0].group().split()[0] + outer[0].group().split()[1]
    ):
        return _ended(said, _of_one(replace(phrase, side=_SIDES[outer[0].group("side")])), outer[1])
    if (person := said.match(_PERSON, at)) is not None and (link or person[0].group("how").endswith("st")):
        side = "far" if person[0].group("how").startswith("f") else "near"
        mine = person[0].group("who") in ("me", "us", "myself") or person[0].group("who").startswith("where")
        return _ended(said, _of_one(replace(phrase, side=side if mine else f"robot {side}")), person[1])
    most = said.match(_SUPERLATIVE, at)
    if (
        most is not None
        and (link or most[0].group("how").endswith("st"))
        and (landmark := phrase_at(most[1])) is not None
        and landmark.kind == "objects"
    ):
        relation = "farthest" if most[0].group("how").startswith("f") else "nearest"
        return _ended(said, _of_one(replace(phrase, relation=relation, landmark=landmark)), landmark.end)
    if link is None:
        return phrase
    if (side := said.match(_SIDE, at)) is not None:
        return _ended(said, replace(phrase, side=_SIDES[side[0].group("side")]), side[1])
    if (away := said.match(_AWAY, at)) is not None:
        return _ended(
            said, _of_one(replace(phrase, side="far" if away[0].group("how").startswith("f") else "near")), away[1]
        )
    stands = said.match(_STANDS, at)
    if stands is not None and (landmark := phrase_at(stands[1])) is not None and landmark.kind == "objects":
        side = stands[0].group("side")
        relation = f"{side} of" if side else _RELATIONS[stands[0].group("other")]
        return _ended(said, replace(phrase, relation=relation, landmark=landmark), landmark.end)
    return phrase


def _judged(word: str) -> bool:
    """Return whether a scene knows which objects an adjective fits; what it cannot judge must not be passed over."""
    return word in COLOR_WORDS or word in SUPERLATIVES or word in MEASURES


def _of_one(phrase: NounPhrase) -> NounPhrase:
    """Say that a number of objects is meant even if the noun stands alone: "the cups nearest to me" are a group still."""
    return replace(phrase, compared=True)


def _ended(said: Words, phrase: NounPhrase, end: int) -> NounPhrase:
    return replace(phrase, end=end, text=said.quote(phrase.first, end))

"""Read what asks for care and nothing else: "mind the drill", "without knocking over the cups", "don't let it fall".

That nothing is dropped or knocked over holds for every goal, so that the objects of such a phrase are only mentioned.
"""

from __future__ import annotations

import re

from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.tokens import Words

_HARM = (
    r"(?:drop|break|spill|damage|scratch|dent|harm|smash|crack|chip|crush|squash|bruise|hurt|topple|ruin|lose"
    r"|(?:knock|tip|push|kick|fall)(?: over| down| off| into)?|(?:bump|run|crash|bang|smash) into|bump|hit)"
)
_HARMING = (
    r"(?:dropping|breaking|spilling|damaging|scratching|denting|harming|smashing|cracking|chipping|crushing|squashing|bruising|hurting"
    r"|toppling|ruining|losing|(?:knocking|tipping|pushing|kicking)(?: over| down| off| into)?|(?:bumping|running|crashing|banging|smashing) into"
    r"|bumping|hitting|tripping over)"
)
_WITH_OBJECT = re.compile(
    rf"(?:(?:,|and|but|while|by) )*(?:without (?:ever )?{_HARMING}"
    rf"|(?:(?:please|just) )*(?:do not|don't|dont|never|try not to|be careful not to|careful not to|take care not to|mind you don't|so as not to"
    rf"|make sure (?:not to|that you don't|you don't|that you do not|you do not)|making sure not to|taking care not to|being careful not to|not) {_HARM}"
    rf"|(?:so (?:that )?(?:it|they|nothing|none of them)|that|which) (?:don't|doesn't|do not|does not|won't|can't|cannot) (?:touch|{_HARM}|collide with|get in the way of|block)"
    r"|mind|(?:be )?mindful of|watch(?: out)?(?: for)?|look out for|beware of|be careful with|be gentle with|careful with|gentle with"
    r"|take (?:good )?care (?:of|with)|go easy on|be careful around|careful around)(?= )"
)
_FALLING = re.compile(
    r"(?:(?:,|and|but) )*(?:do not|don't|never) let (?P<who>it|them|anything|any of them|the \w+|my \w+) (?:fall|roll|tip|slip|drop|break|spill|topple|slide)"
    r"(?: over| off| down| away| out)?(?: the (?:table|edge|desk))?(?= |$)"
)
_STAYING = re.compile(
    r"(?:, )?(?:which|that|who) (?:should|must|is to|are to|has to|have to|can|may|will|needs? to)? ?(?:just |please )*(?:stays?|remains?|be left|is left|are left|isn't moved|is not moved)"
    r"(?: (?:put|where (?:it|they) (?:is|are|was|were)(?: now)?|there|here|in (?:its|their) place|in place|untouched|alone|as (?:it|they) (?:is|are)))?(?= [.,;!?]| and| but|$)"
)
_ANYTHING = frozenset("anything anyone everything something stuff others".split())


def care_end(said: Words, place: int, phrases: NounPhraseReader) -> int | None:
    """Return the place after a phrase that asks for care, with its objects; `None` where none begins."""
    if (falling := said.match(_FALLING, place)) is not None:
        return falling[1]
    if (staying := said.match(_STAYING, place)) is not None and place and phrases.said.word(place - 1) not in (".", "so"):
        return staying[1]
    match = said.match(_WITH_OBJECT, place)
    if match is None or said.word(place - 1) in ("i", "we", "you", "they", "never"):
        return None
    end = _objects_end(said, match[1], phrases)
    return None if end is None or said.word(end) in ("on", "onto", "in", "into", "next", "left") else end


def _objects_end(said: Words, place: int, phrases: NounPhraseReader) -> int | None:
    if said.word(place) in _ANYTHING:
        return place + 1 + (said.word(place + 1) == "else")
    phrase = phrases.at(place)
    if phrase is None:
        return None
    joint = said.word(phrase.end) in ("and", "or")
    more = phrases.at(phrase.end + 1) if joint else None
    return phrase.end if more is None or said.word(more.end) not in ("", ".", ",", "!") else more.end

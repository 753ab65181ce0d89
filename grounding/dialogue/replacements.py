"""Find replacements of objects, as in "replace the banana with the cube", and requests that are impossible for single
objects.

"Swap the mug and the bowl" looks like a replacement, and asks for something else.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from grounding.references.pattern_parts import COUNT
from grounding.references.phrases import ANY, Mention
from grounding.structure_words import STRUCTURES

# What cannot be done to objects -> what is said of it, after the words that ask for it.
IMPOSSIBLE: Mapping[str, str] = {
    "places": "{!r} asks for other places of single objects, and these cannot be exchanged yet; nothing "
    "was changed. To "
    "have one object instead of another, say 'replace the mug with the bowl'",
    "apart": "{!r} places single objects, and only the whole structure can be placed; nothing was changed. "
    "Say a shape, "
    "a size, a position or a rotation of the structure, or which objects take part",
    "which": "{!r} does not say which objects are meant; nothing was changed. Name them, as in 'add the "
    "mug', 'without "
    "the mug' or 'replace the mug with the bowl'",
}
# Verbs that fit the structure as a whole; for some of its objects alone they cannot be carried out.
PLACING = re.compile(
    r"\b(?:move|shift|slide|push|pull|turn|rotate|spin|swivel|twist|flip|nudge|scoot|drag|point)\b"
    r"|\bthe other way (?:a)?round\b"
)
_WHICH = re.compile(
    rf"\b(?:fewer|less|more|some(?: more)?|a few(?: more)?|several|{COUNT}(?: more)?) "
    r"(?:objects|things|items|of (?:them|these|those))\b(?! (?:like|that|which|you))"
    rf"|\b(?:add|remove|drop|lose|include|take away|take out|use)(?: just| only)? (?:{COUNT}|some|another|a few)"
    r"(?: more| less| fewer| of (?:them|these|those))?$"
    r"|\b(?:remove|drop|clear|delete) (?:everything|all(?: of (?:them|it))?|them(?: all)?|it all)$|^none(?: "
    r"of (?:them|these))?$"
    r"|^(?:replace|exchange|substitute) (?:it|them|everything|all of them|this|that)$"
)
_LONE = re.compile(
    r"(?:please |can you |could you |now )*(?:replace|swap|switch|exchange|change|substitute)(?: out)?(?: the| my| a)?"
)
# What follows an object that is to have a place of its own.
_PLACE_OF_ITS_OWN = (
    r"^(?: (?:goes?|comes?|should|must|be|is|are|to|as|the))* (?:first|last|on top|(?:on the )?(?:outside|inside)"
    r"|at (?:the|one|either|each|both)(?: left| right| very)? (?:ends?|start|beginning))\b(?! of the "
    r"(?:table|desk))"
)
_OWN_PLACE = re.compile(_PLACE_OF_ITS_OWN)
_OWN_PLACE_IN_A_STACK = re.compile(
    _PLACE_OF_ITS_OWN + r"|^(?: (?:goes?|should|must|be|is|are))* (?:at the (?:bottom|top)|in the middle|in between)\b"
    r"(?! of the (?:table|desk))"
)
_WITH_ONE_PLACED = re.compile(
    r"\bwith .+ (?:in the (?:middle|cent(?:er|re))|next to|beside|between)\b(?! of the (?:table|desk))"
)
_AGAIN = re.compile(r"\b(?:same|again|instead)\b")
_BEFORE_A_LANDMARK = re.compile(
    r"\b(?:(?:closer|nearer|near|next|close|opposite)(?: to)?|(?:away|far|further) from"
    r"|(?:left|right|in front|on top) of|behind|beside|above|below|around) the $"
)
_SWAPPING = r"(?:swap|switch|exchange|interchange|trade|transpose)"
_PLACES = re.compile(
    rf"\b(?:{_SWAPPING}|change|reverse|flip|invert)(?: (?:the|their|its|those|these|them|both))*(?: two)? "
    rf"(?:places?|positions?|spots?|seats?|order)\b"
    rf"|\b{_SWAPPING}(?: (?:them|these|those|both|the two|these two|those two))(?: (?:of them|around|round"
    rf"|over|please))*$"
    rf"|\b{_SWAPPING}(?: \w+){{0,2}} (?:\d+|number \w+) (?:and|with) (?:\w+ ){{0,2}}\d+"
    rf"|\b{_SWAPPING}(?: the)? (?:first|second|third|fourth|last|left(?:most)?|right(?:most)?|middle)(?: "
    rf"\w+)? (?:and|with)\b"
    r"|\bwhere (?:the|my|your) (?:\w+ ){1,3}(?:is|are|was|were|stands?|stood)\b"
)
_SWAP = re.compile(rf"\b{_SWAPPING}\b(?! (?:it|them|these|those|that|this) (?:for|to|into|with)\b)")
_WITH_VERB = re.compile(
    r"\b(?P<verb>replace|swap|switch|exchange|trade|change|substitute|turn)(?:ing)?(?: out)? (?P<one>.+?) "
    r"(?P<link>for|with|by|to|into|against) (?P<other>.+)"
)
_REPLACED = re.compile(
    r"(?P<one>.+?) (?:be|is|are|gets?) (?:replaced|swapped|exchanged|substituted|traded)(?: out)? (?:by"
    r"|with|for) (?P<other>.+)"
)
_INSTEAD = re.compile(
    r"\b(?:instead of|rather than|in place of|in lieu of|in exchange for)\b|(?<=\brather )(?:.+ )than\b"
)
_DENIED = re.compile(r"^(?:no ,? ?|sorry ,? ?|wait ,? ?|actually ,? ?)*not\b")
_PRONOUNS = re.compile(r"^(?:it|them|these|those|that|this|everything|all of them)\b")


def impossible(clause: str, named: Sequence[Mention], shape: str | None) -> str:
    """Find why the clause asks for what cannot be done with objects, a key of `IMPOSSIBLE`; empty where it does not."""
    if _PLACES.search(clause):
        return "places"
    if _WHICH.search(clause) and all(m.noun == ANY for m in named):
        return "which"
    if len(named) == 1 and not named[0].plural and _LONE.fullmatch(clause[: named[0].span[0]].strip()):
        if not clause[named[0].span[1] :].strip(" ,"):
            return "which"  # "replace the banana": with what?
    verb = _SWAP.search(clause)
    if verb and named and not re.search(r"\b(?:for|with|by|to|into|against|out)\b", clause[verb.end() :]):
        return "places"
    exchange = _WITH_VERB.search(clause)
    if exchange and exchange["verb"] not in ("change", "turn", "switch") and exchange["link"] in ("for", "with", "by"):
        if bool(_within(exchange, "one", named)) and not _within(exchange, "other", named):
            return "which"  # "replace the cups with unicorns"
    stacked = shape is not None and STRUCTURES[shape].stacked
    own = _OWN_PLACE_IN_A_STACK if stacked else _OWN_PLACE
    if any(own.search(clause[m.span[1] :]) or _BEFORE_A_LANDMARK.search(clause[: m.span[0]]) for m in named):
        return "apart"
    if named and _WITH_ONE_PLACED.search(clause) and not _AGAIN.search(clause):
        return "apart"
    return "apart" if named and re.search(r"\b(?:start|begin|end|finish) with\b", clause) else ""


def goes_and_comes(clause: str, named: Sequence[Mention]) -> tuple[list[Mention], list[Mention], str] | None:
    """Find (what goes, what comes, "exchange" or "swap") where the clause exchanges objects for others.

    Nothing goes in particular where "them" are replaced. "swap" is what may ask for an exchange of places.
    """
    if verb := _WITH_VERB.search(clause):
        first, second = _within(verb, "one", named), _within(verb, "other", named)
        if first and second:
            if (verb["verb"], verb["link"]) == ("substitute", "for"):
                first, second = second, first
            places = verb["link"] in ("with", "against") and verb["verb"] in ("swap", "switch", "exchange", "trade")
            return first, second, "swap" if places else "exchange"
        if second and _PRONOUNS.match(verb["one"]):
            return [], second, "exchange"
    if verb := _REPLACED.search(clause):
        first, second = _within(verb, "one", named), _within(verb, "other", named)
        if first and second:
            return first, second, "exchange"
    if instead := _INSTEAD.search(clause):
        before = [m for m in named if m.span[1] <= instead.end()]
        after = [m for m in named if m.span[0] >= instead.end()]
        if before and after:
            return after, before, "exchange"
        if len(after) > 1:  # "instead of the banana, take the cube"
            end = next((i for i in range(1, len(after)) if not _joined(clause, after[i - 1], after[i])), None)
            if end is not None:
                return after[:end], after[end:], "exchange"
    left_out = [m for m in named if m.role == "left out"]
    others = [m for m in named if m.role != "left out"]
    if left_out and others:
        if _DENIED.search(clause) and left_out[0] is named[0]:  # "not the banana, the cube"
            return left_out, others, "exchange"
        kinds = {m.noun for m in others}
        denied = all(re.search(r"\bnot (?:the )?$", clause[: m.span[0]]) for m in left_out[:1])
        if denied and not any(m.noun in kinds or m.noun == "object" for m in left_out):
            return left_out, others, "exchange"  # "the cube, not the banana"
    return None


def _within(match: re.Match[str], group: str, named: Sequence[Mention]) -> list[Mention]:
    return [m for m in named if match.start(group) <= m.span[0] and m.span[1] <= match.end(group)]


def _joined(clause: str, one: Mention, other: Mention) -> bool:
    between = clause[one.span[1] : other.span[0]].split()
    return bool(between) and set(between) <= {"and", "or", "the", "a", "an"}

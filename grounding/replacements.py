"""One object for another: "replace the banana with the cube", and what only looks like it: "swap the mug and the bowl"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.phrases import Mention

PLACES = (
    "the places of single objects cannot be exchanged yet, so nothing was changed; to have one object instead of "
    "another, say 'replace the mug with the bowl'"
)
_SWAPPING = r"(?:swap|switch|exchange|interchange|trade|transpose)"
_PLACES = re.compile(
    rf"\b(?:{_SWAPPING}|change|reverse)(?: (?:the|their|its|those|these|them|both))*(?: two)? (?:places?|positions?|spots?|seats?|order)\b"
    rf"|\b{_SWAPPING}(?: (?:them|these|those|both|the two|these two|those two))(?: (?:of them|around|round|over|please))*$"
    rf"|\b{_SWAPPING}(?: \w+){{0,2}} (?:\d+|number \w+) (?:and|with) (?:\w+ ){{0,2}}\d+"
    rf"|\b{_SWAPPING}(?: the)? (?:first|second|third|fourth|last|left(?:most)?|right(?:most)?|middle)(?: \w+)? (?:and|with)\b"
    r"|\bwhere (?:the|my|your) (?:\w+ ){1,3}(?:is|are|was|were|stands?|stood)\b"
)
_SWAP = re.compile(rf"\b{_SWAPPING}\b(?! (?:it|them|these|those|that|this) (?:for|to|into|with)\b)")
_WITH_VERB = re.compile(
    r"\b(?P<verb>replace|swap|switch|exchange|trade|change|substitute|turn)(?:ing)?(?: out)? (?P<one>.+?) "
    r"(?P<link>for|with|by|to|into|against) (?P<other>.+)"
)
_REPLACED = re.compile(
    r"(?P<one>.+?) (?:be|is|are|gets?) (?:replaced|swapped|exchanged|substituted|traded)(?: out)? (?:by|with|for) (?P<other>.+)"
)
_INSTEAD = re.compile(
    r"\b(?:instead of|rather than|in place of|in lieu of|in exchange for)\b|(?<=\brather )(?:.+ )than\b"
)
_DENIED = re.compile(r"^(?:no ,? ?|sorry ,? ?|wait ,? ?|actually ,? ?)*not\b")
_PRONOUNS = re.compile(r"^(?:it|them|these|those|that|this|everything|all of them)\b")


def swapped_places(clause: str, named: Sequence[Mention]) -> bool:
    """Whether the clause asks single objects to exchange their places."""
    if _PLACES.search(clause):
        return True
    verb = _SWAP.search(clause)
    if verb is None or not named:
        return False
    after = clause[verb.end() :]
    return re.search(r"\b(?:for|with|by|to|into|against)\b", after) is None and re.search(r"\bout\b", after) is None


def goes_and_comes(clause: str, named: Sequence[Mention]) -> tuple[list[Mention], list[Mention], str] | None:
    """(what goes, what comes, "exchange" or "swap") where the clause exchanges objects for others.

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

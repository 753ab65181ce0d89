"""Read what stands behind the noun of a copied phrase: places, relations, uses, parts, groups and exceptions."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.resolve.adjectives import property_of
from grounding.resolve.comparisons import comparison_after
from grounding.resolve.lexicon import FILLINGS
from grounding.resolve.phrase import Draft, Phrase, Rank, Test
from grounding.resolve.phrase_text import PhraseReader
from grounding.resolve.place_words import idle_place
from grounding.resolve.predicates import predicate_after, use_after
from grounding.resolve.standing import standing_after
from grounding.resolve.word_forms import singular

_PERSONS = frozenset("you i we one people they someone he she folks".split())
_ABLE = frozenset("can could might may would normally usually will should must".split())
_FOR = frozenset("that which used made meant for to what".split())
_KINDS = frozenset("kind colour variety type sort".split())
_AFTER_COLOUR = _KINDS | {"", "that", "with", "in", "on"}
_IDLE = frozenset("only alone instead itself too please though".split())


def clauses_after(parser: PhraseReader, draft: Draft, at: int, excepting: bool) -> int:
    """Read everything that belongs to a phrase behind its noun, into a draft.

    Args:
        parser: of the phrase.
        draft: of the phrase.
        at: the place behind its noun.
        excepting: whether something may be left out.

    Returns:
        The place after it.
    """
    readers = [_of, _part, _for_use, predicate_after, comparison_after, standing_after]
    readers = [exception_after, *readers] if excepting else readers
    while at < len(parser.words):
        end = idle_place(parser.words, at)
        if end == at:
            end = next((after for read in readers if (after := read(parser, draft, at)) is not None), at)
        if end <= at and parser.word(at) in _IDLE:
            end = at + 1
        if end <= at:
            return at
        at = end
    return at


def _of(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read "of the two cans", "among the mugs", "of red colour", "in red"."""
    word = parser.word(at)
    if word not in ("of", "among", "amongst", "out", "in"):
        return None
    first = at + 1 + (parser.word(at + 1) == "of")
    place = first + (parser.word(first) in ("the", "a", "any"))
    colours = parser.text.colours_at(place)
    if colours is not None and parser.word(colours[1]) in _AFTER_COLOUR and not (word == "of" and draft.bare):
        draft.test(*colours[0])
        return colours[1] + (parser.word(colours[1]) in _KINDS)
    if word == "of" and singular(parser.word(first)) in FILLINGS and draft.noun:
        draft.test(Test("word", parser.word(first)))  # "the box of crackers"
        return first + 1
    if " ".join(parser.words[place : place + 2]) in ("every colour", "all colours", "each colour", "every kind"):
        return place + 2
    if parser.word(place) in ("mine", "yours", "ours"):
        return place + 1
    group = parser.at(first) if word != "in" else None
    if group is None:
        return None
    if group[0].kind not in ("pronoun", "all"):
        draft.among = _of_noun(group[0], draft)
    return group[1]


def _of_noun(group: Phrase, draft: Draft) -> Phrase:
    """Give "of the three" the noun of its phrase: "the biggest cube of the three"."""
    if not (draft.noun and group.bare and group.count) or group.tests or group.rank is not None or group.other:
        return group
    return replace(group, noun=draft.noun, bare=False, borrowed=False, plural=True)


def _for_use(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read "you drink from", "for drinking", "to write with", "used for driving nails"."""
    place = at
    while parser.word(place) in _FOR:
        place += 1
    person = parser.word(place) in _PERSONS
    place += person
    while person and parser.word(place) in _ABLE:
        place += 1
    return use_after(parser, draft, place) if place > at else None


_HAVING = re.compile(
    r"(?:(?:that |which )?(?:with|having|has|have)|made (?:out )?(?:of|from))(?: (?:a|an|the|some))?(?= )"
)


def _part(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read a part, a material, or what something holds: "with spouts", "made of fish", "with the milk"."""
    found = _HAVING.match(" ".join(parser.words[at:]))
    place = at + len(found.group().split()) if found is not None else at
    word = parser.word(place)
    kind = "property" if property_of(word) is not None else "word" if parser.text.there.filling(word) else ""
    if found is None or not kind:
        return None
    draft.test(Test(kind, word))
    return place + 1


_EXCEPT = re.compile(
    r"(?:, |and )?(?:except for|except|apart from|other than|aside from|with the exception of|excluding|excepting|"
    r"barring|bar|save for|save|without|minus|but for|but not|but|and not|not including|not|besides|less)(?= )"
)


def exception_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read an exception into a draft; return the place after it, or `None` where none stands."""
    found = _EXCEPT.match(" ".join(parser.words[at:]))
    if found is None:
        return None
    place = at + len(found.group().split())
    if parser.word(place) == "one" and draft.rank is not None and parser.word(place - 1) == "but":
        draft.rank = Rank(draft.rank.by, draft.rank.place + 1)  # "the highest but one"
        return place + 1
    without: list[Phrase] = []
    while (other := parser.at(place, excepting=False)) is not None:
        any_one = found.group().rstrip().endswith("not") and not other[0].definite  # "anything not a cube"
        without.append(replace(other[0], plural=True, every=True, definite=True, count=None) if any_one else other[0])
        place = other[1]
        joint = place + 1 + (parser.word(place + 1) == "not")
        if parser.word(place) not in ("and", ",", "or", "nor") or parser.at(joint) is None:
            break
        place = joint
    if not without or not _says_which(without[0]):
        return None  # "all cups but one"
    draft.without += without
    draft.plural = True if draft.plural is None else draft.plural
    return place


def _says_which(phrase: Phrase) -> bool:
    return bool(
        phrase.noun or phrase.tests or phrase.rank is not None or phrase.kind != "objects" or phrase.among is not None
    )

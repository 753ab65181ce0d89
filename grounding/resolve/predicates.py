"""Read the clause that says what the objects of a copied phrase are: "that is red and round", "which aren't fruit"."""

from __future__ import annotations

from dataclasses import replace

from grounding.resolve.adjectives import colours_of, property_of, size_of, use_of
from grounding.resolve.comparisons import comparison_at
from grounding.resolve.phrase import Draft, Phrase, Rank, Test
from grounding.resolve.phrase_text import PhraseReader
from grounding.resolve.place_words import SIDES
from grounding.resolve.standing import standing_after, standing_at

_LINKS = frozenset("that which who what as".split())
_IS = frozenset("is are was were be being looks look stands stand sits sit lies lie rests rest".split())
_FILLING = frozenset(
    "called named lying standing sitting very really currently already either both also itself".split()
)
_JOINTS = frozenset(("and", "or", "nor", ",", "but", "yet"))


def predicate_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read a clause into a draft; return the place after it, or `None` where none stands here or is not understood."""
    place = at
    linked = parser.word(place) in _LINKS
    place += linked
    if parser.word(place) in ("does", "do") and parser.word(place + 1) == "not":
        return use_after(parser, draft, place + 2, True)
    if parser.word(place) not in _IS:
        if (
            linked
            and parser.word(place) in ("share", "shares", "has", "have")
            and parser.words[place + 1 : place + 3] == ("the", "colour")
        ):
            return _list(parser, draft, place + 3, False)
        free = linked or (draft.open and parser.word(at - 1) in ("what", "whatever"))
        return use_after(parser, draft, place) if free else None
    if not linked and not _bare_clause(draft):
        return None
    stands = parser.word(place) not in ("is", "are", "was", "were", "be", "looks", "look")
    place += 1
    negated = parser.word(place) in ("not", "neither", "no")
    place += negated
    if stands:
        return standing_after(parser, draft, place)
    return _list(parser, draft, place, negated)


def _bare_clause(draft: Draft) -> bool:
    """Return whether a clause may begin without "that": "whatever | is red", "whichever cup | is nearest"."""
    return not draft.noun or draft.plural is not True


def use_after(parser: PhraseReader, draft: Draft, at: int, negated: bool = False) -> int | None:
    """Read "writes", "rolls on four wheels", "drink from" into a draft; return the place after it, or `None`."""
    for end in range(len(parser.words), at, -1):
        kinds = use_of(" ".join(parser.words[at:end]))
        if kinds is not None:
            draft.test(Test("use", " ".join(kinds), negated=negated))
            return end
    return None


def _list(parser: PhraseReader, draft: Draft, at: int, negated: bool) -> int | None:
    """Read what the objects are, or are not: adjectives, kinds and places, joined by "and" or "or"."""
    found: list[Test | Phrase] = []
    joints: set[str] = set()
    place = at
    ranked = False
    while (read := _predicate(parser, place)) is not None:
        one, place = read
        if isinstance(one, Rank):
            draft.rank, ranked = one, True
        else:
            found.append(one)
        joint = place
        while parser.word(joint) in _JOINTS or (joint > place and parser.word(joint) in ("is", "are")):
            joint += 1
        inner = joint > place and parser.word(joint) == "not"
        if joint == place or _predicate(parser, joint + inner) is None:
            break
        joints.update(parser.words[place:joint])
        if inner or (negated and "but" in parser.words[place:joint]):
            _add(draft, found, joints, negated)
            found, joints, negated = [], set(), inner
        place = joint + inner
    if not found and not ranked:
        return None
    _add(draft, found, joints, negated)
    return place


def _add(draft: Draft, found: list[Test | Phrase], joints: set[str], negated: bool) -> None:
    """Add what a clause says: "red or blue" are alternatives, "tall and red" are both meant."""
    tests = [one if isinstance(one, Test) else Test("kind", other=one) for one in found]
    if negated:
        for test in tests:
            draft.test(replace(test, negated=True))
    elif "or" in joints or all(test.kind == "colour" for test in tests) or all(test.kind == "kind" for test in tests):
        if tests:
            draft.test(*tests)
    else:
        for test in tests:
            draft.test(test)


def _predicate(parser: PhraseReader, at: int) -> tuple[Test | Phrase | Rank, int] | None:
    """Read one thing that objects can be."""
    following = parser.word(at + 1)
    article = parser.word(at) in ("a", "an", "the") and bool(
        colours_of(following) or size_of(following) or following in SIDES
    )
    place = at + article
    while parser.word(place) in _FILLING or parser.words[place : place + 2] == ("in", "colour"):
        place += 1
    if not parser.word(place):
        return None
    kind = article and parser.text.there.is_noun(parser.word(place + 1))
    found = None if kind else _quality(parser, place)
    found = found or comparison_at(parser, place) or standing_at(parser, place)
    if found is not None:
        return found
    phrase = parser.at(place)
    return phrase if phrase is not None and phrase[0].noun and phrase[0].kind == "objects" else None


def _quality(parser: PhraseReader, place: int) -> tuple[Test | Rank, int] | None:
    """Read a colour, a size or a property."""
    word, following = parser.word(place), parser.word(place + 1)
    if colours_of(word) is not None:
        return Test("colour", word), place + 1 + (following in ("one", "ones", "coloured"))
    size, known = size_of(word), property_of(word)
    if size is not None and known is None and following != "than":
        return (Rank(size[0]) if size[1] else Test("size", size[0])), place + 1
    if word == "made" and property_of(parser.word(place + 2)) is not None:
        return Test("property", parser.word(place + 2)), place + 3
    if known is not None and (size is not None or not parser.text.there.is_noun(following)):
        return Test("property", word), place + 1
    return None

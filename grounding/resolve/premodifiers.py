"""Read the adjectives before the noun of a copied phrase."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from grounding.resolve.adjectives import COLOURFUL, IDLE, MIDDLE, MIDDLING, colours_of, property_of, size_of, use_of
from grounding.resolve.determiners import PIECES
from grounding.resolve.function_words import ORDINALS
from grounding.resolve.lexicon import GENERAL, GROUPS
from grounding.resolve.measures import COUNTS
from grounding.resolve.phrase import Draft, Rank, Test
from grounding.resolve.phrase_text import JOINTS, PhraseText
from grounding.resolve.place_words import SIDES
from grounding.resolve.word_forms import singular

# What stands after a use: "writing tools", "drinking vessels".
USED = frozenset(
    "thing things tool tools utensil utensils implement implements iron irons gear vessel vessels dish dishes stuff "
    "item items one ones kit object objects instrument instruments".split()
)
_OTHER = frozenset("other remaining leftover".split())


def adjectives_at(text: PhraseText, at: int, draft: Draft) -> int:
    """Read the words before the noun into a draft; return the place after them."""
    start = at
    while (after := _adjective(text, at, draft, at > start)) is not None:
        at = after
    return at


def _adjective(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    word = text.word(at)
    if not word or f"{word} {singular(text.word(at + 1))}" in GROUPS:  # "hand tools"
        return None
    readers: tuple[Callable[[PhraseText, int, Draft, bool], int | None], ...] = (
        _denied, _colourful, _order, _place, _quality, _described,
    )  # fmt: skip
    return next((end for read in readers if (end := read(text, at, draft, later)) is not None), None)


def _denied(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read what the objects are not: "non-white"."""
    colours = text.colours_at(at + 1) if text.word(at) == "non" else None
    if colours is None:
        return None
    for colour in colours[0]:
        draft.test(replace(colour, negated=True))
    end = colours[1]
    return end + (text.word(end) in (",", "and") and text.word(end + 1) == "non")  # "non-red, non-blue"


def _colourful(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read "coloured" before a noun, where no colour is named."""
    if text.word(at) not in COLOURFUL or draft.tests or not text.noun_at(at + 1):
        return None
    draft.test(Test("property", text.word(at)))
    return at + 1


def _order(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read "other", "third piece of", or a number after adjectives: "the largest two"."""
    word, following = text.word(at), text.word(at + 1)
    if word in _OTHER and not (word == "remaining" and following == "in"):
        draft.other = True
        return at + 1
    if word in PIECES and following == "of":
        return at + 2
    if word == "last" and draft.every:
        return at + 1  # "every last cup"
    if word in ORDINALS and (following or word in ("last", "first", "second", "third")):
        draft.place = ORDINALS[word]
        return at + 1
    number = COUNTS.get(word)
    if number is not None and later and word not in ("one", "a") and draft.count is None:
        draft.count = number
        return at + 1
    return None


def _place(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read "far left"."""
    word = text.word(at)
    if word in ("very", "most") and text.word(at + 1) in SIDES:
        return at + 1
    if word in SIDES and not text.in_clause(at):
        draft.sides.append(SIDES[word])
        return at + 1
    return None


def _quality(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read a use, a colour, a size or a property."""
    word, following = text.word(at), text.word(at + 1)
    if following in USED and word.endswith(("ing", "s")):
        kinds = use_of(word) or use_of(f"{word} {following}")
        if kinds:
            draft.test(Test("use", " ".join(kinds)))
            draft.used = True
            return at + 1
    if (colours := text.colours_at(at)) is not None:
        draft.test(*colours[0])
        return colours[1]
    if word in ("coloured", "colour") and draft.tests:
        return at + 1
    if (end := _size(text, at, draft)) is not None:
        return end
    if word in ("and", ",") and later and (property_of(following) or size_of(following)):
        return at + 1
    if property_of(word) is not None and _followed(text, at):
        draft.test(Test("property", word))
        return at + 1
    return None


def _size(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read "large", "largest", "more large" or "medium"."""
    word = text.word(at)
    more = word in ("more", "most") and size_of(text.word(at + 1)) is not None
    size = size_of(text.word(at + more))
    if size is None or property_of(text.word(at + more)) is not None:
        if word not in MIDDLING:
            return None
        draft.test(Test("size", MIDDLE))
        return at + 1 + (text.word(at + 1) in ("size", "sized"))
    degree = word if more else size[1]
    if degree == "most":
        draft.rank, draft.place = Rank(size[0], draft.place or 1), None
    else:
        draft.test(Test("size", size[0], value=1.0 if degree else 0.0))
    return at + 1 + more


def _followed(text: PhraseText, at: int) -> bool:
    """Return whether a noun follows the word at a place, or an adjective: "glass | jar", "round | green one"."""
    following = text.word(at + 1)
    if text.noun_at(at + 1) or colours_of(following) is not None or size_of(following) is not None:
        return True
    return property_of(following) is not None and text.noun_at(at + 2)


def _described(text: PhraseText, at: int, draft: Draft, later: bool) -> int | None:
    """Read a word that says nothing, an occasion, "desk items", or one that only names can tell: "tuna can"."""
    word, following = text.word(at), text.word(at + 1)
    if word in IDLE and following:
        return at + 1
    if following in GENERAL and text.there.of_occasion(word) is not None:
        draft.test(Test("occasion", word))
        return at + 1
    specific = text.noun_at(at + 1) and following not in GENERAL
    if word in GENERAL:
        return at + 1 if specific and following not in ("one", "ones") else None  # "specimen jars"
    known = text.here(at) or word in GENERAL or word in JOINTS or word in SIDES or word in COUNTS
    strange = word.isalpha() and not known
    coloured = colours_of(following) is not None or size_of(following) is not None
    if text.here(at) and text.here(at + 1) and not text.there.compound(word, following):
        return None  # "fork knife spoon" are three
    if (strange and coloured and text.noun_at(at + 2)) or (
        specific and (text.there.is_noun(word) or word not in JOINTS)
    ):
        draft.test(Test("word", word))
        return at + 1
    return None

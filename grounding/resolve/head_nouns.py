"""Read the noun of a copied phrase, and the adjectives behind it: "cups blue", "can (red)"."""

from __future__ import annotations

from grounding.resolve.adjectives import colours_of, property_of, size_of
from grounding.resolve.lexicon import GENERAL, GROUPS
from grounding.resolve.measures import COUNTS
from grounding.resolve.phrase import Draft, Rank, Test
from grounding.resolve.phrase_text import PhraseText
from grounding.resolve.place_words import SIDES
from grounding.resolve.premodifiers import USED
from grounding.resolve.word_forms import singular

_UNNAMED = GENERAL | frozenset("everything anything something".split())
_MASSES = frozenset("stuff lot kit gear shopping collection assortment set".split())
_GROUPS = frozenset("pair half team trio".split())
_IDLE = frozenset("( ) number only alone coloured together colour please".split())
# "right in front of me": before these words it is no side.
_JUST = frozenset("in on at by behind beside next before".split())
COMPARED = frozenset("closest nearest furthest nearer closer further".split())


def head_at(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read the noun into a draft; return the place after it, or `None` where none stands."""
    return _pronoun(text, at, draft) or _noun(text, at, draft)


def _pronoun(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read "one", "others" or "blues"; return the place after it."""
    word = text.word(at)
    if word in ("one", "ones"):
        draft.borrowed, draft.plural = True, draft.plural or word == "ones"
        return at + 1
    if word == "others":
        draft.borrowed = draft.plural = draft.other = True
        return at + 1
    if not _colours(text, at):
        return None
    colours = [Test("colour", word[:-1])]
    while text.word(at + 1) in ("and", ",") and _colours(text, at + 2):
        colours.append(Test("colour", text.word(at + 2)[:-1]))
        at += 2
    draft.test(*colours)
    draft.borrowed = draft.plural = True
    return at + 1


def _colours(text: PhraseText, at: int) -> bool:
    """Return whether a colour in the plural stands at a place: "the blues"; oranges may be fruit."""
    word = text.word(at)
    fruit = word == "oranges" and bool(text.there.of_kinds(("orange",)))
    return word.endswith("s") and colours_of(word[:-1]) is not None and not fruit


def _noun(text: PhraseText, at: int, draft: Draft) -> int | None:
    word, following = text.word(at), text.word(at + 1)
    compound = f"{word} {singular(following)}"
    if draft.used and word in USED:
        draft.plural = draft.plural or word.endswith("s")
    elif compound in GROUPS:
        draft.noun, draft.plural = (compound,), draft.plural or following.endswith("s")
        return at + 2
    elif word in GENERAL:
        draft.plural = draft.plural or word.endswith("s") or word in _MASSES
    elif word in _GROUPS and (draft.tests or word == "team" or (word in ("pair", "trio") and at > 0)):
        draft.borrowed = draft.plural = True
        draft.count = {"pair": 2, "trio": 3}.get(word, draft.count)
    elif text.there.is_noun(word) or text.there.filling(word):
        draft.noun = (word,)
        draft.plural = draft.plural or text.there.plural(word)
        if following in ("thing", "thingy"):
            return at + 2  # "the plate thing"
        if following in ("pair", "set", "collection", "trio"):
            draft.count, draft.plural = 2 if following == "pair" else draft.count, True
            return at + 2
    else:
        return None
    return at + 1


def behind_noun(text: PhraseText, at: int, draft: Draft) -> int:
    """Read adjectives behind the noun into a draft: "red right", "the blue three"; return the place after them."""
    while at < len(text.words):
        word = text.word(at)
        number = COUNTS.get(word) if word not in ("a", "one") else None
        colours = text.colours_at(at)
        sided = word in SIDES and word not in COMPARED and text.word(at + 1) not in ("to", "of", "from")
        sided = sided and not (word == "right" and text.word(at + 1) in _JUST)
        if colours is not None and not (draft.bare and text.word(at - 1) == "and"):
            draft.test(*colours[0])
            at = colours[1] - 1
        elif sided and not text.in_clause(at):
            draft.sides.append(SIDES[word])
            at += text.word(at + 1) in ("side", "hand")
            at += text.word(at) == "side" and text.word(at + 1) == "one"  # "white jar right side one"
        elif property_of(word) is not None and text.word(at - 1) in _UNNAMED and not text.noun_at(at + 1):
            draft.test(Test("property", word))  # "everything edible"
        elif (size := _plain_size(word)) is not None and text.word(at - 1) in _UNNAMED and not text.noun_at(at + 1):
            draft.test(Test("size", size))  # "everything tall"
        elif (chosen := _size_behind(text, at, draft)) is not None:
            at = chosen - 1
        elif word.isdecimal() and not draft.bare and (end := _numbers(text, at, draft)) is not None:
            at = end - 1
        elif number is not None and draft.count is None and draft.tests:
            draft.count = number
        elif word not in _IDLE and not (word in ("cups", "cup", "ones") and text.word(at - 1) == "team"):
            return at
        at += 1
    return at


def _plain_size(word: str) -> str | None:
    size = size_of(word)
    return size[0] if size is not None and not size[1] else None


def _numbers(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read the numbers of "cups 1 and 3"; return the place after them."""
    numbers = [Test("number", text.word(at)[:6])]
    at += 1
    while text.word(at) in ("and", ",") and text.word(at + 1).isdecimal() and not text.noun_at(at + 2):
        numbers.append(Test("number", text.word(at + 1)[:6]))
        at += 2
    draft.test(*numbers)
    draft.count, draft.plural = len(numbers), len(numbers) > 1
    return at


def _size_behind(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read a superlative behind the noun, "the thing highest", or a comparative at the end, "cylinder, the taller"."""
    at += text.word(at) == "the"
    size = size_of(text.word(at))
    last = text.word(at + 1) in ("", "and", "one")
    if size is None or not size[1] or not last or draft.rank is not None:
        return None
    if size[1] == "most":
        draft.rank = Rank(size[0])
    else:
        draft.test(Test("size", size[0], value=1.0))
    return at + 1 + (text.word(at + 1) == "one")

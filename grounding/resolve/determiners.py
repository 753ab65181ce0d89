"""Read what stands before the adjectives of a copied phrase: articles, numbers, "all of the", "the pair of"."""

from __future__ import annotations

from grounding.resolve.adjectives import IDLE, colours_of, property_of, size_of
from grounding.resolve.lexicon import GENERAL
from grounding.resolve.measures import COUNTS
from grounding.resolve.phrase import Draft
from grounding.resolve.phrase_text import PhraseText
from grounding.resolve.place_words import SIDES

OWNERS = frozenset("the my your our his her their its".split())
PIECES = frozenset("piece pieces bit bits item items roll bar stick sheet kind kinds".split())
_POINTING = frozenset("this that these those them such same".split())
_EVERY = {"both": 2, "all": None, "every": None, "each": None, "any": None, "either": 2, "neither": 2}
_FREE = ("any", "either")  # of one place of a relation: one, whichever it is
_ONLY = frozenset("only single lone sole lonely just".split())
_PORTIONS = {
    "pair": 2, "couple": 2, "trio": 3, "set": None, "bunch": None, "group": None, "collection": None, "lot": None,
}  # fmt: skip


def determiners_at(text: PhraseText, at: int, draft: Draft) -> int:
    """Read determiners and numbers into a draft; return the place after them."""
    while (after := _quantity(text, at, draft) or _determiner(text, at, draft)) is not None:
        at = after
    if draft.every and draft.count is not None and text.word(at) == "of":
        at += 1
    return at


def _determiner(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read an article, a demonstrative or "all"; return the place after it."""
    word, following = text.word(at), text.word(at + 1)
    if word in _POINTING:
        draft.demonstrative = True
        draft.plural = word in ("these", "those", "them", "such") or draft.plural
    elif word in _EVERY:
        number = word == "any" and (following in COUNTS or following.isdecimal())  # "any two cups"
        draft.every, draft.count = not number, draft.count or _EVERY[word]
        draft.definite = word not in _FREE
    elif word in ("a", "an"):
        draft.definite = False
    elif word in _ONLY:
        draft.count = draft.count or (1 if word != "just" and not draft.every else None)
    elif word == "of" and (draft.every or draft.demonstrative) and draft.count in (None, 2):
        pass  # "all of the cups"
    elif word not in OWNERS and not (word in IDLE and following):
        return None
    return at + 1


def _quantity(text: PhraseText, at: int, draft: Draft) -> int | None:
    """Read a number, "the pair of" or "a piece of"; return the place after it."""
    word, following = text.word(at), text.word(at + 1)
    if word == "one" and draft.count is None and _counts(text, at):
        draft.count = 1
        told = text.word(at - 1) in OWNERS or colours_of(following) is not None
        draft.definite = following != "of" and at > 0 and told
        return at + 1
    number = int(word) if word.isdecimal() else COUNTS.get(word)
    if number is not None and word not in ("one", "a", "an", "couple", "half") and draft.count in (None, number):
        draft.count = number
        draft.definite = draft.definite and (draft.every or draft.demonstrative or text.word(at - 1) in OWNERS)
        return at + 1
    if word == "half" and (following == "of" or following in OWNERS):
        draft.half = draft.plural = True
        return at + 1 + (following == "of")
    if following != "of":
        return None
    if word in _PORTIONS:
        draft.count = draft.count or _PORTIONS[word]
        draft.every = draft.definite = True
        return at + 2
    if word in PIECES and text.word(at + 2) not in ("the", "these", "those"):
        draft.plural = word.endswith("s") or draft.plural
        single = not word.endswith("s") and not draft.every and text.there.is_noun(text.word(at + 2))
        draft.count = 1 if single and draft.count is None else draft.count
        return at + 2
    return at + 2 if word == "top" else None


def _counts(text: PhraseText, at: int) -> bool:
    """Return whether "one" is a number here: "one red cup", "the one orange", and not "the one on the left"."""
    following = text.word(at + 1)
    said = colours_of(following) is not None or text.there.is_noun(following) or following in GENERAL
    if said or text.word(at - 1) in OWNERS or following == "of":
        return said or following == "of"
    telling = size_of(following) is not None or property_of(following) is not None
    return telling or (following in SIDES and text.noun_at(at + 2))

"""Correct the typing errors of single words, against the words that objects are named with."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from rapidfuzz import process
from rapidfuzz.distance import OSA

from grounding.parsers.spelling import SHORTHAND, stems_of
from grounding.resolve.adjectives import COLOUR_OF, COLOURS, IDLE, PROPERTIES, SAME_PROPERTY
from grounding.resolve.attributes import COMPARATIVES, TELLING_ADJECTIVES
from grounding.resolve.function_words import FUNCTION_WORDS, NOT_OBJECTS, READ_WORDS
from grounding.resolve.lexicon import GENERAL, GROUPS, HELD, OCCASIONS, SEVERAL_MEANINGS, USES
from grounding.resolve.measures import COUNTS, UNITS
from grounding.resolve.place_words import SIDES
from grounding.resolve.word_forms import FORMS, Vocabulary

KNOWN_WORDS = READ_WORDS | GENERAL | IDLE | frozenset((*COLOURS, *COLOUR_OF, *SIDES, *PROPERTIES, *SAME_PROPERTY))
# Letters of the shortest words that are corrected: where the words of English are not known, "sour" could be soup, and
# "tree" three.
_SHORTEST, _SHORTEST_UNCHECKED = 4, 5
_ABBREVIATIONS = ("id", "si", "sm", "lg", "cas")


def corrected(word: str, nouns: Vocabulary, english: Collection[str] = ()) -> str:
    """Return the word that a mistyped one stands for, or the word itself.

    Args:
        word: in small letters.
        nouns: the nouns that are known.
        english: words that are right as they are; without any, words of four letters are.
    """
    if word in everyday_words() or word in nouns.forms or word in english:
        return word
    if not (_SHORTEST if english else _SHORTEST_UNCHECKED) <= len(word) <= 24 or not word.isascii():
        return word
    if word in SHORTHAND and word not in _ABBREVIATIONS:
        return SHORTHAND[word]
    inflected = any(stem in KNOWN_WORDS or stem in TELLING_ADJECTIVES for stem in stems_of(word))
    return _nearest(word, nouns.heads, 1 if inflected else 2) or word  # "fullest" is no slip of "tallest"


@lru_cache(maxsize=1)
def everyday_words() -> frozenset[str]:
    """Return the words with which objects are named, chosen and placed."""
    verbs = frozenset(verb for verb, _ in USES)
    nouns = frozenset(word for noun in (*GROUPS, *SEVERAL_MEANINGS, *HELD) for word in noun.split()) | OCCASIONS
    return (
        frozenset((*UNITS, *COUNTS, *FORMS, *COMPARATIVES))
        | FUNCTION_WORDS | NOT_OBJECTS | KNOWN_WORDS | TELLING_ADJECTIVES | verbs | nouns
    )  # fmt: skip


@lru_cache(maxsize=64)
def _candidates(heads: frozenset[str]) -> list[str]:
    return sorted(word for word in everyday_words() | heads if " " not in word and len(word) > 3)


@lru_cache(maxsize=8192)
def _nearest(word: str, heads: frozenset[str], most: int) -> str | None:
    candidates = _candidates(heads)
    if any(word.removesuffix(ending) in candidates for ending in ("s", "ed", "ing", "es", "ly")):
        return None
    reach = 1 if len(word) < 7 else most
    found = process.extract(word, candidates, scorer=OSA.distance, score_cutoff=reach, limit=None)
    ranked = [(hit[1] + 0.6 * (hit[0][0] != word[0]) - 0.7 * (hit[0] in heads), hit[0]) for hit in found]
    return min(ranked)[1] if ranked else None

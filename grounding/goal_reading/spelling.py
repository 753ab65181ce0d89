"""Correct the typing errors of single words, against the words that goals are said with."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from rapidfuzz import process
from rapidfuzz.distance import OSA

from grounding.goal_reading.goal_words import NOISE, PATTERN_WORDS, SHAPE_NOUNS
from grounding.goal_reading.measures import COUNTS, UNITS
from grounding.goal_reading.verb_words import VERBS
from grounding.parsers.spelling import SHORTHAND, stems_of
from grounding.references.attributes import COMPARATIVES, TELLING_ADJECTIVES
from grounding.references.function_words import FUNCTION_WORDS, NOT_OBJECTS
from grounding.references.lexicon import USES
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS

_MORE = frozenset(
    "behind beside next between above below near front left right corner middle center bottom swap space together line stack "
    "circle triangle rectangle square pyramid cross grid arc row column height colour order tallest shortest biggest smallest largest "
    "closest nearest farthest furthest nearer closer farther further leftmost rightmost present remaining former latter whatever whichever power same "
    "thing things everything anything something nothing another others".split()
)
_SHORTHAND = {"tnx": "thanks", "thanx": "thanks", "tks": "thanks", "nxt": "next", "evrything": "everything", "btwn": "between", "bhnd": "behind"}
# Words of four letters that may have lost one.
_SHORT = ("next", "left", "near", "back", "with", "into", "them", "side")


def corrected(word: str, nouns: Vocabulary, known: Collection[str]) -> str:
    """Return the word that a mistyped one stands for, or the word itself.

    Args:
        word: in small letters.
        nouns: the nouns that are known.
        known: further words that are spelled right.
    """
    if word in SHORTHAND and word not in ("id", "si", "sm", "lg", "cas"):
        return SHORTHAND[word]
    if word in _SHORTHAND:
        return _SHORTHAND[word]
    if len(word) == 3 and word.isalpha() and word not in (*_words(), *nouns.forms, *known):
        return _short(word, nouns.heads) or word
    if word in _words() or word in nouns.forms or word in known or not 4 <= len(word) <= 24 or not word.isascii():
        return word
    inflected = any(stem in known or stem in TELLING_ADJECTIVES for stem in stems_of(word))  # "fullest" is no slip of "tallest"
    return _nearest(word, frozenset(nouns.heads), 1 if inflected else 2) or word


@lru_cache(maxsize=1)
def _words() -> frozenset[str]:
    return (
        frozenset(UNITS)
        | frozenset(COUNTS)
        | PATTERN_WORDS
        | NOISE
        | frozenset(VERBS)
        | FUNCTION_WORDS
        | NOT_OBJECTS
        | frozenset(TELLING_ADJECTIVES)
        | frozenset(FORMS)
        | frozenset(COMPARATIVES)
        | frozenset(verb for verb, _ in USES)
        | _MORE
    )


@lru_cache(maxsize=8192)
def _nearest(word: str, heads: frozenset[str], most: int) -> str | None:
    candidates = sorted((_words() | frozenset(SHAPE_NOUNS) | heads) - {""})
    candidates = [each for each in candidates if " " not in each and len(each) > 3]
    stems = {word.removesuffix(ending) for ending in ("s", "ed", "ing", "es", "ly")}
    if stems & set(candidates):
        return None
    reach = 1 if len(word) < 7 else most
    found = process.extract(word, candidates, scorer=OSA.distance, score_cutoff=reach, limit=None)
    ranked = [
        (hit[1] + 0.6 * (hit[0][0] != word[0]) - (0.7 if hit[0] in heads else 0.3 * (hit[0] in _MORE)), hit[0])
        for hit in found
    ]
    return min(ranked)[1] if ranked else None


def _short(word: str, heads: Collection[str]) -> str | None:
    """Return the object's name of which three letters are a typing error: two that changed places, or one that is missing."""
    for known in (*sorted(heads), *_SHORT):
        swapped = len(known) == 3 and known in (word[1] + word[0] + word[2], word[0] + word[2] + word[1])
        missing = len(known) == 4 and known[0] == word[0] and any(known[:i] + known[i + 1 :] == word for i in range(1, 4))
        if swapped or missing:
            return known
    return None

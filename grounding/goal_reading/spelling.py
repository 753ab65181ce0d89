"""Correct the typing errors of single words, against the words that goals are said with."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from rapidfuzz import process
from rapidfuzz.distance import OSA

from grounding.goal_reading.goal_words import NOISE, PATTERN_WORDS, SHAPE_NOUNS
from grounding.goal_reading.measures import COUNTS, UNITS
from grounding.goal_reading.verb_words import VERBS
from grounding.parsers.spelling import SHORTHAND
from grounding.references.attributes import COMPARATIVES, TELLING_ADJECTIVES
from grounding.references.function_words import FUNCTION_WORDS, NOT_OBJECTS
from grounding.references.lexicon import USES
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS

_MORE = frozenset(
    "behind beside next between above below near front left right corner middle center bottom swap space together line stack "
    "circle triangle rectangle square pyramid cross grid arc row column height colour order tallest shortest biggest smallest largest "
    "closest nearest farthest furthest nearer closer farther further leftmost rightmost present remaining former latter whatever whichever power same "
    "thing things".split()
)


def corrected(word: str, nouns: Vocabulary, known: Collection[str]) -> str:
    """Return the word that a mistyped one stands for, or the word itself.

    Args:
        word: in small letters.
        nouns: the nouns that are known.
        known: further words that are spelled right.
    """
    if word in SHORTHAND and word not in ("id", "si", "sm", "lg", "cas"):
        return SHORTHAND[word]
    if word in _words() or word in nouns.forms or word in known or not 4 <= len(word) <= 24 or not word.isascii():
        return word
    return _nearest(word, frozenset(nouns.heads)) or word


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
def _nearest(word: str, heads: frozenset[str]) -> str | None:
    candidates = sorted((_words() | frozenset(SHAPE_NOUNS) | heads) - {""})
    candidates = [each for each in candidates if " " not in each and len(each) > 3]
    stems = {word.removesuffix(ending) for ending in ("s", "ed", "ing", "es", "ly")}
    if stems & set(candidates):
        return None
    reach = 1 if len(word) < 7 else 2
    found = process.extract(word, candidates, scorer=OSA.distance, score_cutoff=reach, limit=None)
    ranked = [
        (hit[1] + 0.6 * (hit[0][0] != word[0]) - 0.3 * (hit[0] in _MORE or hit[0] in heads), hit[0]) for hit in found
    ]
    return min(ranked)[1] if ranked else None

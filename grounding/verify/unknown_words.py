"""Find words that nobody knows: a goal that none of its phrases was copied from may have lost anything with them."""

from __future__ import annotations

import re
from collections.abc import Collection

from rapidfuzz.distance import OSA

from grounding.parsers.spelling import mend, stems_of, usual_words
from grounding.resolve.spelling import everyday_words

_WORD = re.compile(r"(?<![\w'’])[a-z]{4,}(?![\w'’])")  # names begin with a capital, and short words are often slips


def unknown_words(text: str, copied: Collection[str], whole_words: Collection[str]) -> tuple[str, ...]:
    """Return the words of a text that are no English words, as far as the encoder and the word lists know, nor typing
    errors.

    Args:
        text: any string.
        copied: words that stand in phrases of the goal: what these mean was looked up.
        whole_words: that the encoder knows in one piece.
    """
    found = dict.fromkeys(word for word in _WORD.findall(text) if word not in copied)
    return tuple(word for word in found if not (_is_known(word, whole_words) or _is_slip(word, whole_words)))


def _is_known(word: str, whole_words: Collection[str]) -> bool:
    return any(form in whole_words or form in everyday_words() or form in usual_words() for form in stems_of(word))


def _is_slip(word: str, whole_words: Collection[str]) -> bool:
    """Return whether a word is a known one with a single slip, or two that were written as one."""
    mended = mend(word, whole_words).text
    return " " in mended or (mended != word and OSA.distance(word, mended) == 1)

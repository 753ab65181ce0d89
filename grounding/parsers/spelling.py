"""Correct typing errors and chat shorthand before a sentence is read.

The sentence encoder cuts a mistyped word into meaningless pieces. A word that neither it nor the
training language knows is replaced by the nearest word of the training language, if one is near.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

from rapidfuzz import process
from rapidfuzz.distance import OSA

from grounding.corpus.templates import FRAME_FILES, SLOTS_OF_HOLE, all_phrases, frames_of
from grounding.structure_words import STRUCTURES

_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)*|\d+[^\W\d_]*|[@&+]")
# "Object 1, object 2 and object 3", "objects 1 and 3": to the parser one thing after another, each with an order.
_NUMBERED = re.compile(
    r"\b(?:the )?(?:objects?|things?) \d{1,3}"
    r"(?:(?:, ?(?:and )?| and | & )(?:(?:the )?(?:objects?|things?) )?\d{1,3}\b)+",
    re.IGNORECASE,
)
_TOGETHER = "the objects"
_SURE = 5  # times that a word stands in the training language, to be meant by one with a letter too many
_VOWELS = re.compile("[aeiouy]")
SHORTHAND = {
    "u": "you", "ur": "your", "r": "are", "pls": "please", "plz": "please", "plse": "please", "thx": "thanks",
    "thnx": "thanks", "ty": "thanks", "w": "with", "n": "and", "&": "and", "+": "and", "@": "at", "2": "to", "4": "for",
    "b4": "before", "l8r": "later", "gr8": "great", "im": "i'm", "ive": "i've", "dont": "don't", "wont": "won't",
    "cant": "can't", "doesnt": "doesn't", "isnt": "isn't", "thats": "that's", "lets": "let's", "id": "i'd",
    "da": "the", "teh": "the", "hte": "the", "em": "them", "dem": "them", "dis": "this", "dat": "that",
    "tbl": "table", "sml": "small", "sm": "small", "med": "medium", "tht": "that", "lrg": "large", "lg": "large",
    "cntr": "center",
    "ctr": "center", "lft": "left", "rt": "right", "rgt": "right", "rite": "right", "rght": "right",
    "btm": "bottom", "frnt": "front", "bk": "back", "bak": "back", "nr": "near",
    "neer": "near", "thru": "through", "sth": "something", "smth": "something", "gimme": "give me", "wanna": "want to",
    "gonna": "going to", "otu": "out", "ot": "to", "fo": "of", "adn": "and",
    "nad": "and", "taht": "that", "si": "is", "ti": "it", "jsut": "just", "yuo": "you", "wiht": "with",
    # The encoder knows these as names or fragments, and nobody means them.
    "lok": "look", "wes": "west", "goin": "going", "tha": "the", "wil": "will", "stil": "still", "tal": "tall",
    "pleas": "please", "somethin": "something", "nothin": "nothing", "tak": "take", "wat": "what", "sid": "side",
    "mor": "more", "ito": "into", "dow": "down", "wal": "wall", "cas": "cans",
    **{short: word for structure in STRUCTURES.values() for short, word in structure.shorthand.items()},
}  # fmt: skip
_ENDINGS = (
    ("s", ""), ("es", ""), ("ies", "y"), ("ed", ""), ("ed", "e"), ("ing", ""), ("ing", "e"), ("er", ""), ("er", "e"),
    ("est", ""), ("ly", ""), ("y", ""), ("y", "e"), ("ish", ""), ("ier", "y"), ("ily", "y"), ("ness", ""), ("less", ""),
    ("wards", ""), ("ward", ""),
)  # fmt: skip
# "For four" and "two to one" are too common with digits between words to be guessed from the digit alone.
_DIGITS_BETWEEN = re.compile(
    r"(?<=[^\W\d_] )[24](?= (?:the|a|an|my|me|your|you|u|make|put|build|form|get|da|teh|them)\b)"
)


@dataclass(frozen=True)
class Mended:
    """A text with its typing errors corrected.

    Attributes:
        text: the mended text.
        words: (first, last, original first, original last) of every word: where it stands in the
            mended and in the original text.
    """

    text: str
    words: tuple[tuple[int, int, int, int], ...]

    def original_span(self, first: int, last: int) -> tuple[int, int] | None:
        """Find the characters of the original text that characters of the mended text stand for."""
        touched = [word for word in self.words if word[0] < last and first < word[1]]
        return (touched[0][2], touched[-1][3]) if touched else None


def mend(text: str, known: Collection[str]) -> Mended:
    """Correct the typing errors of a text.

    Args:
        text: the instruction.
        known: words in lower case that are left alone: the encoder's whole-word vocabulary.
    """
    shouting = text.upper() == text
    digits = {match.start() for match in _DIGITS_BETWEEN.finditer(text)}
    mended, words, end = "", [], 0
    numbered = {match.start(): match for match in _NUMBERED.finditer(text)}
    respaced = _respaced(text, known)
    for match in _WORD.finditer(text):
        if match.start() < end:  # within numbered objects
            continue
        match = numbered.get(match.start(), match)
        mended += text[end : match.start()]
        word = match[0]
        if match.start() in respaced:
            right, last = respaced[match.start()]
            words.append((len(mended), len(mended) + len(right), match.start(), last))
            mended += right
            end = last
            continue
        if match.re is _NUMBERED:
            right = _TOGETHER
        elif word in ("2", "4"):
            right = SHORTHAND[word] if match.start() in digits else word
        else:
            name = word[:1].isupper() and not shouting and match.start() > 0
            right = word if name else _right(word, known)
        words.append((len(mended), len(mended) + len(right), *match.span()))
        mended += right
        end = match.end()
    return Mended(mended + text[end:], tuple(words))


def _respaced(text: str, known: Collection[str]) -> dict[int, tuple[str, int]]:
    """Find words between which the space is one letter off: "ont he left".

    Returns:
        First character -> (the two words as they should be, the place after them).
    """
    vocabulary = usual_words()
    found = {}
    for match in re.finditer(r"\b(?=(?P<one>[a-z]{2,12}) (?P<other>[a-z]{2,12})\b)", text.lower()):
        one, other = match.group("one"), match.group("other")
        mistyped = [
            each
            for each in (one, other)
            if each not in vocabulary and not any(stem in vocabulary for stem in stems_of(each))
        ]
        if not mistyped or all(each in known and len(each) > 3 for each in mistyped):
            continue
        pairs = ((one + other[0], other[1:]), (one[:-1], one[-1] + other))
        right = [pair for pair in pairs if all(len(word) > 1 and _usual(vocabulary, word) for word in pair)]
        if right:
            best = max(right, key=lambda pair: min(vocabulary[word] for word in pair))
            found[match.start()] = " ".join(best), match.end("other")
    return found


def _right(word: str, known: Collection[str]) -> str:
    lower = word.lower()
    short = SHORTHAND.get(lower)
    if short is not None:
        return short
    if not 3 <= len(lower) <= 24 or not lower.isascii() or not lower.isalpha():
        return word
    vocabulary = usual_words()
    once = [lower[:i] + lower[i + 1 :] for i in range(1, len(lower)) if lower[i] == lower[i - 1]]
    if (
        lower not in known
        and lower not in vocabulary
        and (single := [each for each in once if vocabulary[each] >= _SURE])
    ):
        return max(single, key=vocabulary.__getitem__)  # "openning"
    if any(stem in known or stem in vocabulary for stem in stems_of(lower)):
        return word
    return _nearest(lower, 1) or _apart(lower) or (_nearest(lower, 2) if len(lower) > 4 else None) or word


def stems_of(word: str) -> list[str]:
    """Return the word, and the words that it may be an inflection of."""
    stems = [word]
    for ending, instead in _ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            stem = word[: -len(ending)]
            stems += [stem + instead] + ([stem[:-1]] if stem[-1] == stem[-2] else [])
    return stems


def _apart(word: str) -> str | None:
    """Return the two usual words that were written as one."""
    vocabulary = usual_words()
    places = [i for i in range(2, len(word) - 2) if _usual(vocabulary, word[:i]) and _usual(vocabulary, word[i:])]
    best = max(places, key=lambda i: min(vocabulary[word[:i]], vocabulary[word[i:]]), default=None)
    return f"{word[:best]} {word[best:]}" if best else None


def _usual(vocabulary: Counter[str], word: str) -> bool:
    return vocabulary[word] >= (20 if len(word) == 2 else 3)


@lru_cache(maxsize=4096)
def _nearest(word: str, reach: int) -> str | None:
    """Return the word of the training language within a number of slips, the most usual of the nearest."""
    vocabulary = usual_words()
    found = process.extract(word, vocabulary.keys(), scorer=OSA.distance, score_cutoff=reach, limit=None)
    near = [(hit[1] + _unlikely(word, hit[0]), -vocabulary[hit[0]], hit[0]) for hit in found if len(hit[0]) > 2]
    if near:
        return min(near)[2]
    if not _VOWELS.search(word):
        alike = [known for known in vocabulary if len(known) > len(word) and _VOWELS.sub("", known) == word]
        return max(alike, key=vocabulary.__getitem__, default=None)
    return None


def _unlikely(slip: str, word: str) -> float:
    """Return how unlikely it is that somebody wrote `slip` for `word`, beside the number of slips.

    Letters change places most often, and are left out more often than they are added; a slip at the first letter is
    rare.
    """
    if len(slip) == len(word) and sorted(slip) == sorted(word):
        return 0.0
    return 0.2 + 0.6 * (word[0] != slip[0]) + 0.2 * (len(word) < len(slip))


@lru_cache(maxsize=1)
def usual_words() -> Counter[str]:
    """Return the words of the training language and their frequency; those of the slots count more."""
    counts: Counter[str] = Counter()
    for name in FRAME_FILES:
        for frame in frames_of(name) if name != "frames_spoken" else ():  # those are spelt as people spell
            counts.update(word for piece in frame.pieces if isinstance(piece, str) for word in _words(piece))
    for table, values in all_phrases().items():
        weight = 5 if table in SLOTS_OF_HOLE else 1
        for phrases in values.values():
            for phrase in phrases:
                counts.update(dict.fromkeys(_words(phrase), weight))
    return counts


def _words(text: str) -> list[str]:
    return [match[0].lower() for match in _WORD.finditer(text)]

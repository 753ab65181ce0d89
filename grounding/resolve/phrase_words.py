"""Divide a copied phrase into plain words: contractions, dialect and typing errors written out."""

from __future__ import annotations

import re
from collections.abc import Callable

_TOKEN = re.compile(r"['’]?[^\W\d_]+(?:['’][^\W\d_]+)*|\d+(?:[.,]\d+)?|[(),/&+]")
_WITH = re.compile(r"\bw ?/(?: ?(o\b))?", re.IGNORECASE)  # "w/", "w/o"
_VOWEL = re.compile(r"\s+[aeiouh]")
_CONTRACTIONS = {
    "that's": "that is", "thats": "that is", "what's": "what is", "whats": "what is", "whatever's": "whatever is",
    "which's": "which is", "who's": "who is", "isn't": "is not", "isnt": "is not", "aren't": "are not",
    "arent": "are not", "ain't": "is not", "aint": "is not", "don't": "do not", "dont": "do not",
    "doesn't": "does not", "doesnt": "does not", "can't": "can not", "cant": "can not", "cannot": "can not",
    "one's": "one is", "everything's": "everything is", "thing's": "thing is", "i'm": "i am", "we're": "we are",
    "they're": "they are", "wasn't": "was not", "there's": "there is",
}  # fmt: skip
# Dialect, children's words and shorthand, as they stand in written instructions.
_DIALECT = {
    "da": "the", "di": "the", "teh": "the", "dem": "them", "em": "them", "un": "one", "uns": "ones", "yins": "ones",
    "lil": "little", "wee": "little", "littlest": "smallest", "tiniest": "smallest", "yella": "yellow",
    "yellas": "yellows", "blox": "blocks", "bloks": "blocks", "nana": "banana", "me": "my", "n": "and", "an": "and",
    "&": "and", "+": "and", "/": "and", "w": "with", "gray": "grey", "centre": "middle", "center": "middle",
    "central": "middle", "colored": "coloured", "color": "colour", "colors": "colours", "towards": "toward",
    "upon": "on", "farthest": "furthest", "farther": "further",
}  # fmt: skip
_TOGETHER = (
    ("left hand", "left"), ("right hand", "right"), ("screw driver", "screwdriver"), ("see through", "clear"),
    ("most near", "nearest"), ("most distant", "furthest"), ("more near", "nearer"), ("more far", "further"),
    ("further off", "further away"), ("furthest off", "furthest away"),
)  # fmt: skip


_BEFORE_ME = frozenset("to of from by near nearer nearest closer closest than".split())  # "me" for "my" elsewhere


def plain_words(text: str, corrected: Callable[[str], str]) -> tuple[str, ...]:
    """Divide a phrase into words in small letters, spelled in one way.

    Args:
        text: as it was copied.
        corrected: gives the right spelling of a word, or the word itself.
    """
    words: list[str] = []
    text = _WITH.sub(lambda found: "without " if found.group(1) else "with ", text.replace("’", "'"))
    for match in _TOKEN.finditer(text.lower()):
        word = match.group()
        word = word.lstrip("'")
        if word == "me" and words and words[-1] in _BEFORE_ME:
            words.append("me")
            continue
        if word == "an" and _VOWEL.match(text.lower(), match.end()):
            words.append("a")  # and no "and" of speakers who swallow its end
            continue
        if word.endswith(("'d", "'ll")):
            word = word.partition("'")[0] + (" would" if word.endswith("d") else " will")  # "what you'd drink from"
        word = _CONTRACTIONS.get(word) or _DIALECT.get(word) or _DIALECT.get(corrected(word)) or corrected(word)
        words += word.removesuffix("'s").removesuffix("s'").split() if "'" in word else word.split()
    said = f" {' '.join(words)} "
    for apart, together in _TOGETHER:
        said = said.replace(f" {apart} ", f" {together} ")
    return tuple(said.split())

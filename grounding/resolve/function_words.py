"""List function words of English, and nouns that never name an object on the table."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.resolve.lexicon import pairs
from grounding.structure_words import words_of_all

_WORDS = {name: frozenset(text.split()) for name, text in pairs("function_words").items()}
_COUNTING = "one two three four five six seven eight nine ten eleven twelve".split()
NUMBERS: Mapping[str, int] = {"both": 2, "couple": 2, "pair": 2, "dozen": 12} | {
    word: number for number, word in enumerate(_COUNTING, start=1)
}
ORDINALS: Mapping[str, int] = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7, "eighth": 8, "last": -1,
    "1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5,
}  # fmt: skip
DETERMINERS, STAYING = _WORDS["determiners"], _WORDS["staying"]
# Words that say which objects by where they stand: "the left cups", "the nearer two".
PLACE_ADJECTIVES = _WORDS["place_adjectives"]
# Words for objects of no kind. "one" are singulars, "stuff" take a word for their group before them.
GENERIC: Mapping[str, str] = {
    "everything": "all", "objects": "all", "object": "one", "items": "all", "item": "one", "things": "stuff",
    "thing": "one", "stuff": "stuff", "gear": "stuff", "supplies": "stuff", "equipment": "stuff",
    "lot": "all",
    "pieces": "all", "ones": "all", "one": "one", "bits": "all", "belongings": "stuff", "articles": "all",
    "utensils": "stuff",
}  # fmt: skip
SHAPE_WORDS = frozenset(("layout", "arrangement", "structure", "formation", *words_of_all("never_objects")))
ARRANGING = frozenset(words_of_all("arranging")) | _WORDS["arranging"]
NOT_OBJECTS = _WORDS["not_objects"] | SHAPE_WORDS
FUNCTION_WORDS = _WORDS["further"] | STAYING | ARRANGING | DETERMINERS | frozenset(NUMBERS)
# Words that are no typing errors of others.
READ_WORDS = _WORDS["known"]

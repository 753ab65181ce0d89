"""Form plurals and singulars of English nouns, and list the nouns that are known without a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from grounding.resolve.lexicon import GROUPS, KINDS, MASS_NOUNS, OTHER_WORDS

_IRREGULAR = {
    "knife": "knives", "loaf": "loaves", "leaf": "leaves", "scissors": "scissors", "dice": "dice",
    "mouse": "mice",
    "tomato": "tomatoes", "potato": "potatoes", "mango": "mangoes", "box": "boxes", "domino": "dominoes",
    "dish": "dishes", "pliers": "pliers", "tongs": "tongs", "lego": "legos", "aircraft": "aircraft",
    "electronics": "electronics", "glasses": "glasses", "shears": "shears", "tweezers": "tweezers", "pants": "pants",
}  # fmt: skip


def plural(noun: str) -> str:
    """Form the plural of an English noun, as far as rules and a short list of exceptions go."""
    if noun in _IRREGULAR:
        return _IRREGULAR[noun]
    if noun.endswith("y") and len(noun) > 1 and noun[-2] not in "aeiou":
        return noun[:-1] + "ies"
    return noun + ("es" if noun.endswith(("s", "x", "z", "sh", "ch")) else "s")


@lru_cache(maxsize=4096)
def singular(word: str) -> str:
    """Form the probable singular of a plural; a word that looks like no plural is returned as it is."""
    if word in _FORMS:
        return _FORMS[word][0]
    if len(word) > 4 and word.endswith("ies"):
        return word[:-3] + "y"
    if len(word) > 4 and word.endswith(("sses", "xes", "ches", "shes")):
        return word[:-2]
    if len(word) > 3 and word.endswith("s") and not word.endswith(("ss", "us", "is")):
        return word[:-1]
    return word


def _known_forms() -> dict[str, tuple[str, bool]]:
    forms: dict[str, tuple[str, bool]] = {}
    others = {word for words in OTHER_WORDS.values() for word in words}
    for noun in (*KINDS, *OTHER_WORDS, *sorted(others), *GROUPS):
        forms.setdefault(plural(noun), (noun, True))
        forms.setdefault(noun, (noun, noun in MASS_NOUNS))
    forms["shears"] = ("shears", False)
    forms["scissors"], forms["dice"], forms["pliers"] = ("scissors", False), ("dice", True), ("plier", False)
    return forms


_FORMS = _known_forms()
FORMS: Mapping[str, tuple[str, bool]] = _FORMS  # word -> (singular, whether it means all of its kind)


@dataclass(frozen=True)
class Vocabulary:
    """The nouns that are known.

    Attributes:
        forms: word -> (singular, whether it means all of its kind).
        heads: the nouns of the objects of the scene.
        compounds: pairs of words that stand side by side in the name of an object.
    """

    forms: Mapping[str, tuple[str, bool]]
    heads: frozenset[str] = frozenset()
    compounds: frozenset[tuple[str, str]] = frozenset()

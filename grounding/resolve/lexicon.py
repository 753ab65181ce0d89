"""Load the words that objects are named with: kinds, synonyms, groups, and adjectives (`lexicon.toml`)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_TABLES = tomllib.loads((Path(__file__).parent / "lexicon.toml").read_text(encoding="utf-8"))
_LISTS: dict[str, str] = _TABLES["lists"]


def listed(text: str) -> tuple[str, ...]:
    """Divide a text into words; "@fruit" stands for the words of that list, and "power_tool" for two words."""
    found: list[str] = []
    for word in text.split():
        if word.startswith("@"):
            found += KINDS if word == "@kinds" else listed(_LISTS[word[1:]])
        else:
            found.append(word.replace("_", " "))
    return tuple(found)


def tables(name: str) -> Mapping[str, Mapping[str, Any]]:
    """Return a table of tables of the file."""
    return _TABLES[name]


def table(name: str) -> Mapping[str, tuple[str, ...]]:
    """Return a table of the file: word -> words."""
    return {key: listed(text) for key, text in _TABLES[name].items()}


def pairs(name: str) -> Mapping[str, str]:
    """Return a table of the file: word -> one word."""
    return dict(_TABLES[name])


FRUIT = listed("@fruit")
_NAMED = (
    "@cutlery @drinkware @crockery @fruit @vegetables @bread @food @tools @toys @office @cooking @electronics @others"
)
KINDS: tuple[str, ...] = tuple(dict.fromkeys(word for word in listed(_NAMED) if word not in ("food", "toy")))
FILLINGS = frozenset(listed("@fillings"))
VESSELS, MASS_NOUNS = (frozenset(listed(name)) for name in ("@holding", "@masses"))
GENERAL, LOOSE = frozenset(listed("@general")), listed("@loose")
OTHER_WORDS, GROUPS = table("others"), table("groups")
SEVERAL_MEANINGS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    noun: tuple(map(listed, each)) for noun, each in _TABLES["meanings"].items()
}
STUFF, HELD = pairs("stuff"), table("held")
OCCASIONS = frozenset((*STUFF, *listed("@occasions")))
LIKE_KINDS = pairs("like")
USES: Mapping[tuple[str, str], str] = {
    (verb.split()[0], verb.partition(" ")[2]): group for verb, group in _TABLES["uses"].items()
}
_USE_GROUPS = table("use_groups")

# Adjectives that exclude each other: a name with one of them is not meant by another of the same class.
COLOURS, CONTENTS = listed("@colours"), listed("@contents")
SAME_WORDS = pairs("same")
ATTRIBUTES: tuple[tuple[str, ...], ...] = (
    tuple(SAME_WORDS.get(word, word) for word in COLOURS), *table("exclusive").values(),
)  # fmt: skip
ADJECTIVES = frozenset(word for words in ATTRIBUTES for word in words)


def meanings(noun: str) -> list[tuple[str, ...]]:
    """List what a noun can mean, best first; each alternative is a set of kinds."""
    if noun in _USE_GROUPS:
        return [_USE_GROUPS[noun]]
    found: list[tuple[str, ...]] = [(noun,)]
    if noun in GROUPS:
        group = GROUPS[noun]
        # A tumbler is drinkware because it is a glass.
        found = [(noun, *group, *(word for word, kinds in OTHER_WORDS.items() if kinds and kinds[0] in group))]
    return found + [(other,) for other in OTHER_WORDS.get(noun, ())]

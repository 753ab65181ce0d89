"""Define the result of reading noun phrases, and the nouns that they are read with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

ANY = "object"  # the noun of a mention that says no kind: "everything", "three things", "the red ones"


@dataclass(frozen=True)
class Mention:
    """One noun phrase.

    Attributes:
        noun: the singular of its last noun, or `ANY`.
        modifiers: the words before the noun that may describe it: "red", "soup".
        count: the number of objects, `None` for all; negative for all but that number.
        exact: whether the speaker gave the number, so that fewer will not do.
        role: "target" (to be arranged), "left out", "narrated" (mentioned in passing) or "landmark".
        known: whether a table or the scene knows the noun.
        plural: whether it may mean several objects.
        numbers: of "object 3", "cups 1 and 2".
        ordinal: of "the second cup", from 1; -1 for the last.
        span: (first, end) characters of the phrase, without its article.
        preposition: of a landmark the word before it: "behind" the plate.
        definite: whether it means one particular object: "the mug", not "a mug" or "one of the mugs".
    """

    noun: str
    modifiers: tuple[str, ...]
    count: int | None
    exact: bool
    role: str
    known: bool
    plural: bool
    numbers: tuple[int, ...]
    ordinal: int | None
    span: tuple[int, int]
    definite: bool = False
    preposition: str = ""


@dataclass(frozen=True)
class References:
    """The mentions of an instruction, and whether "them" or "these" stand in for some.

    Attributes:
        text: the instruction that they were read from.
        mentions: in the order of the text.
        pronoun: whether a pronoun is what should be arranged.
    """

    text: str
    mentions: tuple[Mention, ...]
    pronoun: bool

    def by_role(self, role: str) -> list[Mention]:
        """List the mentions of one role, in the order of the text."""
        return [mention for mention in self.mentions if mention.role == role]


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

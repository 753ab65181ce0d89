"""Hold what phrases can refer to: the objects of a scene with their nouns, in all the meanings of these."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from grounding.resolve.attributes import ObjectAttributes, SceneObject, scene_objects
from grounding.resolve.lexicon import (
    COLOURS,
    FILLINGS,
    GROUPS,
    HELD,
    KINDS,
    LOOSE,
    MASS_NOUNS,
    OCCASIONS,
    SEVERAL_MEANINGS,
    STUFF,
    VESSELS,
    meanings,
)
from grounding.resolve.object_names import KNOWN_NOUNS, UNKNOWN_CATEGORY, near_nouns, read_names, vocabulary
from grounding.resolve.table_places import TablePlaces
from grounding.resolve.word_forms import FORMS, Vocabulary, singular

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

_WORD = re.compile(r"[^\W\d_]+")


class Referents:
    """What phrases can refer to.

    Args:
        objects: what is there: objects with what is known of them, or their names; `None` where nothing is known.
        encoder: finds what nouns and descriptions mean that no table knows; `None` does without.
        catalogue: whether they are a library that a scene can be drawn from: sizes and places say nothing then.
        opposite: whether the speaker sits across the table.

    Attributes:
        names: of the objects; "object" for one without a name.
        attributes: of each object.
        places: where they stand.
    """

    def __init__(
        self,
        objects: Sequence[SceneObject | str | None] | None,
        encoder: SentenceEncoder | None = None,
        catalogue: bool = False,
        opposite: bool = False,
    ) -> None:
        there = scene_objects(objects) or ()
        self.known, self.encoder, self.catalogue = objects is not None, encoder, catalogue
        self.names = [each.name if each.name.strip() else UNKNOWN_CATEGORY for each in there]
        self.attributes: list[ObjectAttributes | None] = [each.attributes for each in there]
        self.places = TablePlaces(self.attributes, opposite)
        self.count = len(there)
        self._read = read_names(tuple(self.names))
        self._words = [frozenset(map(singular, _WORD.findall(name.lower()))) for name in self.names]
        self._compounds = ["-".join(name.lower().rstrip(" 0123456789").split()) for name in self.names]
        self._meanings: dict[str, list[tuple[int, ...]]] = {}

    @cached_property
    def vocabulary(self) -> Vocabulary:
        """Return the nouns that are known here."""
        return vocabulary(tuple(self.names)) if self.known else Vocabulary(FORMS)

    # The objects

    def everything(self) -> tuple[int, ...]:
        """List all objects."""
        return tuple(range(self.count))

    def head(self, index: int) -> str:
        """Return the noun of an object's name; empty where it has none."""
        return self._read[index].head

    def number(self, index: int) -> int | None:
        """Return the number of an object such as "cup 2"."""
        return self._read[index].number

    def holds(self, index: int) -> bool:
        """Tell whether something can be put into an object, as far as its name says."""
        return self.head(index) in VESSELS

    def colour(self, index: int) -> str:
        """Return the word for the colour of an object; empty where it is not known."""
        attributes = self.attributes[index]
        if attributes is not None and attributes.colors:
            return attributes.colors[0]
        return next((word for word in self._read[index].words if word in COLOURS), "")

    def description(self, index: int) -> str:
        """Describe an object, with its colour if that is known and not in its name."""
        colour, name = self.colour(index), self.names[index]
        return name if not colour or colour in self._read[index].words else f"{name} ({colour})"

    def inventory(self) -> str:
        """List everything that is there, counted."""
        if all(not name.head and not name.words for name in self._read):
            return ", ".join(f"object {number + 1}" for number in self.everything()) or "nothing"
        counted = Counter(self.names)
        parts = [f"{number} x {name}" if number > 1 else name for name, number in counted.items()]
        return ("; " if any("," in name for name in counted) else ", ").join(parts)

    # Their nouns

    def says(self, index: int, word: str) -> bool:
        """Tell whether the name of an object holds a word: "soup" of a soup can."""
        return not self._words[index].isdisjoint(_in_names(word))

    def named(self, word: str) -> bool:
        """Tell whether a word stands in the name of an object here."""
        return not all(map(_in_names(word).isdisjoint, self._words))

    def compound(self, word: str, noun: str) -> bool:
        """Tell whether the name of an object holds both a word and a noun: "soup can"."""
        return any(self.says(i, word) and self.says(i, noun) for i in self.everything())

    def filling(self, word: str) -> bool:
        """Tell whether a word is what something here holds, and no object itself: "milk" of a milk carton."""
        return self.named(word) and not self.of_kinds((singular(word),))

    def is_noun(self, word: str) -> bool:
        """Tell whether a word is a known noun for objects, general nouns left aside."""
        return word in self.vocabulary.forms or word in SEVERAL_MEANINGS or singular(word) in SEVERAL_MEANINGS

    def plural(self, word: str) -> bool:
        """Tell whether a noun stands in the plural, or means all of its kind."""
        known = self.vocabulary.forms.get(word)
        several = known[1] if known else singular(word) != word
        return several or word in MASS_NOUNS or word in ("porcelain", "silver", "produce", "packaging", "citrus")

    def of_kinds(self, kinds: tuple[str, ...]) -> tuple[int, ...]:
        """List the objects of some kinds; a kind of two words is written "watering-can"."""
        return tuple(
            i for i, name in enumerate(self._compounds)
            if name in kinds or any(head in kinds for head in self._read[i].heads)
        )  # fmt: skip

    def meanings(self, noun: str) -> list[tuple[int, ...]]:
        """List the sets of objects that a noun can mean, the likeliest first; empty where it means none."""
        if noun not in self._meanings:
            self._meanings[noun] = self._find_meanings(noun)
        return self._meanings[noun]

    def _find_meanings(self, noun: str) -> list[tuple[int, ...]]:
        one = self.vocabulary.forms.get(noun, (singular(noun),))[0]
        found = [self.of_kinds(kinds) for kinds in SEVERAL_MEANINGS.get(noun, SEVERAL_MEANINGS.get(one, ()))]
        if noun == "dishes" or not found:
            found.append(self._by_noun(one))
        if one in LOOSE and found[-1] and 2 * len(found[-1]) > self.count:
            found = [self.everything() if one != "toy" else found[-1]]
        return [each for each in dict.fromkeys(found) if each]

    def _by_noun(self, noun: str) -> tuple[int, ...]:
        itself, *others = meanings(noun)
        group = noun in GROUPS
        found = tuple(
            i for i, name in enumerate(self._read)
            if any(head in itself for head in name.heads) or (group and noun in name.words)  # a toy car is a toy
        )  # fmt: skip
        if found:
            return found
        # The mustard is in the mustard bottle; but the cups are not the cup rack.
        filled = noun in FILLINGS or noun not in FORMS
        if found := tuple(i for i, n in enumerate(self._read) if noun in n.words and (filled or n.head not in KINDS)):
            return found
        found = next((found for kinds in others if (found := self.of_kinds(kinds))), ())
        return found or tuple(i for i in self.everything() if noun in HELD and self.says(i, noun))

    def near(self, noun: str) -> tuple[int, ...]:
        """List the objects whose nouns are near another one in meaning."""
        if noun not in KNOWN_NOUNS:
            return ()
        return self.of_kinds(tuple(near_nouns(noun, [self.head(i) for i in self.everything()], self.encoder)))

    def of_occasion(self, word: str) -> tuple[int, ...] | None:
        """List what "desk items" or "breakfast things" are; `None` where the word names no occasion."""
        if word not in OCCASIONS:
            return None
        group = STUFF.get(word)
        found = tuple(self.meanings(group)[0]) if group and self.meanings(group) else ()
        narrow = group in ("writing", "cutlery", "drinkware", "toy", "food", "tool", "cookware", "electronics")
        if narrow or (found and 2 * len(found) < self.count):
            return found
        return self.everything()


@lru_cache(maxsize=4096)
def _in_names(word: str) -> frozenset[str]:
    """Return the words of which one stands in the name of what a word speaks of: itself, and what holds it."""
    return frozenset((singular(word), *HELD.get(singular(word), ())))

"""Match noun phrases against the objects of a scene: by noun, colour, size, number and order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from grounding.references.attributes import (
    COMPARATIVES,
    EXPLETIVES,
    MEASURES,
    SUPERLATIVES,
    SceneObject,
    alike,
    by_size,
    is_color,
    of_color,
    of_size,
)
from grounding.references.lexicon import FILLINGS, GROUPS, KINDS, SAME_WORDS, SPHERES, VESSELS, meanings
from grounding.references.object_names import UNKNOWN_CATEGORY, adjective, as_named, guesses, read_name, rivals
from grounding.references.phrases import ANY, Mention
from grounding.references.word_forms import FORMS, plural

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder


class SelectionError(ValueError):
    """Raised for a reference to an object that does not exist; the message lists the existing ones."""


class Candidates:
    """The objects that noun phrases can mean.

    Args:
        objects: of the scene, or of the library that one is drawn from.
        encoder: sentence encoder for nouns that neither the tables nor the names contain.
        catalogue: whether they are a library: sizes are not judged then.

    Attributes:
        names: the names of the objects; "object" for those without a name.
    """

    def __init__(self, objects: Sequence[SceneObject], encoder: SentenceEncoder | None, catalogue: bool) -> None:
        self.names = [each.name if each.name.strip() else UNKNOWN_CATEGORY for each in objects]
        self.catalogue = catalogue
        self._read = [read_name(as_named(name, self.names)) for name in self.names]
        self._attributes = [each.attributes for each in objects]
        self._encoder = encoder
        self._unnamed = all(not name.head and not name.words for name in self._read)
        self._words = {word for name in self._read for word in name.words}
        self._found: dict[tuple[object, ...], list[int]] = {}
        self._unjudged: dict[tuple[object, ...], list[str]] = {}
        self._judged: set[tuple[object, ...]] = set()

    def matching(self, mention: Mention) -> list[int]:
        """Find the objects that the phrase fits, in ascending order, or best first for a superlative such as "the
        largest".
        """
        key = _key(mention)
        if key not in self._found:
            found = self._described(mention, self.kinds_of(mention))
            if mention.numbers and (len(found) == 1 or any(self._read[i].number is not None for i in found)):
                found = [i for i in found if (self._read[i].number or 1) in mention.numbers]  # "cup, cup 2, cup 3"
            elif mention.numbers and mention.noun == ANY:
                found = [number - 1 for number in mention.numbers if 0 < number <= len(self.names)]
            if mention.ordinal is not None:
                found = found[-1:] if mention.ordinal < 0 else found[mention.ordinal - 1 : mention.ordinal]
            self._found[key] = found
        return self._found[key]

    def chooses(self, mention: Mention) -> bool:
        """Tell whether a mention without a noun says more than "everything"."""
        if mention.exact or mention.numbers or mention.ordinal or self._telling(mention):
            return True
        self.matching(mention)
        return self.judged(mention)

    def judged(self, mention: Mention) -> bool:
        """Tell whether a colour or a size took part in the choice."""
        self.matching(mention)
        return _key(mention) in self._judged

    def sized(self, mention: Mention) -> bool:
        """Tell whether the phrase has an adjective of size."""
        return any(map(_measure, mention.modifiers))

    def superlative(self, mention: Mention) -> bool:
        """Tell whether the phrase says "the tallest" or the like."""
        return any(word in SUPERLATIVES for word in mention.modifiers)

    def unjudged(self, mention: Mention) -> list[str]:
        """List the adjectives of a phrase that nothing here can judge."""
        self.matching(mention)
        return self._unjudged.get(_key(mention), [])

    def notes(self, mentions: Sequence[Mention]) -> tuple[str, ...]:
        """Say which adjectives nothing in the scene can judge, a sentence each."""
        notes = []
        for mention in mentions:
            for word in self._unjudged.get(_key(mention), ()):
                noun = plural(mention.noun) if mention.noun != ANY else "objects"
                notes.append(
                    f"it is not known which of the {noun} here are {word!r}: that word was left out of the choice"
                )
        return tuple(dict.fromkeys(notes))

    def label(self, mention: Mention) -> str:
        """Return the noun with the adjectives that distinguished its objects."""
        words = [w for w in mention.modifiers if _measure(w) or is_color(w)] if self.judged(mention) else []
        return " ".join((*words, mention.noun))

    def description(self, index: int) -> str:
        """Describe an object, with its colour if that is known and not in its name."""
        attributes, name = self._attributes[index], self.names[index]
        color = attributes.colors[0] if attributes is not None and attributes.colors else ""
        return name if not color or color in self._read[index].words else f"{name} ({color})"

    def head(self, index: int) -> str:
        """Return the noun of an object's name; empty where it has none."""
        return self._read[index].head

    def holds(self, index: int) -> bool:
        """Tell whether something can be put into an object, as far as its name says."""
        return self._read[index].head in VESSELS

    # What is not there

    def missing(self, mention: Mention, how: str) -> str:
        """Explain why the phrase fits no object, or too few, and list the objects there are."""
        telling = [w for w in mention.modifiers if w in self._telling(mention) or _measure(w) or is_color(w)]
        noun = mention.noun if mention.noun != ANY or not telling else "one"
        asked = " ".join((*telling, noun, *map(str, mention.numbers)))
        count = abs(mention.count or 0) if mention.exact else 0
        said = f"{count} of {asked!r}" if count else repr(asked)
        kinds = self.kinds_of(mention)
        if kinds and self.judged(mention):
            sized = [w for w in mention.modifiers if _measure(w)]
            if sized and not self.matching(mention) and (sizes := self._sizes(sized[0], kinds)):
                return f"the instruction {how} {said}, and their {sizes}"
            listed = "; ".join(dict.fromkeys(self.description(i) for i in kinds))
            return f"the instruction {how} {said}; of that kind there is only: {listed}"
        if self._unnamed:
            return f"the instruction {how} {said}; the objects have no names; there is only: {self.inventory()}"
        return f"the instruction {how} {said}; there is only: {self.inventory()}"

    def inventory(self) -> str:
        """List everything that is there, counted."""
        if self._unnamed:
            return ", ".join(f"object {number}" for number in range(1, len(self.names) + 1)) or "nothing"
        counted = Counter(self.names)
        parts = (f"{number} x {name}" if number > 1 else name for name, number in counted.items())
        return ("; " if any("," in name for name in counted) else ", ").join(parts) or "nothing"

    def _sizes(self, word: str, kinds: Sequence[int]) -> str:
        """Say how alike the objects are in a measure: "heights are too alike: 10.1 to 10.4 cm"."""
        measure = MEASURES[_measure(word) or word]
        values = [measure.of(each.size) for i in kinds if (each := self._attributes[i]) and each.size]
        if len(values) < len(kinds) or len(kinds) < 2:
            return ""
        if measure.noun == "sizes":
            return "sizes are too alike to say which are meant"
        low, high = 100 * min(values), 100 * max(values)
        return f"{measure.noun} are too alike to say which are meant: {low:.1f} to {high:.1f} cm"

    # By noun

    def kinds_of(self, mention: Mention) -> list[int]:
        """Find the objects that the noun of a phrase can mean, regardless of its adjectives."""
        if mention.noun == ANY:
            return list(range(len(self.names)))
        if mention.known:
            return self._by_noun(mention.noun)
        heads = sorted({head for name in self._read for head in name.heads})
        return next(
            (found for noun in guesses(mention.noun, heads, self._encoder) if (found := self._by_noun(noun))),
            [],
        )

    def _by_noun(self, noun: str) -> list[int]:
        """Find the objects that a known noun can mean."""
        itself, *others = meanings(noun)
        if found := self._of_kinds(itself, noun):
            return found
        # The mustard is in the mustard bottle; but the cups are not the cup rack.
        filled = noun in FILLINGS or noun not in FORMS
        if found := [i for i, n in enumerate(self._read) if noun in n.words and (filled or n.head not in KINDS)]:
            return found
        return next((found for kinds in others if (found := self._of_kinds(kinds, noun))), [])

    def _of_kinds(self, kinds: Sequence[str], noun: str) -> list[int]:
        """Find the objects of these kinds; a toy car is a toy."""
        group = noun in GROUPS
        return [
            i
            for i, n in enumerate(self._read)
            if any(head in kinds for head in n.heads) or (group and noun in n.words)
        ]

    # By adjective

    def _telling(self, mention: Mention) -> list[str]:
        """Return the modifiers that can identify the object."""
        return [w for w in mention.modifiers if adjective(w) in self._words or rivals(adjective(w))]

    def _described(self, mention: Mention, found: list[int]) -> list[int]:
        """Keep the found objects that the adjectives fit, as far as the scene allows judging them."""
        # Sizes last: "the small red cups" are small among the red ones.
        for word in sorted(mention.modifiers, key=lambda word: _measure(word) is not None):
            if word in _SAYING_NOTHING:
                continue
            narrowed = self._fitting(word, mention, found)
            if narrowed is None:
                self._unjudged.setdefault(_key(mention), []).append(word)
            else:
                found = narrowed
        return found

    def _fitting(self, said: str, mention: Mention, found: list[int]) -> list[int] | None:
        """Return the objects that an adjective fits; `None` if it cannot be judged in this scene."""
        word = adjective(said)
        holding = [i for i in found if word in self._read[i].words]
        known = [self._attributes[i] for i in found]
        measure = _measure(said)
        if not holding and is_color(said):
            fitting = of_color(said, known)
            if fitting is not None:
                self._judged.add(_key(mention))
                return [found[i] for i in fitting]
        if measure is not None and self.catalogue:
            self._judged.add(_key(mention))
            return found
        if measure is not None and (said in SUPERLATIVES or not holding):
            fitting = self._of_measure(said, measure, mention, found)
            if fitting is not None:
                self._judged.add(_key(mention))
                return fitting
        if holding:
            return holding
        if said in ("round", "spherical") and (round_ones := self._round(found, said == "spherical")):
            return round_ones
        # A green cup is none of those that are called red.
        rest = [i for i in found if not set(rivals(word)) & set(self._read[i].words)]
        return rest if len(rest) < len(found) or not found else None

    def _round(self, found: Sequence[int], spherical: bool) -> list[int]:
        """Return the objects that are round; none where it is not clear, because others are round from above."""
        heads = {self._read[i].head for i in found}
        discs = heads & {*GROUPS["crockery"], *GROUPS["glassware"], "can", "coin", "lid", "tape", "pan", "clock"}
        return [] if discs and not spherical else [i for i in found if self._read[i].head in SPHERES]

    def _of_measure(self, said: str, measure: str, mention: Mention, found: list[int]) -> list[int] | None:
        known = [self._attributes[i] for i in found]
        superlative = said in SUPERLATIVES or (said in COMPARATIVES and mention.count == 1)
        if not superlative:
            fitting = of_size(measure, known)
            return None if fitting is None else [found[i] for i in fitting]
        order = by_size(measure, known)
        if not order:
            return order
        count = mention.count or len(of_size(measure, known) or order[:1])
        if mention.ordinal is not None:
            return [found[i] for i in order]
        # Two that are equally tall are both "the tallest".
        last = known[order[min(count, len(order)) - 1]]
        tied = [
            i for i in order[count:] if last is not None and known[i] is not None and alike(measure, last, known[i])
        ]
        return [found[i] for i in (*order[:count], *tied)]


_SAYING_NOTHING = frozenset(("sized", "size")) | EXPLETIVES


def _key(mention: Mention) -> tuple[object, ...]:
    return mention.noun, mention.modifiers, mention.numbers, mention.ordinal, mention.count


def _measure(word: str) -> str | None:
    """Return the plain adjective of size of a word in any degree; `None` if it is not one."""
    plain = SUPERLATIVES.get(word) or COMPARATIVES.get(word) or word
    return plain if plain in MEASURES else SAME_WORDS.get(plain) if SAME_WORDS.get(plain) in MEASURES else None

"""Find what an instruction offers to a phrase without a noun of its own: "of the pens, the far one", "that one"."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from grounding.resolve.adjectives import colours_of
from grounding.resolve.choice import Choice
from grounding.resolve.errors import Doubt, ResolveError
from grounding.resolve.lexicon import GENERAL
from grounding.resolve.phrase import Phrase, SaidPhrases, Test
from grounding.resolve.phrase_parser import PhraseParser
from grounding.resolve.referents import Referents


class NounContexts:
    """The nouns of one instruction.

    Args:
        words: of the instruction, as `plain_words` divides it.
        there: what is there.
        choice: chooses the objects of a colour.
    """

    def __init__(self, words: Sequence[str], there: Referents, choice: Choice) -> None:
        self._words, self._there, self._choice = tuple(words), there, choice

    def place_of(self, phrase: Phrase, after: int) -> int:
        """Return where the instruction says a phrase, after a place if possible."""
        words = tuple(phrase.text.split())
        starts = [n for n in range(len(self._words) - len(words) + 1) if self._words[n : n + len(words)] == words]
        return next((n for n in starts if n > after), starts[0] if starts else after + 1)

    def around(self, phrase: Phrase, place: int) -> Iterator[Sequence[int]]:
        """List what the nouns mean of which there are several, those before a phrase first, the nearest one first.

        Only adjectives may have their noun behind them: "the left one" is not one of what follows.
        """
        before = range(min(place, len(self._words)) - 1, -1, -1)
        telling = phrase.rank is not None or bool(phrase.tests)
        placed = telling and all(each[0].kind == "place" for each in phrase.tests)
        after = range(place + len(phrase.text.split()), 0 if placed else len(self._words))
        coloured = any(each[0].kind == "colour" for each in phrase.tests)
        for n in (*before, *after):
            yield from (base for base in self._meant(n, coloured) if len(base) > 1)

    def told_before(self, place: int) -> bool:
        """Tell whether some of the objects were named before a place, so that "these" may mean them."""
        for word in self._words[:place]:
            if colours_of(word.removesuffix("s")) is not None:
                return True
            if self._there.is_noun(word) and word not in GENERAL:
                meant = self._there.meanings(word)
                if meant and len(meant[0]) < self._there.count:
                    return True
        return False

    def _meant(self, n: int, coloured: bool) -> Iterator[Sequence[int]]:
        """List what a word may mean: with the colour before it, "the green block", and without."""
        word, before = self._words[n], self._words[n - 1] if n else ""
        following = self._words[n + 1] if n + 1 < len(self._words) else ""
        named = self._there.is_noun(word) and word not in GENERAL
        meant = self._there.meanings(word)[:1] if named else [self._there.everything()]
        base = meant[0] if meant else ()
        colour = before if named or word in ("one", "ones") else word.removesuffix("s")
        next_named = self._there.is_noun(following) or following in GENERAL or following in ("one", "ones")
        ends = named or word in ("one", "ones") or not next_named
        if not coloured and ends and colours_of(colour) is not None:
            yield self._choice.fitting(Phrase("", tests=((Test("colour", colour),),)), base)
        if named:
            yield base


# With these a noun phrase begins for certain, as behind a mark: "can" may be a verb.
_BEGINNINGS = frozenset("the a an my your our his her their this that these those both one two three four five".split())


class ToldObjects:
    """What one instruction names before a phrase.

    Args:
        words: of the instruction, as `plain_words` divides it.
        there: what is there.
        said: the phrases of the goal.
        find: finds the objects of a phrase.
    """

    def __init__(
        self, words: Sequence[str], there: Referents, said: SaidPhrases, find: Callable[[Phrase], list[int]]
    ) -> None:
        self._words, self._there, self._said, self._find = tuple(words), there, said, find
        self._read: list[tuple[int, Phrase, int]] | None = None
        self._finding: set[int] = set()  # places of phrases whose objects are being found: none tells of itself

    def one(self, among: Sequence[int] | None = None) -> list[int]:
        """Return the object that was named last alone, of some objects if given; empty where that is in doubt."""
        own = self._said.beside_in_part()
        for found in reversed(self._before()):
            if found is None:
                return []
            if len(found) == 1 and found[0] not in own and (among is None or found[0] in among):
                return list(found)
        return []

    def several(self, count: int | None) -> list[int]:
        """Return the objects which were named last, together or one by one; empty where in doubt.

        Args:
            count: how many they are; `None` where that is not said.
        """
        before, own = self._before(), self._said.beside_in_part()
        if None in before:
            return []
        singles: list[int] = []
        for found in reversed(before):
            if len(found or ()) > 1:
                break
            singles = list(dict.fromkeys((*(i for i in found or () if i not in own), *singles)))
        together = [found for found in before if found and len(found) > 1 and not own.issuperset(found)][-1:]
        fits = [each for each in (*together, singles) if (len(each) > 1 if count is None else len(each) == count)]
        return sorted(fits[0]) if fits and all(set(each) == set(fits[0]) for each in fits) else []

    def _before(self) -> list[list[int] | None]:
        """List what was named before the current phrase, the last one last; `None` for what is in doubt."""
        place = self._said.current.place if self._said.current is not None else 0
        found: list[tuple[int, list[int] | None]] = [
            (each.place, objects)
            for each in self._said.before()
            for objects in (*(each.inner if not self._said.in_part(each) else ()), each.found or [])
        ]
        known = {each.place for each in self._said.before()}
        for start, phrase, end in self._phrases():
            if end <= place and start not in self._finding and not known & set(range(start, end)):
                self._finding.add(start)
                found.append((start, self._meant(phrase)))
                self._finding.discard(start)
        return [objects for _, objects in sorted(found, key=lambda each: each[0]) if objects != []]

    def _meant(self, phrase: Phrase) -> list[int] | None:
        try:
            return self._find(replace(phrase, definite=True, demonstrative=False))
        except ResolveError:
            return []  # it speaks of something else: "the table"
        except Doubt:
            return None

    def _phrases(self) -> list[tuple[int, Phrase, int]]:
        """Read the noun phrases of the instruction: the place of each, and the place after it."""
        if self._read is None:
            self._read = noun_phrases(self._words, self._there)
        return self._read


def noun_phrases(words: Sequence[str], there: Referents) -> list[tuple[int, Phrase, int]]:
    """Read the noun phrases of an instruction: the place of each, and the place after it."""
    found = list[tuple[int, Phrase, int]]()
    parser, at = PhraseParser(words, there), 0
    while at < len(words):
        begins = words[at] in _BEGINNINGS or not at or not words[at - 1].isalnum()
        read = parser.at(at) if begins else None
        named = read is not None and read[0].noun and there.is_noun(read[0].noun[-1])
        telling = read is not None and (named or (read[0].tests and not read[0].bare))
        if read is None or not telling or read[0].kind != "objects" or read[0].other:
            at += 1
            continue
        found.append((at, *read))
        at = max(read[1], at + 1)
    return found

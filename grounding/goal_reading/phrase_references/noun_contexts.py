"""Find the nouns that an instruction offers to a phrase without one: "of the pens, the far one"."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grounding.goal_reading.phrase_references.adjectives import colours_of
from grounding.goal_reading.phrase_references.phrase import Phrase, Test
from grounding.goal_reading.phrase_references.scene_nouns import GENERAL, SceneNouns
from grounding.goal_reading.phrase_references.selection import Selection


class NounContexts:
    """The nouns of one instruction.

    Args:
        words: of the instruction, as `plain_words` divides it.
        nouns: of the scene.
        selection: chooses the objects of a colour.
    """

    def __init__(self, words: Sequence[str], nouns: SceneNouns, selection: Selection) -> None:
        self._words, self._nouns, self._selection = tuple(words), nouns, selection

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
        placed = phrase.rank is not None or all(each[0].kind == "place" for each in phrase.tests)
        after = range(place + len(phrase.text.split()), 0 if placed else len(self._words))
        coloured = any(each[0].kind == "colour" for each in phrase.tests)
        for n in (*before, *after):
            yield from (base for base in self._meant(n, coloured) if len(base) > 1)

    def says_colour(self) -> bool:
        """Tell whether the instruction speaks of colours, so that "the warm ones" are those of a warm colour."""
        return any(word in ("colour", "colours", "coloured", "hues", "shades") for word in self._words)

    def told_before(self, place: int) -> bool:
        """Tell whether some of the objects were named before a place, so that "these" may mean them."""
        for word in self._words[:place]:
            if colours_of(word.removesuffix("s")) is not None:
                return True
            if self._nouns.is_noun(word) and word not in GENERAL:
                meant = self._nouns.meanings(word)
                if meant and len(meant[0]) < self._nouns.count:
                    return True
        return False

    def _meant(self, n: int, coloured: bool) -> Iterator[Sequence[int]]:
        """List what a word may mean: with the colour before it, "the green block", and without."""
        word, before = self._words[n], self._words[n - 1] if n else ""
        following = self._words[n + 1] if n + 1 < len(self._words) else ""
        named = self._nouns.is_noun(word) and word not in GENERAL
        meant = self._nouns.meanings(word)[:1] if named else [self._nouns.everything()]
        base = meant[0] if meant else ()
        colour = before if named or word in ("one", "ones") else word.removesuffix("s")
        next_named = self._nouns.is_noun(following) or following in GENERAL or following in ("one", "ones")
        ends = named or word in ("one", "ones") or not next_named
        if not coloured and ends and colours_of(colour) is not None:
            yield self._selection.fitting(Phrase("", tests=((Test("colour", colour),),)), base)
        if named:
            yield base

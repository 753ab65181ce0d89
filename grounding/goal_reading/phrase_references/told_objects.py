"""Find what "that one" and "those three" mean: what the instruction named before, in the goal or beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from grounding.goal_reading.phrase_references.choice_errors import Doubt, NothingFits
from grounding.goal_reading.phrase_references.phrase import Phrase
from grounding.goal_reading.phrase_references.phrase_parser import PhraseParser
from grounding.goal_reading.phrase_references.said_phrases import SaidPhrases
from grounding.goal_reading.phrase_references.scene_nouns import SceneNouns

# With these a noun phrase begins for certain: "can" may be a verb.
_BEGINNINGS = frozenset("the a an my your our his her their this that these those both one two three four five".split())


class ToldObjects:
    """What one instruction names before a phrase.

    Args:
        words: of the instruction, as `plain_words` divides it.
        nouns: of the scene.
        said: the phrases of the goal.
        find: finds the objects of a phrase.
    """

    def __init__(
        self, words: Sequence[str], nouns: SceneNouns, said: SaidPhrases, find: Callable[[Phrase], list[int]]
    ) -> None:
        self._words, self._nouns, self._said, self._find = tuple(words), nouns, said, find
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

    def several(self, count: int) -> list[int]:
        """Return the objects, as many as that, which were named last, together or one by one; empty where in doubt."""
        before = self._before()
        if None in before:
            return []
        singles: list[int] = []
        for found in reversed(before):
            if len(found or ()) > 1:
                break
            singles = list(dict.fromkeys((*(found or ()), *singles)))
        together = [found for found in before if found and len(found) > 1][-1:]
        fits = [each for each in (*together, singles) if len(each) == count]
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
        except NothingFits:
            return []  # it speaks of something else: "the table"
        except Doubt:
            return None

    def _phrases(self) -> list[tuple[int, Phrase, int]]:
        """Read the noun phrases of the instruction: the place of each, and the place after it."""
        if self._read is None:
            self._read = []
            parser, at = PhraseParser(self._words, self._nouns), 0
            while at < len(self._words):
                read = parser.at(at) if self._words[at] in _BEGINNINGS else None
                telling = read is not None and (read[0].noun or (read[0].tests and not read[0].bare))
                if read is None or not telling or read[0].kind != "objects" or read[0].other:
                    at += 1
                    continue
                self._read.append((at, *read))
                at = max(read[1], at + 1)
        return self._read

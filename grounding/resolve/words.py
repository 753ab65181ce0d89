"""Take the words for objects as they are, where nothing is known of what is there."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.resolve.errors import ResolveError
from grounding.resolve.phrase import Phrase, PhraseGroup
from grounding.resolve.phrase_parser import PhraseParser
from grounding.resolve.phrase_words import plain_words
from grounding.resolve.referents import Referents

_JOINTS = re.compile(r"\s*(?:,|\+|&|\b(?:and|plus)\b)\s*(?:and\b\s*)?", re.IGNORECASE)
_ARTICLE = re.compile(r"(?:(?:the|an?|my|all|your|our)\s+)+(?=\S)", re.IGNORECASE)


class WordPhrases:
    """The copied phrases of one goal where no objects are known.

    Args:
        there: what is there: nothing that is known.

    Attributes:
        phrases: that were read last.
        notes: none.
    """

    def __init__(self, there: Referents) -> None:
        self._there = there
        self.phrases: list[Phrase] = []
        self.notes: list[str] = []

    def resolve(self, groups: Sequence[PhraseGroup]) -> list[list[str] | None | Exception]:
        """Return for each group its words; `None` for a structure of everything; or what is in the way."""
        others = [group.role != "kept" for group in groups].count(True) > 1
        return [self._words(group, others) for group in groups]

    def _words(self, group: PhraseGroup, others: bool) -> list[str] | None | Exception:
        found = list[str]()
        for text in group.texts:
            for words in self._divided(text):
                phrase = self._one(words)
                kind = phrase.kind if phrase is not None else "objects"
                several = phrase is not None and phrase.plural and not others
                everything = kind in ("all", "rest") or (kind == "pronoun" and several)
                without = phrase is not None and phrase.without
                if everything and group.role == "structure" and len(group.texts) == 1 and not without:
                    return None
                if kind == "pronoun":
                    return ResolveError(f"it is not clear what {words!r} refers to")
                found.append(_ARTICLE.sub("", words, count=1) if kind == "objects" and _ARTICLE.match(words) else words)
        return list(dict.fromkeys(found))

    def _divided(self, text: str) -> list[str]:
        """Divide "the mug and the bowl"; "the red and blue mugs" stay together."""
        pieces = _JOINTS.split(text.strip())
        read = [self._one(piece) for piece in pieces]
        apart = all(each is not None and each.noun and each.kind == "objects" for each in read)
        return pieces if apart else [" ".join(text.split())]

    def _one(self, words: str) -> Phrase | None:
        read = PhraseParser(plain_words(words, str), self._there).phrases()
        if read is None or len(read) > 1:
            return None
        self.phrases.append(read[0])
        return read[0]

"""Read copied noun phrases: "the taller of the two cans", "whatever is red", "all cups except the red one"."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from grounding.resolve.clauses import clauses_after
from grounding.resolve.determiners import OWNERS, determiners_at
from grounding.resolve.head_nouns import COMPARED, behind_noun, head_at
from grounding.resolve.measures import COUNTS
from grounding.resolve.phrase import Draft, Phrase
from grounding.resolve.phrase_text import PhraseText
from grounding.resolve.place_words import sides_at, universal_at
from grounding.resolve.premodifiers import adjectives_at
from grounding.resolve.referents import Referents

_JOINTS = ("and", ",", "or", "plus")
_ANY = frozenset("whatever what anything everything all whichever something".split())
_THOSE = (("that", "which"), ("those", "that"), ("those", "which"), ("such", "as"))
# What may follow "everything" without choosing from it.
_AFTER_ALL = frozenset("and , except but bar save without minus excluding barring not apart aside with or".split())


class PhraseParser:
    """A reader of copied noun phrases.

    Args:
        words: of the phrase, as `plain_words` divides it.
        there: what is there.
    """

    def __init__(self, words: Sequence[str], there: Referents) -> None:
        self.text = PhraseText(tuple(words), there)
        self._read: dict[tuple[int, bool], tuple[Phrase, int] | None] = {}  # a place is read for many clauses

    @property
    def words(self) -> tuple[str, ...]:
        """Return all words."""
        return self.text.words

    def word(self, place: int) -> str:
        """Return the word at a place; empty after the last."""
        return self.text.word(place)

    def phrases(self) -> list[Phrase] | None:
        """Read all phrases, "the mug and the bowl"; `None` where a word is not understood."""
        found: list[Phrase] = []
        at = 0
        while at < len(self.words):
            if found and self.word(at) in _JOINTS:
                at += 1
                continue
            listed = not found or self.word(at - 1) in _JOINTS or self.text.here(at)  # "fork knife spoon"
            read = self.at(at) if listed else None
            if read is None:
                return None
            found.append(read[0])
            at = read[1]
        return found or None

    def at(self, place: int, excepting: bool = True) -> tuple[Phrase, int] | None:
        """Read the phrase that begins at a place.

        Args:
            place: of its first word.
            excepting: whether it may leave something out itself.

        Returns:
            The phrase and the place after it, or `None`.
        """
        key = (place, excepting)
        if key not in self._read:
            self._read[key] = None  # a phrase does not hold itself
            self._read[key] = self._phrase(place, excepting)
        return self._read[key]

    def _phrase(self, place: int, excepting: bool) -> tuple[Phrase, int] | None:
        draft = Draft()
        at = self._whole(place, draft)
        if at is None:
            draft = Draft()
            at = self._noun_phrase(place, draft)
        if at is None:
            return None
        end = clauses_after(self, draft, at, excepting)
        if draft.bare and draft.count is None and not draft.chooses:
            return None
        return draft.finished(" ".join(self.words[place:end])), end

    def _noun_phrase(self, place: int, draft: Draft) -> int | None:
        at = adjectives_at(self.text, determiners_at(self.text, place, draft), draft)
        end = head_at(self.text, at, draft)
        if end is None:
            pointing = (draft.demonstrative or draft.every) and at < len(self.words)
            free = at == len(self.words) or self.word(at) == "of"  # "nine", "two of the cups"
            counted = draft.count is not None and (draft.definite or draft.every or free)
            compared = draft.definite and at > place and self.word(at) in COMPARED
            leading = compared and sides_at(self.words, at) is not None  # "the nearest to the edge"
            if not (draft.chooses or pointing or counted or leading):
                return None
            draft.borrowed = draft.bare = True
            draft.plural = True if draft.every and draft.count is None else draft.plural
            end = at
        return behind_noun(self.text, end, draft)

    # Phrases for everything

    def _whole(self, place: int, draft: Draft) -> int | None:
        """Read "the whole lot", "the others", "whatever"; return the place after it."""
        found = universal_at(self.words, place)
        if found is not None and not (found[0] == "all" and self._goes_on(found[1])):
            return self._universal(place, *found, draft)
        pair = self.words[place : place + 2]
        if self.word(place) in _ANY:
            return self._whatever(place, draft)
        if pair not in _THOSE:
            return None
        draft.plural = None if pair[0] == "that" else True
        draft.every = draft.plural is True
        return place + 1

    def _universal(self, place: int, kind: str, end: int, draft: Draft) -> int:
        draft.kind = kind
        draft.plural = kind != "pronoun" or self.words[place] in ("them", "they", "these", "those", "this")
        draft.plural = draft.plural and self.words[end - 1] != "one"
        numbers = [COUNTS[word] for word in self.words[place:end] if word in COUNTS and word not in ("one", "a")]
        draft.count = numbers[0] if numbers else None
        if kind == "others":
            draft.kind, draft.other, draft.borrowed = "objects", True, True
        if self.word(end) == "of" and kind in ("rest", "others") and (of := self.at(end + 1)) is not None:
            draft.kind, draft.other, draft.borrowed, draft.among = "objects", True, False, of[0]
            return of[1]
        return end

    def _goes_on(self, at: int) -> bool:
        """Return whether a word for everything is followed by what chooses: "all | the red cups", "all | seven"."""
        if self.word(at) == "other":
            return self.word(at + 1) != "than"
        return at < len(self.words) and self.word(at) not in _AFTER_ALL

    def _whatever(self, place: int, draft: Draft) -> int | None:
        """Read "whatever", "whichever cup" or "anything"; return the place before the clause."""
        word, at = self.word(place), place + 1
        if self.word(at) == "else" and word in ("whatever", "anything", "everything"):
            draft.other, at = True, at + 1  # "whatever else is made of tin"
        if word == "all":
            draft.every = draft.plural = True
            return at if self.word(at) in ("that", "which", "what") else None
        if word in ("what", "whatever"):
            draft.open = True
            return at if self.word(at) != "of" else None
        if word == "whichever":
            end = self._noun_phrase(at + (self.word(at) == "of"), draft)
            draft.plural, draft.open = False, True
            return end
        draft.every = word in ("everything", "anything")
        draft.plural = True if draft.every else None
        return behind_noun(self.text, at, draft)


def coordinated(phrases: Sequence[Phrase], takes: Callable[[Phrase, Phrase], bool]) -> list[Phrase]:
    """Give the phrases of one list the nouns that they leave out.

    Args:
        phrases: as they follow each other.
        takes: tells whether there is something of the second phrase's noun that the first can mean.
    """
    found = list(phrases)
    for n in range(len(found) - 1, -1, -1):
        if found[n].bare and found[n].kind == "objects" and found[n].among is None:
            following = next((each for each in found[n + 1 :] if not each.bare and each.kind == "objects"), None)
            model = following or next((each for each in reversed(found[:n]) if each.noun), None)
            if model is not None and takes(found[n], model):
                found[n] = _like(found[n], model)
    every = False
    for n, phrase in enumerate(found):
        if every and phrase.noun and not phrase.plural and phrase.count is None and not phrase.tests:
            found[n] = replace(phrase, every=True, plural=True)  # "every cup + can"
        every = every or phrase.every
    return found


def _like(phrase: Phrase, model: Phrase) -> Phrase:
    """Give a bare phrase the noun of another one, and its colours where it names none."""
    plural, own = phrase.plural, model.text.split()[0] in OWNERS and phrase.text.split()[0] not in OWNERS
    if plural is None and phrase.count is None:
        plural = True if model.plural else None if own else False  # "yellow, green and the orange block"
    coloured = any(each[0].kind == "colour" for each in phrase.tests)
    colours = () if coloured else tuple(each for each in model.tests if each[0].kind == "colour")
    return replace(
        phrase,
        noun=model.noun,
        bare=plural is None and phrase.count is None,
        borrowed=model.borrowed,
        plural=plural,
        tests=(*phrase.tests, *colours),
    )

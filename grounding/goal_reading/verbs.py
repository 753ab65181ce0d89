"""Read the verbs of an instruction, in all their forms, and tell those of other work than placing."""

from __future__ import annotations

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.goal_reading.verb_words import IRREGULAR_FORMS, OTHER_ACTS, OTHER_WORK, VERB_PHRASES, VERBS

_DETERMINERS = frozenset("the a an my your our its their one".split())
_ENDINGS = (("ing", ""), ("ing", "e"), ("ed", ""), ("ed", "e"), ("s", ""), ("es", ""), ("ied", "y"), ("ies", "y"))
_PARTICLES = ("up", "out", "down")
_AROUND = ("around", "round", "about", "over")
# What begins the object of a verb. An adjective that is a verb too ("clean cups") needs one of these after it.
_OPENERS = frozenset("the a an my your our all both every each this that these those it them me us some".split())
_ABOUT = frozenset("a an about exactly roughly around some good full clear at least gap space distance of approximately just".split())
_JOINTS = ("and", "comma", "stop", "then", "correction")


def stem_of(word: str) -> str | None:
    """Return the verb that a word is a form of; `None` where it is none that goals are said with."""
    if word in VERBS:
        return word
    if word in IRREGULAR_FORMS:
        return IRREGULAR_FORMS[word]
    for ending, instead in _ENDINGS:
        if not word.endswith(ending):
            continue
        stem = word.removesuffix(ending) + instead
        if len(stem) > 2 and stem[-1:] == stem[-2:-1] and stem not in VERBS:
            stem = stem[:-1]
        if stem in VERBS:
            return stem
    return None


class VerbReader:
    """A reader of verbs.

    Args:
        said: the words.
        phrases: reads the noun phrases among them.
    """

    def __init__(self, said: Words, phrases: NounPhraseReader) -> None:
        self.said, self.phrases = said, phrases

    def at(self, place: int, before: list[Chunk]) -> list[Chunk]:
        """Read the verb that begins at a place: a list of one chunk, or of none.

        Its kind is "verb"; "noise" for a form that repeats what another word asks for ("placed"); "work" for a verb of
        other work than placing.
        """
        said, word = self.said, self.said.word(place)
        if said.word(place - 1) in _DETERMINERS and said.words[max(0, place - 2) : place] != ("for", "one"):
            return []
        if stem_of(word) == "leave" and self._gap(place + 1):
            return [Chunk("noise", True, place, place + 1)]
        for length in (4, 3, 2):
            stem = stem_of(word) or word
            kind = VERB_PHRASES.get(" ".join((stem, *said.words[place + 1 : place + length])))
            if place + length <= len(said.words) and kind is not None:
                said_before = word != stem and kind in ("place", "make", "take") and bool(before)
                return [Chunk("noise" if kind == "noise" or said_before else "verb", kind, place, place + length)]
        if word in ("turn", "transform", "convert", "morph") and self._into(place):
            return [Chunk("verb", "place", place, place + 1)]
        stem = stem_of(word)
        if stem is not None and self.needed(place):
            return [Chunk("verb", VERBS[stem], place, place + 1)]
        if stem is not None:
            return self._known(place, stem, before)
        return self._work(place, before)

    def _known(self, place: int, stem: str, before: list[Chunk]) -> list[Chunk]:
        said, word, kind = self.said, self.said.word(place), VERBS[stem]
        particle = kind != "cluster" and said.word(place + 1) in _PARTICLES and said.word(place + 2) != "of"
        end = place + 1 + particle
        if kind == "surround" and word in ("circle", "ring") and self.phrases.at(end) is None:
            return []
        if word != stem and kind in ("place", "make", "take"):
            if before:
                return [Chunk("noise", kind, place, end)]
            return [Chunk("verb", kind, place, end)] if word.endswith("ing") else []
        return [Chunk("verb", kind, place, end)]

    def needed(self, place: int) -> bool:
        """Tell whether the word is a verb after "needs": "the bottle needs setting at the back"."""
        return self.said.word(place - 1) in ("needs", "need", "wants", "requires", "require") and self.said.word(place).endswith("ing")

    def _gap(self, place: int) -> bool:
        """Return whether a length follows: "leave about 5 cm between them"."""
        words = self.said.words[place : place + 5]
        return LENGTH in words and all(word in _ABOUT for word in words[: words.index(LENGTH)])

    def _into(self, place: int) -> bool:
        pairs = zip(self.said.words[place : place + 9], self.said.words[place + 1 : place + 10], strict=False)
        return any(pair in (("into", "a"), ("into", "an"), ("into", "one")) for pair in pairs)

    def particle(self, place: int, before: list[Chunk]) -> Chunk | None:
        """Read "around" in "swap the mugs around": a particle of the verb, where nothing follows that it could stand by."""
        if self.said.word(place) not in _AROUND or self.phrases.at(place + 1) is not None:
            return None
        clause = [one for one in before if one.kind in ("verb", "stop", "then")][-1:]
        swaps = bool(clause) and clause[0].value == "swap"
        return Chunk("noise", True, place, place + 1) if swaps and before[-1].kind == "noun phrase" else None

    def _work(self, place: int, before: list[Chunk]) -> list[Chunk]:
        said, word = self.said, self.said.word(place)
        last = next((one for one in reversed(before) if one.kind != "noise"), None)
        if last is not None and last.kind not in _JOINTS:
            return []
        if word in OTHER_ACTS and (self.phrases.at(place + 1) is None or said.word(place + 1) in ("a", "around")):
            return [Chunk("work", word, place, place + 1)]
        if word not in OTHER_WORK or said.word(place - 1) in ("i", "we", "they", "you're", "not", "to"):
            return []
        if word in self.phrases.forms and said.word(place + 1) in ("in", "on", "at"):
            return []  # "hammer in the box", where a hammer is on the table
        at = place + 1 + (said.word(place + 1) in ("up", "out", "down", "off", "over", "away", "at", "in", "on"))
        return [Chunk("work", word, place, place + 1)] if self._object(at, word) else []

    def _object(self, at: int, verb: str) -> bool:
        """Return whether the object of a verb begins here: one that is known, a person, or the table."""
        said, opened = self.said, self.said.word(at) in _OPENERS
        if said.word(at) in ("me", "us") or (opened and said.word(at + 1) in ("table", "desk", "bench", "dishes")):
            return True
        phrase = self.phrases.at(at)
        if phrase is None or (phrase.mention is not None and not phrase.mention.known):
            return False
        return opened or (verb not in self.phrases.forms and verb not in _ADJECTIVES)


_ADJECTIVES = frozenset("clean dry open empty cool warm light cap label color colour cover shut heat tear".split())

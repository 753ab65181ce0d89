"""Find the heads of noun phrases: the words that name objects, and where their modifiers begin."""

from __future__ import annotations

from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.counts import JOINTS
from grounding.references.function_words import (
    AMBIGUOUS,
    DETERMINERS,
    FUNCTION_WORDS,
    GENERIC,
    NOT_OBJECTS,
    NUMBERS,
    ORDINALS,
    WHAT_FOLLOWS_OBJECTS,
)
from grounding.references.lexicon import ADJECTIVES, COLOURS, STUFF, USES
from grounding.references.phrases import ANY, Mention, Vocabulary
from grounding.references.sentence_roles import STOPS, Sentences
from grounding.references.unknown_nouns import MOST_MODIFIERS, unknown_phrase
from grounding.references.word_forms import singular

_SUBJECTS = frozenset("i you we it they he she one that which who someone".split())
ANY_THINGS = frozenset(word for word, kind in GENERIC.items() if kind != "one") - {"ones", "lot", "bits"}
_BEFORE_NOUNS = DETERMINERS | frozenset(NUMBERS)
USE_VERBS = frozenset(verb for verb, _ in USES)
ANYTHING = frozenset(GENERIC) | {"what", "whatever", "anything"}


class HeadFinder:
    """The search for heads of noun phrases in one instruction.

    Args:
        said: the words of the instruction.
        vocabulary: the nouns that are known.
    """

    def __init__(self, said: Sentences, vocabulary: Vocabulary) -> None:
        self.said, self.words = said, said.words
        self.vocabulary, self.forms = vocabulary, vocabulary.forms

    def find(self, place: int, last: tuple[int, Mention] | None) -> tuple[int, int, str, bool, bool] | None:
        """Return (start of modifiers, head, noun, plural, known) of the phrase with its head at `place`, if any."""
        word = self.words[place]
        if use := self.use_group(place):
            end = place + (self.said.word(place + 1) in ("from", "with", "out", "off"))
            return place, end, use, True, True
        if word in GENERIC and not self._in_a_name(place):
            return self._generic(place)
        if word in self.forms and not self._no_noun(place):
            noun, many = self.forms[word]
            return self._first_modifier(place), place, noun, many, True
        return unknown_phrase(self.said, place, self._listed(place, last))

    def use_group(self, place: int) -> str | None:
        """Return the group of nouns in "(anything I can) drink from", or `None`."""
        word = self.words[place]
        if word not in USE_VERBS or not any(w in ANYTHING for w in self.words[max(0, place - 6) : place]):
            return None
        return USES.get((word, self.said.word(place + 1))) or USES.get((word, ""))

    def _generic(self, place: int) -> tuple[int, int, str, bool, bool] | None:
        word = self.words[place]
        start = self._first_modifier(place)
        if GENERIC[word] == "stuff" and STUFF.get(self.said.word(place - 1)):
            return place - 1, place, STUFF[self.said.word(place - 1)], True, True
        if word == "lot" and self.said.word(place - 1) not in ("the", "whole"):
            return None  # "a lot more"
        many = GENERIC[word] != "one"
        if word == "one" and (start == place or self.said.word(start - 1) != "the"):
            return None  # a number, or a structure: "a big one"
        counted = self.said.word(start - 1) in NUMBERS or self.said.word(place + 1).isdecimal()
        if not many and word != "one" and start == place and not counted:
            return None  # "the thing"
        if word in ANY_THINGS and self.said.word(place + 1) in COLOURS:
            return place, place + 1, ANY, True, True  # "everything red"
        return start, place, ANY, many, True

    def _no_noun(self, place: int) -> bool:
        """Return whether this known noun is not a noun here, but a verb, an adjective or the first part of a compound.
        """
        word, before, after = self.words[place], self.said.word(place - 1), self.said.word(place + 1)
        if self._compound(place):
            return True
        if (word in ADJECTIVES and after in GENERIC) or (after in ADJECTIVES and self._singular(place)):
            return True  # "the orange things", "the extra large clamp"
        if word == "bit":
            return True  # "a bit to the left" is no drill bit; the plural is
        if word in AMBIGUOUS:
            described = (
                before in _BEFORE_NOUNS
                or before in TELLING_ADJECTIVES
                or (before in self.forms and before != "can")
                or after.isdecimal()  # "box 1"
                or self._in_a_name(place - 1)
            )
            listed = self.forms[word][0] in self.vocabulary.heads and (before in JOINTS or after in JOINTS)
            if not (described or listed) or (after.isalpha() and self.said.describes(place + 1)):
                return True  # a verb, or "the book club"
        if self._singular(place) and singular(after) != after and self.said.describes(place + 1):
            return True  # "beer mats"
        if GENERIC.get(after) == "stuff":
            return True
        if word == "can":
            ends = after in FUNCTION_WORDS and after not in WHAT_FOLLOWS_OBJECTS
            subject = before in _SUBJECTS
            return place == 0 or subject or before in STOPS or (ends and before not in DETERMINERS)
        return word in NOT_OBJECTS and not self.forms[word][1]

    def _in_a_name(self, place: int) -> bool:
        """Return whether the name of an object has this word before the next one: "gear box"."""
        word, after = self.said.word(place), self.said.word(place + 1)
        return (word, self.forms.get(after, (after, False))[0]) in self.vocabulary.compounds

    def _compound(self, place: int) -> bool:
        """Return whether this word is the first part of a compound, as in "soup can", but not "forks knives"."""
        word, after = self.words[place], self.said.word(place + 1)
        if after not in self.forms or self._no_noun_alone(place + 1):
            return False
        if not self._singular(place):
            return False
        noun = self.forms[word][0]
        pair, heads = (noun, self.forms[after][0]), self.vocabulary.heads
        separate = noun in heads and pair[1] in heads and pair not in self.vocabulary.compounds
        # "apple banana carrot" are three things only where no article speaks of one.
        return (
            not separate
            or word in ADJECTIVES
            or self.said.word(self._first_modifier(place) - 1) in DETERMINERS
        )

    def _singular(self, place: int) -> bool:
        return self.forms[self.words[place]][0] == self.words[place]

    def _no_noun_alone(self, place: int) -> bool:
        """Return whether a known noun that could end a compound does not, as in "robot cups can ..."."""
        return (
            self.words[place] == "can" and self.said.word(place + 1) in FUNCTION_WORDS - WHAT_FOLLOWS_OBJECTS
        )

    def _first_modifier(self, place: int) -> int:
        start = place
        while start > 0 and place - start < MOST_MODIFIERS and self.said.describes(start - 1):
            start -= 1
        before = self.said.word(start - 1)
        if before in _BEFORE_NOUNS or before in ORDINALS or before.isdecimal():
            return start
        # Without an article, what stands before may be anything: "pls stak wooden blocks".
        while start < place and self.words[start] not in TELLING_ADJECTIVES and self.words[start] not in self.forms:
            start += 1
        return start

    def _listed(self, place: int, last: tuple[int, Mention] | None) -> str:
        """Return the "," or "and" that joins this to the objects before it; empty if there is none."""
        if not last or last[1].role != "target" or self.words[place] in FUNCTION_WORDS - DETERMINERS:
            return ""
        between = self.words[last[0] + 1 : place]
        return between[-1] if 0 < len(between) < 3 and all(w in (",", "and", "&") for w in between) else ""

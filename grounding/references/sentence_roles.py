"""Determine the role of an instruction's words: requested, left out, or only mentioned in passing."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.references.attributes import COMPARATIVES, TELLING_ADJECTIVES
from grounding.references.function_words import (
    ALL_WORDS,
    ARRANGING,
    CUES,
    DETERMINERS,
    ENDS_OF_LEAVING,
    EXCEPTIONS,
    FUNCTION_WORDS,
    GAPS,
    GENERIC,
    LANDMARK_PREPOSITIONS,
    NOT_OBJECTS,
    NUMBERS,
    PLACE_ADJECTIVES,
    SHAPE_WORDS,
    SIDES,
    STAYING,
    TELLING,
    WHAT_FOLLOWS_LEFT_OUT,
)
from grounding.references.lexicon import ADJECTIVES
from grounding.references.word_forms import FORMS

STOPS = frozenset(".;!?\n")


class Sentences:
    """The words of an instruction, punctuation among them.

    Args:
        words: in small letters.
        forms: word -> (singular, whether it means all of its kind), for the nouns that are known.

    Attributes:
        narrated: for each word, whether its sentence only reports something, such as "the mugs came in a parcel".
    """

    def __init__(self, words: list[str], forms: Mapping[str, tuple[str, bool]]) -> None:
        self.words, self.forms = words, forms
        self.narrated = self._narrated_words()

    def word(self, place: int) -> str:
        """Return the word at a place; empty before the first and after the last."""
        return self.words[place] if 0 <= place < len(self.words) else ""

    def describes(self, place: int) -> bool:
        """Tell whether this word may stand between an article and a noun."""
        word = self.words[place]
        if word in ADJECTIVES or (word in self.forms and self.forms[word][0] == word):
            return word not in SHAPE_WORDS
        if word in COMPARATIVES and self.word(place - 1) in ("the", "two", "both"):
            return True  # "the taller cans"; but "make it taller"
        if (
            word in PLACE_ADJECTIVES
            and self.word(place - 1) in DETERMINERS
            and self.word(place - 2) not in LANDMARK_PREPOSITIONS
        ):
            after = self.word(place + 1 + (self.word(place + 1) in NUMBERS))  # "the left cups", "the left three cups"
            return after in self.forms or after in GENERIC
        if word == "sized" and self.word(place - 1) in TELLING_ADJECTIVES:
            return True
        if word in TELLING_ADJECTIVES and word in FUNCTION_WORDS:  # "big cups"; but "a big circle", "spread them wide"
            after = self.word(place + 1 + (self.word(place + 1) == "sized"))
            return after in TELLING_ADJECTIVES or after in self.forms or after in GENERIC
        content = word.isalpha() and word not in FUNCTION_WORDS and word not in NOT_OBJECTS
        return content and word not in self.forms and word not in GENERIC and word not in TELLING

    def landmark(self, first: int) -> bool:
        """Tell whether the words before a noun only say where, when, how or for whom."""
        before, earlier = self.word(first - 1), self.word(first - 2)
        if before == "of":
            return earlier in SIDES
        if before == "from":
            return earlier in ("away", "far", "across", "back")
        if before == "to":
            return earlier in ("next", "close", "closer", "nearer", "opposite", "due")
        if before == "for":
            return first > 1 and earlier not in STOPS and self.word(first) not in ("all", "both", "each")
        if before in ("between", "among", "amongst"):  # "some room between the cups"
            return not any(w in GAPS for w in self.words[max(0, first - 5) : first])
        if before == "like" and earlier in ("i'd", "would", "we'd", "you'd"):
            return False
        if before == "with" and earlier == "careful":
            return True
        return before in LANDMARK_PREPOSITIONS

    def exception(self, first: int) -> str:
        """Return the words before `first` that exclude the objects after it; empty if there are none."""
        for length in (4, 3, 2, 1):
            said = " ".join(self.words[max(0, first - length) : first])
            if first < length or said not in EXCEPTIONS:
                continue
            if said == "but":
                # "nothing but the cups"; "not the cups but the bowls"; "a circle, but the cups ..."
                earlier = self.words[max(0, first - 8) : first - 1]
                inclusive = bool(earlier) and earlier[-1] in ("nothing", "none", "anyone")
                general = any(w in ALL_WORDS or w in GENERIC or w in self.forms for w in earlier)
                return said if general and not inclusive and "not" not in earlier else ""
            if said in ("except", "except for") and self.word(first - length - 1) in ("nothing", "none"):
                return ""
            return said
        return ""

    def left_alone(self, end: int, kept: bool) -> bool:
        """Return whether the words after a noun exclude it, as in "the bowl stays where it is" or "leave the bowl
        alone".

        Args:
            end: the place after the noun.
            kept: whether the noun is what should be left or kept.
        """
        after = self.words[end : end + 4]
        if kept and (not after or after[0] in ENDS_OF_LEAVING):
            return True
        if after[:1] and after[0] in ("can", "should", "may", "must", "to", "just", "will"):
            after = after[1:]
        if after[:1] and after[0] in STAYING and (len(after) < 2 or after[1] in WHAT_FOLLOWS_LEFT_OUT):
            return True
        if after[:2] == ["out", "of"] and after[2:3] in (["the"], ["it"], ["this"], ["there"], ["my"]):
            rest = self.words[end + 4 :]
            # "... out of the way? into the corner with them": they are what is placed
            placed = not {"it", "them", "they"}.isdisjoint(rest) and not any(word in FORMS for word in rest)
            return (self.word(end + 3) in ("way", "hair") and not placed) or after[2] in ("it", "this", "there")
        if after[:1] in (["is"], ["are"]):
            after = after[1:]
        if not after or after[0] not in ("not", "isn't", "aren't"):
            return False
        return any(w in ("needed", "wanted", "required", "included", "part", "necessary") for w in after[1:3])

    # Sentences that only report something

    def _narrated_words(self) -> list[bool]:
        narrated = [False] * len(self.words)
        start = 0
        for place in range(len(self.words) + 1):
            if place == len(self.words) or self.words[place] in (*STOPS, ":") or self._new_thought(place):
                self._mark_narrated(start, place, narrated)
                start = place + 1
        return narrated

    def _new_thought(self, place: int) -> bool:
        return self.words[place] == "," and self.word(place + 1) in (
            "so",
            "then",
            "therefore",
            "hence",
            "because",
        )

    def _mark_narrated(self, start: int, end: int, narrated: list[bool]) -> None:
        reason = False
        for place in range(start, end):
            reason = (reason and self.words[place] != ",") or self._reason(place)
            narrated[place] = narrated[place] or reason
        if not self._telling(start, end):
            return
        if not self._cued(start, end):
            narrated[start:end] = [True] * (end - start)
            return
        first = start
        for place in range(start, end + 1):
            if place == end or self.words[place] == ",":
                if self._telling(first, place) and not self._cued(first, place):
                    narrated[first:place] = [True] * (place - first)
                first = place + 1

    def _reason(self, place: int) -> bool:
        """Return whether a clause starts here that gives a reason, a condition or a purpose."""
        if self.words[place] == "so":
            after = place + 1 + (self.word(place + 1) == "that")
            return (
                self.word(after) in ("i", "we", "he", "she", "nobody", "people")
                and "can" in self.words[after : after + 3]
            )
        opening = place == 0 or self.words[place - 1] in STOPS or self.words[place - 1] in (",", "and", "but")
        return self.words[place] in ("because", "whenever") or (
            opening and self.words[place] in ("if", "when", "since", "while", "although", "though", "as")
        )

    def _telling(self, start: int, end: int) -> bool:
        return any(
            self.words[place] in TELLING
            or (self.words[place].endswith("ed") and self.word(place - 1) in ("i", "we", "he", "she", "they"))
            for place in range(start, end)
        )

    def _cued(self, start: int, end: int) -> bool:
        """Return whether something is asked for between these places."""
        for place in range(start, end):
            word, before = self.words[place], self.word(place - 1)
            if word in ARRANGING and before not in ("i", "he", "she", "they", "we", "who"):
                return True
            if word in CUES or word in SHAPE_WORDS:
                return True
        return False

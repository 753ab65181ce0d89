"""Find subordinate clauses and adverbials that carry no wish: reasons, purposes, occasions, deadlines, conditions."""

from __future__ import annotations

import re

from grounding.goal_reading.aside_words import (
    ACTIVITIES,
    HANDLING,
    LOOSE,
    NO_PURPOSE,
    OCCASIONS,
    OWNERS,
    PERSONS,
    STABLE,
)
from grounding.goal_reading.clauses import ENDS, SPATIAL, Clauses
from grounding.goal_reading.tokens import Words
from grounding.goal_reading.verb_words import VERBS

_CONDITION = re.compile(
    r"(?:if|when|whenever|as soon as|once) (?:you(?:'re|'ve| are| have| can| could| would| will| get| find| feel| don't| may| want to help| please| do me| happen| know| manage)|it(?:'s| is| isn't|'s not| is not| pleases) (?:not |no |n't )?(?:too|to|at all|a|any|much|ok|okay|all right|alright|possible|you)|that(?:'s| is) (?:ok|okay|all right|alright|possible|fine)|(?:i|we) (?:had|were|was|could|weren't))(?= |$)"
)
# What is not so: "I'd have done it if it weren't for my knee".
_UNREAL = re.compile(
    r"if (?:(?:it|that|this|there) (?:weren't|wasn't|were not|was not|hadn't been|had not been)(?: for)?"
    r"|(?:it|that) (?:were|was) up to (?:me|us)|i (?:were|was) you)(?= )"
)
_REASON = frozenset(
    "because cause cuz coz since as seeing given considering due owing thanks whereas although though otherwise".split()
)
_ROOM = re.compile(
    r"so (?:that )?(?:(?:the|my|our|that) (?:\w+ ){1,3}?(?:is|are|stays?|remains?|will be|gets|becomes?|can stay)|there(?:'s| is| will be)|i have|i've got|we have|i get|we get|you have|they have|it leaves|this leaves)"
    r"(?: (?:nice and|still|all|completely|kept|left|enough|plenty of|some|more|lots of|a bit of|a little))* (?:free|clear|empty|open|available|accessible|unobstructed|room|space|tidy|clean|neat)(?= |$)"
)
_UNTIL = (("by", "the", "time"), ("in", "time", "for"))


class AdverbialClauses:
    """The reasons, purposes, occasions, deadlines and conditions of one instruction.

    Args:
        said: its words.
        clauses: its clauses.
    """

    def __init__(self, said: Words, clauses: Clauses) -> None:
        self.said, self._clauses = said, clauses

    def at(self, place: int) -> int | None:
        """Return the place after the longest one that begins at a word; `None` where none begins."""
        ends = [
            self._reason(place), self._room(place), self._purpose(place), self._occasion(place), self.condition(place),
            self._deadline(place),
        ]  # fmt: skip
        return max((end for end in ends if end is not None), default=None)

    def condition(self, place: int) -> int | None:
        """Read "if you have a minute", "when you get a chance", "if it's not too much trouble"."""
        if self.said.match(_UNREAL, place) is not None:
            end = self._clauses.end(place + 1)
            return end if not self._clauses.wishes(place, end, facts=True) else None
        if self.said.match(_CONDITION, place) is None:
            return None
        end = self._clauses.end(place + 2)
        if any(self.said.word(i) in ("done", "finished", "ready") for i in range(place, end)):
            return None  # "when you are done" says what comes after
        return end if not self._clauses.wishes(place, end) else None

    def _reason(self, place: int) -> int | None:
        """Read a clause that gives a reason: "because I am tired", "since my back hurts", "thanks to my cat"."""
        said, word = self.said, self.said.word(place)
        if word not in _REASON or said.word(place - 1) in ("same", "such", "soon", "well", "as", "far", "long"):
            return None
        first = place + 1
        while said.word(first) in ("that", "of", "to", "the", "fact") and not (
            said.word(first) == "the" and said.word(first + 1) != "fact"
        ):
            first += 1
        noun = said.word(place + 1) in ("of", "to")
        if word in ("thanks", "due", "owing") and not noun:
            return None
        end = self._clauses.end(first)
        if end == first:
            return None
        if noun:
            return end if not self._clauses.wishes(first, end) else None
        if word == "otherwise":
            return end if not self._clauses.wishes(first, end, facts=True) else None
        return end if self._clauses.about(first, end) else None

    def _room(self, place: int) -> int | None:
        """Read "so the front is free for my laptop", "so that I have room to work"."""
        match = self.said.match(_ROOM, place)
        if match is None:
            return None
        end = self._clauses.end(match[1]) if self.said.word(match[1]) in ("for", "to") else match[1]
        return end if self.said.word(end) in ("", "and", *ENDS) and not self._clauses.wishes(match[1], end, facts=True) else None

    def _purpose(self, place: int) -> int | None:
        """Read "so that I can reach them", "in order to save space", "to impress my boss"."""
        said = self.said
        words = said.words[place : place + 3]
        if words[:1] in (("so",), ("that",)) or words[:2] == ("in", "case"):
            first = place + 1 + (words[1:2] == ("that",)) + (words[0] == "in") if words[0] != "that" else place
            if words[0] == "that":
                return None
            end = self._clauses.end(first)
            if self._clauses.person(first) is not None:
                return end if self._clauses.about(first, end) else None
            rest = said.words[first + 1 : end]
            stable = said.word(first) in ("it", "they", "nothing", "everything", "nobody") and bool(rest) and all(
                word in STABLE or word in ("don't", "doesn't", "won't", "can't", "cannot", "not", "will", "do", "does", "it", "could", "might", "may") for word in rest
            )  # fmt: skip
            negated = (
                any(word.endswith("n't") or word in ("cannot", "not") for word in rest) or said.word(first) == "nothing"
            )
            return end if stable and negated and any(word in STABLE for word in rest) else None
        first = place + 3 if words == ("in", "order", "to") or words == ("so", "as", "to") else None
        first = (
            place + 1 + (words[0] in ("just", "simply", "only"))
            if first is None and (words[:1] == ("to",) or words[1:2] == ("to",) and words[0] in ("just", "simply"))
            else first
        )
        if first is None or said.word(first) not in ACTIVITIES:
            return None
        if said.word(place - 1) in (
            "want",
            "need",
            "like",
            "have",
            "going",
            "how",
            "where",
            "you",
            "able",
            "as",
            "has",
            "needs",
            "wants",
            "love",
            "ought",
            "used",
            "next",
            "close",
        ):
            return None
        verb, end = said.word(first), self._clauses.end(first + 1)
        if verb in LOOSE and said.word(first + 1) not in LOOSE[verb]:
            return None
        return end if not self._clauses.wishes(first, end, facts=verb in HANDLING) else None

    def _occasion(self, place: int) -> int | None:
        """Read "for my grandmother's birthday", "for the party tonight": an occasion or somebody."""
        said = self.said
        if (
            said.word(place) != "for"
            or said.word(place - 1)
            in "space room place spot gap look looking search wait except but save as care area".split()
        ):
            return None
        at = place + 1
        while said.word(at) in OWNERS or (
            said.word(at) in ("two", "three", "four", "five", "six", "ten", "many") and said.word(at + 1) in PERSONS
        ):
            at += 1
        first = at
        while at < len(said.words) and at - first < 6 and self._of_occasion(at, first):
            at += 1
        if (
            at == first
            or any(word in NO_PURPOSE for word in said.words[place + 1 : at])
            and not any(word in PERSONS for word in said.words[first:at])
        ):
            return None
        return at if not self._clauses.wishes(place + 1, at) else None

    def _of_occasion(self, at: int, first: int) -> bool:
        word = self.said.word(at)
        if word in ("of", "with", "and") and at > first:
            following = self.said.word(at + 1 + (self.said.word(at + 1) in OWNERS))
            return word == "of" or following in PERSONS
        if word in OWNERS and at > first:
            return self.said.word(at - 1) in ("of", "with", "and")
        known = word in VERBS and word not in ("display", "set", "show", "draw", "design", "order") and at == first
        return word.replace("'", "").isalpha() and word not in SPATIAL and not known and not (word in VERBS and self._clauses.request(at)) and word not in ENDS and word not in (
            "can", "could", "please", "put", "is", "are", "should", "must", "so", "then", "because", "which", "that", "i", "we", "you",
        )  # fmt: skip

    def _deadline(self, place: int) -> int | None:
        """Read "before my guests arrive", "by the time dinner is served": the arm works at once in any case."""
        said = self.said
        words = said.words[place : place + 3]
        first = place + 1 if words[:1] == ("before",) else place + 3 if words in _UNTIL else None
        if first is None:
            return None
        end = self._clauses.end(first)
        if self._clauses.person(first) is not None:
            return end if self._clauses.about(first, end) and end - first > 1 else None
        occasion = said.word(end - 1) in OCCASIONS and end - first < 4 or said.word(first) in ("it's", "it", "dinner", "lunch")
        return end if occasion and not self._clauses.wishes(first, end) else None

"""Find asides, which carry no wish: adverbial clauses, remarks, politeness, and what addresses the robot.

An aside is recognised by its structure: a subordinate clause that a word such as "because" or "so that" opens, a phrase
with "for", a name between the margin and a comma, a sentence about a person or a fact. It ends where its clause ends, or
where the next request begins. No aside holds a word that could be a wish (`WISHES`), a length, a shape or a place; where
one does, nothing is passed over, so that the words stay to be understood or refused.
"""

from __future__ import annotations

import re

from grounding.goal_reading.adverbial_clauses import AdverbialClauses
from grounding.goal_reading.aside_words import ADDRESS, INTERJECTIONS
from grounding.goal_reading.clauses import ENDS, STOPS, Clauses
from grounding.goal_reading.politeness import TAG, THANKS, polite_end
from grounding.goal_reading.remarks import Remarks
from grounding.goal_reading.tokens import Words
from grounding.goal_reading.verb_words import VERBS
from grounding.references.attributes import COLOR_WORDS
from grounding.references.phrases import Vocabulary

_HEADING = re.compile(
    r"(?:(?:the|your|my|our|new|next|first|second|third|last) )*(?:task|job|to do|todo|order|orders|mission|instruction|instructions|command|request|goal|note|plan|step|wish|assignment)"
    r"(?: (?:number )?(?:\d+|one|two|three|four))?(?= :)"
)
_TIDYING = re.compile(
    r"(?:please )?(?:rearrange|arrange|reorganize|reorganise|organize|organise|tidy|tidy up|clean|clean up|clear up|straighten up|straighten out|sort out|sort|set up|lay out|fix|change|redo)"
    r"(?: (?:the|this|my|our|all the|these|those) (?:\w+ )?(?:table|desk|things|objects|items|stuff|mess|scene|workbench|bench|place|workplace|layout|setup|lot)| things| everything| it all| up)?"
    r"(?: (?:a bit|a little|as follows|like this|like so|this way|in this way|so))?(?= :| so that(?: ,)?| such that(?: ,)?)"
)


class Asides:
    """The asides of one instruction.

    Args:
        said: its words.
        vocabulary: the nouns that are known, and those of the scene.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.forms = said, vocabulary.forms
        self._clauses = Clauses(said, vocabulary)
        self._adverbials = AdverbialClauses(said, self._clauses)
        self._remarks = Remarks(said, self._clauses)

    def at(self, place: int, after_phrase: bool = False, many: bool = False, fresh: bool = False) -> int | None:
        """Return the place after the aside that begins here; `None` where none begins.

        Args:
            place: of its first word.
            after_phrase: whether a noun phrase for objects stands right before it.
            many: whether that phrase means several objects.
            fresh: whether its sentence says nothing before it that counts.
        """
        before, remarks = self.said.word(place - 1), self._remarks
        opening = fresh or place == 0 or before in ENDS
        ends = [self._phrases(place), self._adverbials.at(place), remarks.parenthesis(place)]
        if after_phrase:
            ends.append(remarks.source(place, many))
        if opening or before in ("and", "so", "but", *INTERJECTIONS):
            ends += [self._address(place), self._heading(place)]
            ends += [remarks.comment(place), remarks.exclamation(place), remarks.happening(place)]
        if opening or before in ("and", "but", "that", "because"):
            ends.append(remarks.wanted(place))
        return max((end for end in ends if end is not None and end > place), default=None)

    def endearment(self, place: int) -> bool:
        """Tell whether a word that names an object elsewhere addresses the robot: "..., honey"."""
        said, word = self.said, self.said.word(place)
        alone = said.word(place - 1) in (",", "", ".", "!", "please", "hey", "ok", "okay") and said.word(place + 1) in ("", *ENDS)
        return alone and word in ADDRESS and not self._clauses.on_table(place)

    def idle_condition(self, place: int) -> bool:
        """Tell whether a condition begins here that every arm fulfils: "if you have a minute"."""
        return self._adverbials.condition(place) is not None or self._phrases(place) is not None

    def _heading(self, place: int) -> int | None:
        """Read "task:", "to do:", "step one:" before a request."""
        if (tidying := self.said.match(_TIDYING, place)) is not None:
            return tidying[1] + (self.said.word(tidying[1]) == ":")
        match = self.said.match(_HEADING, place)
        return None if match is None or self.said.word(match[1]) != ":" else match[1] + 1

    def _phrases(self, place: int) -> int | None:
        said = self.said
        ends = [] if (polite := polite_end(said, place)) is None else [polite]
        if (thanks := said.match(THANKS, place)) is not None:
            end = self._clauses.end(thanks[1])
            ends.append(end if not self._clauses.wishes(thanks[1], end) and end - thanks[1] < 8 else thanks[1])
        if (
            said.word(place - 1) == ","
            and (tag := said.match(TAG, place)) is not None
            and said.word(tag[1]) in ("", *STOPS)
        ):
            ends.append(tag[1])
        return max(ends, default=None)

    def _address(self, place: int) -> int | None:
        """Read a name at the margin: "Robbie, put ...", "hey Jarvis, ...", "..., my dear friend"."""
        said, at = self.said, place
        while said.word(at) in INTERJECTIONS:
            at += 1
        first = at
        while at < len(said.words) and said.word(at) not in ENDS and at - first < 4:
            at += 1
        marked = said.word(at) in (*ENDS, "") and at > first
        words = said.words[first:at]
        if not marked:
            return first if first > place and said.word(place) not in ("so", "right", "well", "look") else None
        named = [
            word
            for word in words
            if word not in ADDRESS
            and word not in ("my", "old", "good", "little", "you", "the", "oh", "mr", "mrs", "dear")
        ]
        if (
            not words
            or self._clauses.wishes(first, at)
            or len(named) > (1 if first > place or len(words) == 1 else len(words) - 1 and 1)
        ):
            return None
        if named and not self._name(first + words.index(named[0]), place, first > place):
            return None
        return at if at - first < 5 and (named or any(word in ADDRESS for word in words)) else None

    def _name(self, place: int, opening: int, greeted: bool) -> bool:
        """Return whether the word can only be somebody's name: it is no known word, and is written like one."""
        said, word = self.said, self.said.word(place)
        if (
            not word.isalpha()
            or word in VERBS
            or word in self.forms
            or word in COLOR_WORDS
            or word.endswith(("ly", "ing", "ed", "wise", "ward", "wards"))
        ):
            return False
        written = said.text[said.spans[place][0]]
        final = opening > 0 and said.word(opening - 1) == ","
        return written.isupper() if final or not greeted else True

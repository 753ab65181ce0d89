"""Find remarks: sentences and clauses that only tell something, of the speaker, of others or of an object."""

from __future__ import annotations

import re

from grounding.goal_reading.aside_words import OCCASIONS, OWNERS, REQUESTING
from grounding.goal_reading.clauses import ENDS, SPATIAL, STOPS, Clauses
from grounding.goal_reading.tokens import Words
from grounding.goal_reading.verb_words import VERBS

_GIVEN = re.compile(
    r"(?:(?:i|we|he|she|you|my \w+|our \w+|his \w+|her \w+|somebody|someone)(?: (?:have|has|had|just|once|always|never|really|'ve))* "
    r"(?:gave|given|bought|got|brought|made|found|inherited|stole|stolen|painted|love|loves|loved|like|likes|liked|use|uses|used|hate|hates|adore|adores|borrowed|received|won|sent|lent|knitted|built|baked|picked)"
    r"|(?:was|were|is|are|has been|came|comes|belongs|belonged|belong|used to belong) (?:a (?:gift|present)|given|made|bought|inherited|to|from))"
    r"(?: (?:me|us|him|her|them|you|myself|back|home))?"
    r"(?: (?:yesterday|today|recently|last \w+|the other day|as an? \w+|\w+ (?:years|months|weeks|days) ago|(?:from|by|to|for) (?:my|our|his|her|the|a) \w+|(?:in|at|from|to|by) (?!(?:the|a|my|this|your)\b)\w+|so much|very much|most|the most|every day))*"
)  # fmt: skip
_WANTS = re.compile(
    r"(?:(?:always|really|just|also|kindly) )*(?:says?|said|thinks?|insists?|wants?|wanted|needs|would like|would love|would prefer|'d like|prefers?|asks?|asked|told me|told us|tells me"
    r"|suggests?|suggested|recommends?|wishes|demands?|expects?|likes|liked|loves)(?: (?:that|for|to have|to see|you to|me to have|us to have|it if|me to|you|to tell you to))?(?= )"
)
_HAPPENS = re.compile(
    r"(?:the|my|our|this|that|one of the|all the|these|those) (?:\w+ ){1,3}?(?:(?:always|often|usually|sometimes|never|nearly|almost|just|constantly|already|really) )*"
    r"(?:gets|got|get|keeps|keep|kept|has|have|had|fell|falls|fall|broke|breaks|rolled|rolls|roll|slips|slipped|wobbles|wobble|tips|tipped|leaks|leaked|smells|cost|costs|came|won't stop|used to)"
    r"(?: (?:a|an|been|getting|falling|rolling|knocked|broken|some|no|off|over|down|away|stolen|lost|dirty|in my way|in the way|from|to|my|me|us|such|so))(?= )"
)
_LOOKS = re.compile(
    r"(?:the|my|our|this|that|these|those) (?:\w+ ){1,3}?(?:(?:looks?|seems?|feels?|appears?)(?! like\b)|(?:is|are|stands?|sits?|lies?) (?:(?:way|much|far|a bit|a little|just) )?too"
    r"|(?:is|are) (?:not|in the wrong|badly|poorly|wrongly|misplaced|out of place|in the way|blocking|crooked))(?= )"
)
_NO_STAY = re.compile(
    r"(?:the|my|our|this|that) (?:\w+ ){1,3}?(?:can't|cannot|can not|shouldn't|should not|mustn't|must not) (?:stay|remain|be|stand|sit|lie)"
    r"(?: (?:back|over|right|there|here|where (?:it|they) (?:is|are)(?: now)?|like (?:that|this)|in that place|that way))+(?= [,.;!]| and| so)"
)


class Remarks:
    """The remarks of one instruction.

    Args:
        said: its words.
        clauses: its clauses.
    """

    def __init__(self, said: Words, clauses: Clauses) -> None:
        self.said, self._clauses = said, clauses

    def comment(self, place: int) -> int | None:
        """Read a sentence or a clause that only tells something: "My sister gave me this bowl.", "I love order!"."""
        said, end = self.said, self._clauses.end(place)
        person = self._clauses.person(place)
        doing = person is not None and self._clauses.activity(person)
        asking = any(word in REQUESTING for word in said.words[place + 1 : place + 3])
        if said.word(place) in ("i", "we", "i'd", "we'd") and (asking or "'d" in said.word(place)) and not doing:
            return None
        if (
            said.word(place) in ("i", "we")
            and said.word(end - 1) == "order"
            and said.word(place + 1) in ("love", "like", "adore", "appreciate")
        ):
            return end
        if end - place < 2 or said.word(place) in VERBS or not self._clauses.about(place, end):
            return None
        told = self._clauses.person(place)
        left = told is not None and said.word(told) == "left" and said.word(told + 1) in (*OWNERS, "it", "them", "him", "her")
        verb = told is None or left or "'" in said.word(told - 1) or said.word(told) not in ("", *ENDS) and said.word(told) not in SPATIAL
        return end if verb else None

    def exclamation(self, place: int) -> int | None:
        """Read "what a mess!", "breakfast time!"."""
        said, end = self.said, self._clauses.end(place)
        words = said.words[place:end]
        what = words[:2] in (("what", "a"), ("what", "an"), ("how", "lovely"), ("how", "nice"), ("such", "a"))
        if (
            not words
            or len(words) > 6
            or any(word in VERBS and word not in ("time", "mess") for word in words)
            or self._clauses.wishes(place, end)
        ):
            return None
        occasion = words[-1] in OCCASIONS and said.word(end) == "!" and (place == 0 or said.word(place - 1) in STOPS)
        return end if what or occasion else None

    def wanted(self, place: int) -> int | None:
        """Read "my wife wants", "the boss says that": somebody else's wish, which follows."""
        first = self._clauses.person(place)
        if first is None or self.said.word(place) in ("i", "we", "nobody"):
            return None
        match = self.said.match(_WANTS, first)
        return None if match is None or self.said.word(match[1]) in ("", *ENDS) else match[1]

    def happening(self, place: int) -> int | None:
        """Read what happens to an object: "the bottle always gets knocked over", "the green apple has a worm in it"."""
        if (staying := self.said.match(_NO_STAY, place)) is not None:
            return staying[1] if any(self._clauses.is_object(i) for i in range(place, staying[1])) else None
        if (looks := self.said.match(_LOOKS, place)) is not None:
            end = self._clauses.end(looks[1])
            named = any(self._clauses.is_object(i) for i in range(place, looks[1]))
            return end if named and end - looks[1] < 6 and self._asked_after(end) else None
        match = self.said.match(_HAPPENS, place)
        if match is None or not any(self._clauses.is_object(i) for i in range(place, match[1])):
            return None
        end = self._clauses.end(match[1])
        told = end > match[1] and not self._clauses.wishes(match[1], end, facts=True)
        return end if told and self.said.word(end) not in ("", ".", "!") else None

    def _asked_after(self, end: int) -> bool:
        """Return whether a clause is ended by a mark, and a request follows."""
        said = self.said
        at = end + (said.word(end) in (",", ".", "!", ";"))
        while said.word(at) in ("so", "and", "then", "please", "could", "can", "you", "would", "just", "i'd", "like", "to"):
            at += 1
        return at > end and (said.word(at) in VERBS or said.word(at) in ("it", "they"))

    def source(self, place: int, many: bool) -> int | None:
        """Read where an object comes from: "the mug that my sister gave me"; of several it could choose some."""
        said, at = self.said, place
        comma = said.word(at) == ","
        at += comma
        relative = said.word(at) in ("that", "which", "who")
        at += relative
        if (many and not comma) or (comma and not relative):
            return None
        found = said.match(_GIVEN, at)
        if found is None or (
            not relative and said.word(at) in ("was", "were", "is", "are", "comes", "belongs", "belong")
        ):
            return None
        return found[1] if not self._clauses.wishes(at, found[1]) else None

    def parenthesis(self, place: int) -> int | None:
        """Read a remark in brackets: "(a present from my boss)"."""
        said = self.said
        if said.word(place) != "(" or ")" not in said.words[place:]:
            return None
        end = said.words.index(")", place)
        first = said.word(place + 1)
        telling = self._clauses.person(place + 1) is not None or first in ("which", "who") or (
            first in ("a", "an", "my", "our") and any(word in ("present", "gift", "souvenir", "heirloom", "favourite", "favorite") for word in said.words[place:end])
        )  # fmt: skip
        quiet = not any(word in VERBS and i for i, word in enumerate(said.words[place + 1 : end]) if word != "present")
        return end + 1 if telling and quiet and not self._clauses.wishes(place + 1, end) else None

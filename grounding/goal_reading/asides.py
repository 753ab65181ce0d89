"""Find what carries no wish in an instruction: reasons, purposes, address, politeness, and comments of the speaker.

An aside is recognised by its structure: a subordinate clause that a word such as "because" or "so that" opens, a phrase
with "for", a name between the margin and a comma, a sentence about a person or a fact. It ends where its clause ends, or
where the next request begins. No aside holds a word that could be a wish (`WISHES`), a length, a shape or a place; where
one does, nothing is passed over, so that the words stay to be understood or refused.
"""

from __future__ import annotations

import re

from grounding.goal_reading.aside_words import (
    ACTIVITIES,
    ADDRESS,
    HANDLING,
    INTERJECTIONS,
    LOOSE,
    NO_PURPOSE,
    OCCASIONS,
    OWNERS,
    PERSONS,
    REQUESTING,
    STABLE,
)
from grounding.goal_reading.clauses import ENDS, SPATIAL, STOPS, Clauses
from grounding.goal_reading.politeness import TAG, THANKS, polite_end
from grounding.goal_reading.tokens import Words
from grounding.goal_reading.verb_words import VERBS
from grounding.references.attributes import COLOR_WORDS
from grounding.references.phrases import Vocabulary

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
_HEADING = re.compile(
    r"(?:(?:the|your|my|our|new|next|first|second|third|last) )*(?:task|job|to do|todo|order|orders|mission|instruction|instructions|command|request|goal|note|plan|step|wish|assignment)"
    r"(?: (?:number )?(?:\d+|one|two|three|four))?(?= :)"
)
_TIDYING = re.compile(
    r"(?:please )?(?:rearrange|arrange|reorganize|reorganise|organize|organise|tidy|tidy up|clean|clean up|clear up|straighten up|straighten out|sort out|sort|set up|lay out|fix|change|redo)"
    r"(?: (?:the|this|my|our|all the|these|those) (?:\w+ )?(?:table|desk|things|objects|items|stuff|mess|scene|workbench|bench|place|workplace|layout|setup|lot)| things| everything| it all| up)?"
    r"(?: (?:a bit|a little|as follows|like this|like so|this way|in this way|so))?(?= :| so that(?: ,)?| such that(?: ,)?)"
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
_ROOM = re.compile(
    r"so (?:that )?(?:(?:the|my|our|that) (?:\w+ ){1,3}?(?:is|are|stays?|remains?|will be|gets|becomes?|can stay)|there(?:'s| is| will be)|i have|i've got|we have|i get|we get|you have|they have|it leaves|this leaves)"
    r"(?: (?:nice and|still|all|completely|kept|left|enough|plenty of|some|more|lots of|a bit of|a little))* (?:free|clear|empty|open|available|accessible|unobstructed|room|space|tidy|clean|neat)(?= |$)"
)
_UNTIL = (("by", "the", "time"), ("in", "time", "for"))


class Asides:
    """The asides of one instruction.

    Args:
        said: its words.
        vocabulary: the nouns that are known, and those of the scene.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.forms = said, vocabulary.forms
        self._clauses = Clauses(said, vocabulary)

    def at(self, place: int, after_phrase: bool = False, many: bool = False, fresh: bool = False) -> int | None:
        """Return the place after the aside that begins here; `None` where none begins.

        Args:
            place: of its first word.
            after_phrase: whether a noun phrase for objects stands right before it.
            many: whether that phrase means several objects.
            fresh: whether its sentence says nothing before it that counts.
        """
        opening = fresh or place == 0 or self.said.word(place - 1) in ENDS
        ends = [
            self._phrases(place), self._clause(place), self._room(place), self._purpose(place), self._for(place), self._condition(place), self._deadline(place),
            self._parenthesis(place), self._source(place, many) if after_phrase else None,
        ]  # fmt: skip
        if opening or self.said.word(place - 1) in ("and", "so", "but", *INTERJECTIONS):
            ends += [self._address(place), self._comment(place), self._exclamation(place), self._heading(place), self._happening(place)]
        if opening or self.said.word(place - 1) in ("and", "but", "that", "because"):
            ends.append(self._wanted(place))
        return max((end for end in ends if end is not None and end > place), default=None)

    def endearment(self, place: int) -> bool:
        """Tell whether a word that names an object elsewhere addresses the robot: "..., honey"."""
        said, word = self.said, self.said.word(place)
        alone = said.word(place - 1) in (",", "", ".", "!", "please", "hey", "ok", "okay") and said.word(place + 1) in ("", *ENDS)
        return alone and word in ADDRESS and not self._clauses.on_table(place)

    def idle_condition(self, place: int) -> bool:
        """Tell whether a condition begins here that every arm fulfils: "if you have a minute"."""
        return self._condition(place) is not None or self._phrases(place) is not None

    # Subordinate clauses

    def _clause(self, place: int) -> int | None:
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

    def _for(self, place: int) -> int | None:
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

    def _condition(self, place: int) -> int | None:
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

    def _comment(self, place: int) -> int | None:
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

    def _wanted(self, place: int) -> int | None:
        """Read "my wife wants", "the boss says that": somebody else's wish, which follows."""
        first = self._clauses.person(place)
        if first is None or self.said.word(place) in ("i", "we", "nobody"):
            return None
        match = self.said.match(_WANTS, first)
        return None if match is None or self.said.word(match[1]) in ("", *ENDS) else match[1]

    def _happening(self, place: int) -> int | None:
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

    def _room(self, place: int) -> int | None:
        """Read "so the front is free for my laptop", "so that I have room to work"."""
        match = self.said.match(_ROOM, place)
        if match is None:
            return None
        end = self._clauses.end(match[1]) if self.said.word(match[1]) in ("for", "to") else match[1]
        return end if self.said.word(end) in ("", "and", *ENDS) and not self._clauses.wishes(match[1], end, facts=True) else None

    def _heading(self, place: int) -> int | None:
        """Read "task:", "to do:", "step one:" before a request."""
        if (tidying := self.said.match(_TIDYING, place)) is not None:
            return tidying[1] + (self.said.word(tidying[1]) == ":")
        match = self.said.match(_HEADING, place)
        return None if match is None or self.said.word(match[1]) != ":" else match[1] + 1

    def _source(self, place: int, many: bool) -> int | None:
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

    def _parenthesis(self, place: int) -> int | None:
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

    # Phrases

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

    def _exclamation(self, place: int) -> int | None:
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

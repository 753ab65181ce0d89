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
    FACTS,
    HANDLING,
    INTERJECTIONS,
    LOOSE,
    NO_PURPOSE,
    OCCASIONS,
    OWNERS,
    PERSONS,
    REQUESTING,
    STABLE,
    WANTING,
    WISHES,
)
from grounding.goal_reading.goal_words import SHAPE_NOUNS, VERBS
from grounding.goal_reading.places import edge_at, place_at
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.references.attributes import COLOR_WORDS
from grounding.references.phrases import Vocabulary

_STOPS = frozenset((".", "!", "?", ";", "\n"))
_ENDS = _STOPS | {",", ":", "(", ")"}
_JOINTS = frozenset("and then but so plus &".split())
_COPULAS = frozenset(
    "is are was were isn't aren't wasn't weren't looks look feels feel seems seem smells has had gets".split()
)
_PRONOUNS = frozenset("it it's they they're this that that's these those there there's".split())
_SPATIAL = frozenset("on in into onto of to at near by with from inside beside behind left right next".split())
_BEFORE_VERBS = frozenset(
    "i we you he she they to not can can't could will would should never always don't doesn't didn't won't must may might cannot who just".split()
)
_POLITE = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?:would|could|will|can) you (?:please )?be (?:so |very |ever so )?(?:kind|good|nice|sweet|gracious|an? \w+)(?: enough)?(?: as)? (?:to|and)",
        r"be (?:so |very )?(?:kind|good|nice|sweet|an? (?:dear|darling|sweetheart|angel|love|sport|good \w+)|helpful)(?: enough)?(?: as)? (?:to|and)",
        r"do (?:me|us) (?:a|the|one|this) (?:\w+ )?(?:favor|favour|kindness|honor|honour|service)(?: (?:and|of|by))?",
        r"i(?: would|'d| will|'ll|'m| am)?(?: really| truly| very much| just| ever so| so| be| so very| most| much)*"
        r" (?:appreciate|grateful|glad|happy|obliged|thankful|delighted|thrilled)(?: it)?(?: very much| a lot)?(?: if| to see| to have)?(?: you (?:could|would|can|might))?",
        r"i (?:was|am|'m) (?:just |kind of |sort of )?(?:hoping|wondering|thinking)(?: that| if| whether| maybe)*(?: (?:you|we) (?:could|can|might|would))?",
        r"(?:it would|it'd|that would|that'd) (?:be (?:so |very |really |just )?(?:great|nice|lovely|cool|wonderful|fantastic|awesome|amazing|perfect|ideal|super|kind|good|swell|sweet)(?: of you)?"
        r"|make (?:my|our) (?:day|week|life)(?: easier)?|make me (?:so |very |really )?happy|help(?: me| us)?(?: a lot| a great deal| so much| greatly)?|mean (?:a lot|the world|so much)(?: to me)?)"
        r"(?: if| to have| to)?(?: (?:you|we) (?:could|would|can))?",
        r"(?:to be (?:honest|fair|frank|precise about it)|honestly|frankly|by the way|as you know|as you can see|you see|you know what|guess what|if you ask me|for what it's worth"
        r"|just so you know|fyi|btw|as far as i'm concerned|in my opinion|imo|imho|i(?:'d)? (?:guess|suppose|reckon|believe|imagine|daresay|bet|say|figure)|or so i think|you might say"
        r"|let me (?:think|see)(?: about (?:it|that|this))?|let's see|now let's see|what the heck|oh well|never fear|with all due respect|with respect|no offense|no offence"
        r"|while you(?:'re| are) at it|while we(?:'re| are) at it|when all is said and done|all in all|in short|long story short|in other words|for a change|for once|for good measure|for fun"
        r"|for the time being|for example|at your (?:leisure|convenience|earliest convenience)|any ?time|no hurry|no pressure|whenever you like|don't worry(?: about it| if it takes (?:a while|some time|long|time|a bit|ages))?|not to worry|no worries"
        r"|my goodness|my word|my god|oh my god|oh my|good lord|good grief|good heavens|for (?:god's|heaven's|goodness|goodness'|pete's) sake|i beg you|i'm begging you|pretty please"
        r"|if i may(?: say so)?|if (?:i )?(?:may|might)|as i said|like i said|i(?:'d| would) (?:rather|sooner|much rather) (?:have|like|see)|rather have|kindly to|here we go|there we go|here goes|chop chop"
        r"|your mission(?: today)? is(?: simple)?|your task(?: today)?(?: is)?|so here's the (?:thing|deal|plan)|here's the (?:thing|deal|plan)|the plan is(?: this)?|this is what i(?:'d)? (?:want|need|like)|happy \w+|merry christmas)",
        r"(?:good (?:day|afternoon|morning|evening|night|job|work)|well done|bravo|goodbye|bye(?: bye)?|see you(?: later| soon)?|have a (?:nice|good|great|lovely) (?:day|one|time|weekend)|love you|god bless(?: you)?|bless you)",
        r"(?:therefore|hence|thus|consequently)",
        r"(?:much obliged|all the best|best regards|kind regards|regards|yours truly|ta very much|that will be all|that would be all|over and out)",
    )
)  # fmt: skip
_THANKS = re.compile(
    r"(?:many |much |a thousand |huge )?(?:thanks|thank you|thx|thank u|ty|merci|gracias|danke|grazie|cheers)(?: a (?:lot|bunch|million|ton|heap))?"
)
_TAG = re.compile(
    r"(?:would|will|could|can|won't|shall|can't|couldn't) (?:you|we)(?: please)?|(?:ok|okay|right|yeah|yes|eh|huh|alright|deal|got it|got that|understood|you know|if you please)"
)
_CONDITION = re.compile(
    r"(?:if|when|whenever|as soon as|once) (?:you(?:'re|'ve| are| have| can| could| would| will| get| find| feel| don't| may| want to help| please| do me| happen| know| manage)|it(?:'s| is| isn't|'s not| is not| pleases) (?:not |no |n't )?(?:too|to|at all|a|any|much|ok|okay|all right|alright|possible|you)|that(?:'s| is) (?:ok|okay|all right|alright|possible|fine))(?= |$)"
)
_REASON = frozenset(
    "because cause cuz coz since as seeing given considering due owing thanks whereas although though".split()
)
_GIVEN = re.compile(
    r"(?:(?:i|we|he|she|you|my \w+|our \w+|his \w+|her \w+|somebody|someone)(?: (?:have|has|had|just|once|always|never|really|'ve))* "
    r"(?:gave|given|bought|got|brought|made|found|inherited|stole|stolen|painted|love|loves|loved|like|likes|liked|use|uses|used|hate|hates|adore|adores|borrowed|received|won|sent|lent|knitted|built|baked|picked)"
    r"|(?:was|were|is|are|has been|came|comes|belongs|belonged|belong|used to belong) (?:a (?:gift|present)|given|made|bought|inherited|to|from))"
    r"(?: (?:me|us|him|her|them|you|myself|back|home))?"
    r"(?: (?:yesterday|today|recently|last \w+|the other day|as an? \w+|\w+ (?:years|months|weeks|days) ago|(?:from|by|to|for) (?:my|our|his|her|the|a) \w+|(?:in|at|from|to|by) (?!(?:the|a|my|this|your)\b)\w+|so much|very much|most|the most|every day))*"
)  # fmt: skip


class Asides:
    """The asides of one instruction.

    Args:
        said: its words.
        vocabulary: the nouns that are known, and those of the scene.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.forms, self.heads = said, vocabulary.forms, vocabulary.heads

    def at(self, place: int, after_phrase: bool = False, many: bool = False) -> int | None:
        """Return the place after the aside that begins here; `None` where none begins.

        Args:
            place: of its first word.
            after_phrase: whether a noun phrase for objects stands right before it.
            many: whether that phrase means several objects.
        """
        opening = place == 0 or self.said.word(place - 1) in _ENDS
        ends = [
            self._phrases(place), self._clause(place), self._purpose(place), self._for(place), self._condition(place),
            self._parenthesis(place), self._source(place, many) if after_phrase else None,
        ]  # fmt: skip
        if opening or self.said.word(place - 1) in ("and", "so", "but", *INTERJECTIONS):
            ends += [self._address(place), self._comment(place), self._exclamation(place)]
        return max((end for end in ends if end is not None and end > place), default=None)

    # What is in a run of words

    def _object(self, place: int) -> bool:
        """Return whether the word names an object that may be on the table."""
        word = self.said.word(place)
        if word not in self.forms:
            return False
        return not self.heads or self.forms[word][0] in self.heads

    def wishes(self, first: int, end: int, facts: bool = False) -> bool:
        """Return whether a word from `first` to `end` could be a wish.

        Args:
            first, end: the words.
            facts: whether objects may be named, though not where they stand.
        """
        for place in range(first, end):
            word, before = self.said.word(place), self.said.word(place - 1)
            body = word in (
                "hand",
                "hands",
                "handed",
                "back",
                "foot",
                "feet",
                "face",
                "second",
                "minute",
                "minutes",
            ) and before in (*OWNERS, "left", "right")
            if (
                (word in WISHES and not body)
                or word == LENGTH
                or (word in SHAPE_NOUNS and word not in ("file", "plus", "group", "setting"))
            ):
                return True
            if self._object(place) and (not facts or before in _SPATIAL or self.said.word(place - 2) in _SPATIAL):
                return True
            side = word in ("left", "right") and self.said.word(place + 1) in ("handed", "handers", "now", "away", "?")
            if not side and not body and (place_at(self.said, place) or edge_at(self.said, place)):
                return True
        return False

    def _end(self, place: int) -> int:
        """Return where the clause ends: at a mark, or where a request begins."""
        said, at = self.said, place
        while at < len(said.words) and said.word(at) not in _ENDS:
            if at > place and self._request(at):
                break
            at += 1
        return at

    def _request(self, at: int) -> bool:
        said, word = self.said, self.said.word(at)
        if word in _JOINTS:
            following = said.word(at + 1 + (said.word(at + 1) in ("then", "also", "please", "just", "now")))
            named = any(self._object(at + i) for i in (1, 2, 3)) and (
                following in OWNERS or following in COLOR_WORDS or self._object(at + 1)
            )
            return (
                following in VERBS
                or following == "please"
                or named
                or said.word(at + 1) in ("then", "please", "can", "could", "also")
            )
        if word == "please":
            return True
        if word in VERBS and said.word(at - 1) not in _BEFORE_VERBS and said.word(at - 1) not in OWNERS:
            return said.word(at + 1) in (
                "the",
                "my",
                "all",
                "both",
                "these",
                "those",
                "them",
                "it",
                "up",
            ) or self._object(at + 1)
        return False

    def _person(self, place: int) -> int | None:
        """Return the place after the person that a clause is about."""
        said, at = self.said, place
        word = said.word(at)
        if word in PERSONS and not self._object(at):
            return at + 1
        if word not in OWNERS:
            return None
        for length in (1, 2, 3):
            if said.word(at + length) in PERSONS and not self._object(at + length):
                return at + length + 1 + (said.word(at + length + 1) in PERSONS)
            if self._object(at + length):
                return None
        body = word in ("my", "our", "his", "her") and said.word(at + 1).isalpha()
        return at + 2 if body and said.word(at + 1) not in VERBS else None

    def _about(self, place: int, end: int) -> bool:
        """Return whether the words are about a person, or state a fact, and hold no wish."""
        after = self._person(place)
        if after is not None:
            words = self.said.words[after:end]
            nobody = self.said.word(place) in ("nobody", "everyone", "everybody")  # "so nobody sees the cups" is a wish
            return not any(word in WANTING for word in words) and not self.wishes(after, end, facts=not nobody)
        return self._fact(place, end)

    def _fact(self, place: int, end: int) -> bool:
        """Return whether the words say only how something is: "it is raining", "the cans are empty"."""
        words = self.said.words[place:end]
        copula = next(
            (
                i
                for i, word in enumerate(words)
                if word in _COPULAS
                or word in ("it's", "they're", "that's", "there's")
                or word in ("belong", "belongs", "came", "cost", "costs")
            ),
            None,
        )
        if copula is None or copula > 5:
            return False
        pronoun = words[0] in _PRONOUNS and copula < 2
        named = any(self._object(place + i) for i in range(copula + 1)) or (
            words[0] in ("they", "they're", "these", "those", "it", "it's") and place > 0
        )
        rest = words[copula + 1 :]
        subject = (
            words[0] in OWNERS
            or words[0] in _PRONOUNS
            or words[0] in ("all", "both")
            or self._object(place)
            or words[0] in COLOR_WORDS
        )
        if (
            not subject
            or any(word in WANTING or word in ("not", "no", "never") or word.endswith("n't") for word in words)
            or self.wishes(place, end, facts=True)
        ):
            return False
        if named:
            name = any(word in ("called", "named", "from") for word in rest)
            return bool(rest) and (
                name or all(word in FACTS or word in PERSONS or word in COLOR_WORDS for word in rest)
            )
        return bool(rest) and (pronoun or words[0] in OWNERS)

    # Clauses

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
        end = self._end(first)
        if end == first:
            return None
        if noun:
            return end if not self.wishes(first, end) else None
        return end if self._about(first, end) else None

    def _purpose(self, place: int) -> int | None:
        """Read "so that I can reach them", "in order to save space", "to impress my boss"."""
        said = self.said
        words = said.words[place : place + 3]
        if words[:1] in (("so",), ("that",)) or words[:2] == ("in", "case"):
            first = place + 1 + (words[1:2] == ("that",)) + (words[0] == "in") if words[0] != "that" else place
            if words[0] == "that":
                return None
            end = self._end(first)
            if self._person(first) is not None:
                return end if self._about(first, end) else None
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
        verb, end = said.word(first), self._end(first + 1)
        if verb in LOOSE and said.word(first + 1) not in LOOSE[verb]:
            return None
        return end if not self.wishes(first, end, facts=verb in HANDLING) else None

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
        return at if not self.wishes(place + 1, at) else None

    def _of_occasion(self, at: int, first: int) -> bool:
        word = self.said.word(at)
        if word in ("of", "with", "and") and at > first:
            following = self.said.word(at + 1 + (self.said.word(at + 1) in OWNERS))
            return word == "of" or following in PERSONS
        if word in OWNERS and at > first:
            return self.said.word(at - 1) in ("of", "with", "and")
        known = word in VERBS and word not in ("display", "set", "show", "draw", "design", "order") and at == first
        return word.replace("'", "").isalpha() and word not in _SPATIAL and not known and not (word in VERBS and self._request(at)) and word not in _ENDS and word not in (
            "can", "could", "please", "put", "is", "are", "should", "must", "so", "then", "because", "which", "that", "i", "we", "you",
        )  # fmt: skip

    def _condition(self, place: int) -> int | None:
        """Read "if you have a minute", "when you get a chance", "if it's not too much trouble"."""
        if self.said.match(_CONDITION, place) is None:
            return None
        end = self._end(place + 2)
        if any(self.said.word(i) in ("done", "finished", "ready") for i in range(place, end)):
            return None  # "when you are done" says what comes after
        return end if not self.wishes(place, end) else None

    def _comment(self, place: int) -> int | None:
        """Read a sentence or a clause that only tells something: "My sister gave me this bowl.", "I love order!"."""
        said, end = self.said, self._end(place)
        if said.word(place) in ("i", "we") and any(word in REQUESTING for word in said.words[place + 1 : place + 3]):
            return None
        if (
            said.word(place) in ("i", "we")
            and said.word(end - 1) == "order"
            and said.word(place + 1) in ("love", "like", "adore", "appreciate")
        ):
            return end
        if end - place < 2 or said.word(place) in VERBS or not self._about(place, end):
            return None
        told = self._person(place)
        verb = told is None or said.word(told) not in ("", *_ENDS) and said.word(told) not in _SPATIAL
        return end if verb else None

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
        return found[1] if not self.wishes(at, found[1]) else None

    def _parenthesis(self, place: int) -> int | None:
        said = self.said
        if said.word(place) != "(" or ")" not in said.words[place:]:
            return None
        end = said.words.index(")", place)
        first = said.word(place + 1)
        telling = self._person(place + 1) is not None or first in ("which", "who") or (
            first in ("a", "an", "my", "our") and any(word in ("present", "gift", "souvenir", "heirloom", "favourite", "favorite") for word in said.words[place:end])
        )  # fmt: skip
        quiet = not any(word in VERBS and i for i, word in enumerate(said.words[place + 1 : end]) if word != "present")
        return end + 1 if telling and quiet and not self.wishes(place + 1, end) else None

    # Phrases

    def _phrases(self, place: int) -> int | None:
        said = self.said
        ends = [match[1] for pattern in _POLITE if (match := said.match(pattern, place)) is not None]
        if (thanks := said.match(_THANKS, place)) is not None:
            end = self._end(thanks[1])
            ends.append(end if not self.wishes(thanks[1], end) and end - thanks[1] < 8 else thanks[1])
        if (
            said.word(place - 1) == ","
            and (tag := said.match(_TAG, place)) is not None
            and said.word(tag[1]) in ("", *_STOPS)
        ):
            ends.append(tag[1])
        return max(ends, default=None)

    def _address(self, place: int) -> int | None:
        """Read a name at the margin: "Robbie, put ...", "hey Jarvis, ...", "..., my dear friend"."""
        said, at = self.said, place
        while said.word(at) in INTERJECTIONS:
            at += 1
        first = at
        while at < len(said.words) and said.word(at) not in _ENDS and at - first < 4:
            at += 1
        marked = said.word(at) in (*_ENDS, "") and at > first
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
            or self.wishes(first, at)
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
        said, end = self.said, self._end(place)
        words = said.words[place:end]
        what = words[:2] in (("what", "a"), ("what", "an"), ("how", "lovely"), ("how", "nice"), ("such", "a"))
        if (
            not words
            or len(words) > 6
            or any(word in VERBS and word not in ("time", "mess") for word in words)
            or self.wishes(place, end)
        ):
            return None
        occasion = words[-1] in OCCASIONS and said.word(end) == "!" and (place == 0 or said.word(place - 1) in _STOPS)
        return end if what or occasion else None

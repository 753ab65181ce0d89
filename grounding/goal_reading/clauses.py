"""Tell what a clause is about: a person, a fact, or something that could be a wish."""

from __future__ import annotations

from grounding.goal_reading.aside_words import ACTIVITIES, FACTS, OWNERS, PERSONS, WANTING, WISHES
from grounding.goal_reading.goal_words import SHAPE_NOUNS
from grounding.goal_reading.places import edge_at, place_at
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.goal_reading.verb_words import VERBS
from grounding.references.attributes import COLOR_WORDS
from grounding.references.phrases import Vocabulary

STOPS = frozenset((".", "!", "?", ";", "\n"))
ENDS = STOPS | {",", ":", "(", ")"}
_JOINTS = frozenset("and then but so plus &".split())
_COPULAS = frozenset(
    "is are was were isn't aren't wasn't weren't looks look feels feel seems seem smells has had gets".split()
)
_PRONOUNS = frozenset("it it's they they're this that that's these those there there's".split())
SPATIAL = frozenset("on in into onto of to at near by with from inside beside behind left right next".split())
_BEFORE_VERBS = frozenset(
    "i we you he she they to not can can't could will would should never always don't doesn't didn't won't must may might cannot who just".split()
)

_WANTS = frozenset("want need like have would really still just 'd also going am".split())
_REQUESTS = frozenset((
    ("can", "you"), ("could", "you"), ("would", "you"), ("will", "you"), ("i", "want"), ("i", "need"), ("i", "would"), ("we", "need"),
    ("we", "want"),
))  # fmt: skip


class Clauses:
    """The clauses of one instruction.

    Args:
        said: its words.
        vocabulary: the nouns that are known, and those of the scene.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.forms, self.heads = said, vocabulary.forms, vocabulary.heads

    def is_object(self, place: int) -> bool:
        """Return whether the word names an object that may be on the table."""
        word = self.said.word(place)
        if word not in self.forms:
            return False
        return not self.heads or self.forms[word][0] in self.heads

    def on_table(self, place: int) -> bool:
        """Return whether the word names an object of the scene."""
        return self.said.word(place) in self.forms and self.forms[self.said.word(place)][0] in self.heads

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
            if self.is_object(place) and (not facts or before in SPATIAL or self.said.word(place - 2) in SPATIAL):
                return True
            side = word in ("left", "right") and self.said.word(place + 1) in ("handed", "handers", "now", "away", "?")
            home = word == "back" and before in ("came", "come", "get", "got", "went", "go", "am", "i'm", "be", "been", "was", "going", "coming")
            verb = word == "left" and (before in PERSONS or self.said.word(place + 1) in ("the", "it", "them", "him", "her", "this"))
            if not side and not body and not home and not verb and (place_at(self.said, place) or edge_at(self.said, place)):
                return True
        return False

    def end(self, place: int) -> int:
        """Return where the clause ends: at a mark, or where a request begins."""
        said, at = self.said, place
        while at < len(said.words) and said.word(at) not in ENDS:
            if at > place and self.request(at):
                break
            at += 1
        return at

    def request(self, at: int) -> bool:
        said, word = self.said, self.said.word(at)
        if word in _JOINTS:
            following = said.word(at + 1 + (said.word(at + 1) in ("then", "also", "please", "just", "now")))
            named = any(self.is_object(at + i) for i in (1, 2, 3)) and (
                following in OWNERS or following in COLOR_WORDS or self.is_object(at + 1)
            )
            return (
                following in VERBS
                or following == "please"
                or named
                or said.word(at + 1) in ("then", "please", "can", "could", "also")
            )
        if word in ("i'd", "we'd") and self.said.word(at + 1) in ("like", "want", "prefer", "love"):
            return True
        if word in ("please", "let's") or self.said.words[at : at + 2] in _REQUESTS:
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
            ) or self.is_object(at + 1)
        return False

    def person(self, place: int) -> int | None:
        """Return the place after the person that a clause is about."""
        said, at = self.said, place
        word = said.word(at)
        if word in PERSONS and not self.is_object(at):
            return at + 1
        if word not in OWNERS:
            return None
        for length in (1, 2, 3):
            if said.word(at + length) in PERSONS and not self.is_object(at + length):
                return at + length + 1 + (said.word(at + length + 1) in PERSONS)
            if self.is_object(at + length):
                return None
        body = word in ("my", "our", "his", "her") and said.word(at + 1).isalpha()
        return at + 2 if body and said.word(at + 1) not in VERBS else None

    def about(self, place: int, end: int) -> bool:
        """Return whether the words are about a person, or state a fact, and hold no wish."""
        after = self.person(place)
        if after is not None:
            words = self.said.words[after:end]
            nobody = self.said.word(place) in ("nobody", "everyone", "everybody")  # "so nobody sees the cups" is a wish
            wants = any(word in WANTING for word in words) and not self.activity(after)
            end -= self.activity(after) and self.said.word(end - 1) in ("first", "now", "soon", "later")
            return not wants and not self.wishes(after, end, facts=not nobody)
        return self._fact(place, end)

    def activity(self, place: int) -> bool:
        """Return whether a person wants to do something else than arrange: "I'd like to eat it", "I need to see at a glance"."""
        words = self.said.words[place : place + 4]
        at = next((i for i, word in enumerate(words) if word == "to"), None)
        if at is None or at == len(words) - 1 or not all(word in WANTING or word in _WANTS for word in words[:at]):
            return False
        following = self.said.word(place + at + 2)
        return words[at + 1] in ACTIVITIES and (words[at + 1] not in ("see", "find") or following not in (*OWNERS, "two", "them"))

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
        named = any(self.is_object(place + i) for i in range(copula + 1)) or (
            words[0] in ("they", "they're", "these", "those", "it", "it's") and place > 0
        )
        rest = words[copula + 1 :]
        subject = (
            words[0] in OWNERS
            or words[0] in _PRONOUNS
            or words[0] in ("all", "both")
            or self.is_object(place)
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

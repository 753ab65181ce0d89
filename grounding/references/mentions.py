"""Where an instruction speaks of objects: noun phrases, their number and adjectives, and their role.

Rules over words, without a grammar: a noun counts as meant unless the words before it say otherwise ("for
the cups", "next to the box"), leave it out ("all but the bowl"), or its sentence only tells something ("the
mugs came in a parcel").
"""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.references.attributes import SUPERLATIVES, TELLING_ADJECTIVES
from grounding.references.coordination import partial_phrases
from grounding.references.counts import JOINTS, count_before, numbers_after
from grounding.references.function_words import (
    ALL_WORDS,
    AMBIGUOUS,
    ARRANGING,
    DETERMINERS,
    ENDS_OF_EXCEPTIONS,
    FUNCTION_WORDS,
    GENERIC,
    NOT_OBJECTS,
    NUMBERS,
    ORDINALS,
    PRONOUNS,
    WHAT_FOLLOWS_OBJECTS,
)
from grounding.references.lexicon import ADJECTIVES, COLOURS, FILLINGS, STUFF, USES, singular
from grounding.references.phrases import ANY, Mention, References, Vocabulary
from grounding.references.relative_clauses import says_more, with_clause
from grounding.references.sentence_roles import STOPS, Sentences
from grounding.references.unknown_nouns import MOST_MODIFIERS, unknown_phrase

_TOKEN = re.compile(r"\d+|[^\W\d_]+(?:['’][^\W\d_]+)*|[,.;:!?\n()]")
_SUBJECTS = frozenset("i you we it they he she one that which who someone".split())
_DENIALS = ("don't", "dont", "never", "not")
_ANY_THINGS = frozenset(word for word, kind in GENERIC.items() if kind != "one") - {"ones", "lot", "bits"}
_BEFORE_NOUNS = DETERMINERS | frozenset(NUMBERS)
_USE_VERBS = frozenset(verb for verb, _ in USES)
_ANYTHING = frozenset(GENERIC) | {"what", "whatever", "anything"}
# With one of these a singular means one particular object.
_DEFINITE = frozenset("the that this my your our his her their".split())
_INDEFINITE = frozenset("a an any one some another of".split())
_PLACES = frozenset("left right front back rear near far middle".split())
_ALL = ALL_WORDS - {"only", "just"}
_UNSAID = frozenset(
    "the a an my your our his her their these those this that teh da whatever just only".split()
)


def read_mentions(text: str, vocabulary: Vocabulary) -> References:
    """All noun phrases of objects in any string; takes time in proportion to the string's length."""
    return _MentionReader(text, vocabulary).read()


class _MentionReader:
    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self.text = text
        found = [(match.group().lower().replace("’", "'"), match.span()) for match in _TOKEN.finditer(text)]
        self.words = [word for word, _ in found]
        self.spans = [span for _, span in found]
        self.vocabulary, self.forms = vocabulary, vocabulary.forms
        self.said = Sentences(self.words, self.forms)
        self.pronoun = False

    def read(self) -> References:
        mentions: list[Mention] = []
        last: tuple[int, Mention] | None = None  # the place of the last head, and its mention
        place = 0
        while place < len(self.words):
            head = self._head(place, last)
            if head is None:
                if self.words[place] in PRONOUNS and self.said.word(place + 1) != "of":
                    self.pronoun = self.pronoun or not self.said.told[place]
                place += 1
                continue
            mention, end = self._mention(*head, last)
            if mention is not None:
                mention, without, end = with_clause(self.said, self.spans, mention, end)
                if mention.noun == ANY and not says_more(mention):
                    mentions += without
                    place = max(end, place + 1)
                    continue
                if last and mention.role == "left out" and self.said.left_alone(end, False):
                    between = self.words[last[0] + 1 : head[0]]
                    if between and all(w in JOINTS or w in DETERMINERS for w in between):
                        mentions[-1] = replace(mentions[-1], role="left out")  # "the fork and the knife stay"
                mentions += self._with_sharing(mention, *head[:2], end, last)
                mention = mentions[-1]
                last = (end - 1, mention)
                mentions += without
            place = max(end, place + 1)
        return References(self.text, tuple(mentions), self.pronoun)

    # Heads of noun phrases

    def _head(self, place: int, last: tuple[int, Mention] | None) -> tuple[int, int, str, bool, bool] | None:
        """(start of modifiers, head, noun, plural, known) of the phrase with its head at `place`, if any."""
        word = self.words[place]
        if use := self._use(place):
            end = place + (self.said.word(place + 1) in ("from", "with", "out", "off"))
            return place, end, use, True, True
        if word in GENERIC:
            return self._generic(place)
        if word in self.forms and not self._no_noun(place):
            noun, many = self.forms[word]
            return self._first_modifier(place), place, noun, many, True
        return unknown_phrase(self.said, place, self._listed(place, last))

    def _use(self, place: int) -> str | None:
        """The group of "(anything I can) drink from"."""
        word = self.words[place]
        if word not in _USE_VERBS or not any(w in _ANYTHING for w in self.words[max(0, place - 6) : place]):
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
        if word in _ANY_THINGS and self.said.word(place + 1) in COLOURS:
            return place, place + 1, ANY, True, True  # "everything red"
        return start, place, ANY, many, True

    def _no_noun(self, place: int) -> bool:
        """Whether this known word is none here: a verb, an adjective, the first part of a compound."""
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

    def _compound(self, place: int) -> bool:
        """Whether this word is the first part of a compound: "soup can", but not "forks knives"."""
        word, after = self.words[place], self.said.word(place + 1)
        if after not in self.forms or self._no_noun_alone(place + 1):
            return False
        if not self._singular(place):
            return False
        noun = self.forms[word][0]
        pair, heads = (noun, self.forms[after][0]), self.vocabulary.heads
        told_apart = noun in heads and pair[1] in heads and pair not in self.vocabulary.compounds
        # "apple banana carrot" are three things only where no article speaks of one.
        return (
            not told_apart
            or word in ADJECTIVES
            or self.said.word(self._first_modifier(place) - 1) in DETERMINERS
        )

    def _singular(self, place: int) -> bool:
        return self.forms[self.words[place]][0] == self.words[place]

    def _no_noun_alone(self, place: int) -> bool:
        """Whether a known word that could end a compound does not: "robot cups can ..."."""
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
        """The "," or "and" that joins this to the objects before it; empty where nothing does."""
        if not last or last[1].role != "meant" or self.words[place] in FUNCTION_WORDS - DETERMINERS:
            return ""
        between = self.words[last[0] + 1 : place]
        return between[-1] if 0 < len(between) < 3 and all(w in (",", "and", "&") for w in between) else ""

    # What is said of them

    def _mention(
        self, start: int, head: int, noun: str, many: bool, known: bool, last: tuple[int, Mention] | None
    ) -> tuple[Mention | None, int]:
        """The mention, unless the words are no object after all, and the place after it."""
        end = head + 1
        numbers, end = numbers_after(self.said, end)
        modifiers = tuple(self.words[start:head])
        if known and self.said.word(end) == "of" and (filling := self._filling(end + 1)):
            modifiers, end = (*modifiers, filling), end + 2  # "the box of crackers"
        if self.words[start] in _ANY_THINGS and self.words[head] in COLOURS:
            modifiers = (self.words[head],)
        if last and self.words[head] in ("one", "ones") and last[1].noun != ANY:
            noun = last[1].noun
        count, exact, first = count_before(self.said, start)
        if self.said.word(first - 1) in SUPERLATIVES:  # "the tallest three cans"
            modifiers = (self.said.word(first - 1), *modifiers)
            first -= 1 + (self.said.word(first - 2) in DETERMINERS)
        elif self.said.word(first - 1) in _PLACES and first < start and self.said.word(first - 2) in DETERMINERS:
            modifiers = (self.said.word(first - 1), *modifiers)  # "the left three cups"
            first -= 2
        elif self.said.word(first - 1) == "of" and self.said.word(first - 2) in SUPERLATIVES:
            modifiers, first = (self.said.word(first - 2), *modifiers), first - 2  # "the (two) biggest of the cups"
            number = NUMBERS.get(self.said.word(first - 1))
            count, exact = number or 1, number is not None
            first -= number is not None
            first -= self.said.word(first - 1) in DETERMINERS
            many = count > 1
        # "only the red one" is still one.
        one = not many and not any(w in _ALL for w in self.words[first:start])
        if numbers:
            count, exact = len(numbers), False
        elif count is None and one:
            count = 1
        ordinal = ORDINALS.get(self.said.word(start - 1)) if first < start - 1 and count == 1 else None
        if self.words[start] in _USE_VERBS and self._use(start):
            first = max(i for i in range(max(0, start - 6), start) if self.words[i] in _ANYTHING)
            first -= self.said.word(first - 1) in DETERMINERS
        role = self._role(first, end, last)
        if first < start and any(w in _DENIALS for w in self.words[first:start]):
            role = "left out"  # "what you don't eat with"
        clause = self.said.word(end) in ("that", "which", "that's")
        if noun == ANY and not (numbers or modifiers or ordinal or (exact and role == "meant") or clause):
            return None, end  # everything, or "not everything"
        shown = first
        while shown < head and self.words[shown] in _UNSAID:
            shown += 1
        span = (self.spans[shown][0], self.spans[end - 1][1])
        said = self.words[first:start]
        definite = any(w in _DEFINITE for w in said) and not any(w in _INDEFINITE for w in said)
        return Mention(
            noun, modifiers, count, exact, role, known, many or (count or 2) > 1, numbers, ordinal, span, definite,
            self.said.word(first - 1) if role == "landmark" and not self.said.told[first] else "",
        ), end

    def _filling(self, place: int) -> str:
        """The singular of what a box or can holds, where the word at `place` says that; else empty."""
        word = singular(self.said.word(place))
        return word if word in FILLINGS else ""

    def _with_sharing(
        self, mention: Mention, start: int, head: int, end: int, last: tuple[int, Mention] | None
    ) -> list[Mention]:
        """The mention after those that share its noun; what the words before the first say holds for all."""
        partial = partial_phrases(self.said, start, head, mention.plural, last[0] if last else -1)
        if partial:
            mention = replace(mention, role=self._role(partial[0].first, end, last))
        return [
            *(
                replace(
                    mention,
                    modifiers=tuple(self.words[each.start : each.end]),
                    count=each.count,
                    exact=each.exact,
                    numbers=(),
                    ordinal=None,
                    definite=self.words[each.first] in _DEFINITE,
                    span=(self.spans[each.start][0], self.spans[each.end - 1][1]),
                )
                for each in partial
            ),
            mention,
        ]

    def _role(self, first: int, end: int, last: tuple[int, Mention] | None) -> str:
        exception = self.said.exception(first)
        kept = exception == "leave" or self.said.word(first - 1) == "keep"
        if (exception and exception != "leave") or self.said.left_alone(end, kept):
            return "left out"
        between = self.words[last[0] + 1 : first] if last else ["?"]
        if last and len(between) <= 2 and all(w in (",", "and", "or", "nor", "plus", "&") for w in between):
            # "except the cups, the bowls and ..."; but "not the cups, the bowls" says what is meant
            contrast = (
                "not" in self.words[max(0, last[0] - 3) : last[0]]
                or self.said.word(end) not in ENDS_OF_EXCEPTIONS
            )
            if between != [","] or last[1].role != "left out" or not contrast:
                return last[1].role
        if self.said.landmark(first):
            return "landmark"
        denied = self.said.word(first - 2) in _DENIALS and self.said.word(first - 1) in ARRANGING
        return "told" if denied or self.said.told[first] else "meant"

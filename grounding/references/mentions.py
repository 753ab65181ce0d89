"""Find where an instruction mentions objects: noun phrases, their number and adjectives, and their role.

The rules work on words, without a grammar: a noun is a target unless the words before it say otherwise ("for
the cups", "next to the box"), leave it out ("all but the bowl"), or its sentence only reports something ("the
mugs came in a parcel").
"""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.references.attributes import SUPERLATIVES
from grounding.references.coordination import partial_phrases
from grounding.references.counts import JOINTS, count_before, numbers_after
from grounding.references.function_words import (
    ALL_WORDS,
    ARRANGING,
    DETERMINERS,
    ENDS_OF_EXCEPTIONS,
    NUMBERS,
    ORDINALS,
    PLACE_ADJECTIVES,
    PRONOUNS,
)
from grounding.references.heads import ANY_THINGS, ANYTHING, USE_VERBS, HeadFinder
from grounding.references.lexicon import COLOURS, FILLINGS
from grounding.references.phrases import ANY, Mention, References, Vocabulary
from grounding.references.relative_clauses import says_more, with_clause
from grounding.references.sentence_roles import Sentences
from grounding.references.word_forms import singular

_TOKEN = re.compile(r"\d+|[^\W\d_]+(?:['’][^\W\d_]+)*|[,.;:!?\n()]")
_DENIALS = ("don't", "dont", "never", "not")
# With one of these a singular means one particular object.
_DEFINITE = frozenset("the that this my your our his her their".split())
_INDEFINITE = frozenset("a an any one some another of".split())
_ALL = ALL_WORDS - {"only", "just"}
_UNSAID = frozenset("the a an my your our his her their these those this that teh da whatever just only".split())


def read_mentions(text: str, vocabulary: Vocabulary) -> References:
    """Find all noun phrases of objects in any string, in time proportional to its length."""
    return _MentionReader(text, vocabulary).read()


class _MentionReader:
    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self.text = text
        found = [(match.group().lower().replace("’", "'"), match.span()) for match in _TOKEN.finditer(text)]
        self.words = [word for word, _ in found]
        self.spans = [span for _, span in found]
        self.said = Sentences(self.words, vocabulary.forms)
        self.heads = HeadFinder(self.said, vocabulary)
        self.pronoun = False

    def read(self) -> References:
        mentions: list[Mention] = []
        last: tuple[int, Mention] | None = None  # the place of the last head, and its mention
        place = 0
        while place < len(self.words):
            head = self.heads.find(place, last)
            if head is None:
                if self.words[place] in PRONOUNS and self.said.word(place + 1) != "of":
                    self.pronoun = self.pronoun or not self.said.narrated[place]
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

    # What is said of them

    def _mention(
        self, start: int, head: int, noun: str, many: bool, known: bool, last: tuple[int, Mention] | None
    ) -> tuple[Mention | None, int]:
        """Return the mention, or `None` if the words are no object after all, and the place after it."""
        end = head + 1
        numbers, end = numbers_after(self.said, end)
        modifiers = tuple(self.words[start:head])
        if known and self.said.word(end) == "of" and (filling := self._filling(end + 1)):
            modifiers, end = (*modifiers, filling), end + 2  # "the box of crackers"
        if self.words[start] in ANY_THINGS and self.words[head] in COLOURS:
            modifiers = (self.words[head],)
        if last and self.words[head] in ("one", "ones") and last[1].noun != ANY:
            noun = last[1].noun
        count, exact, first = count_before(self.said, start)
        if self.said.word(first - 1) in SUPERLATIVES:  # "the tallest three cans"
            modifiers = (self.said.word(first - 1), *modifiers)
            first -= 1 + (self.said.word(first - 2) in DETERMINERS)
        elif (
            self.said.word(first - 1) in PLACE_ADJECTIVES and first < start and self.said.word(first - 2) in DETERMINERS
        ):
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
        if self.words[start] in USE_VERBS and self.heads.use_group(start):
            first = max(i for i in range(max(0, start - 6), start) if self.words[i] in ANYTHING)
            first -= self.said.word(first - 1) in DETERMINERS
        role = self._role(first, end, last)
        if first < start and any(w in _DENIALS for w in self.words[first:start]):
            role = "left out"  # "what you don't eat with"
        clause = self.said.word(end) in ("that", "which", "that's")
        if noun == ANY and not (numbers or modifiers or ordinal or (exact and role == "target") or clause):
            return None, end  # everything, or "not everything"
        shown = first
        while shown < head and self.words[shown] in _UNSAID:
            shown += 1
        span = (self.spans[shown][0], self.spans[end - 1][1])
        said = self.words[first:start]
        definite = any(w in _DEFINITE for w in said) and not any(w in _INDEFINITE for w in said)
        return Mention(
            noun,
            modifiers,
            count,
            exact,
            role,
            known,
            many or (count or 2) > 1,
            numbers,
            ordinal,
            span,
            definite,
            self.said.word(first - 1) if role == "landmark" and not self.said.narrated[first] else "",
        ), end

    def _filling(self, place: int) -> str:
        """Return the singular of the content of a box or can if the word at `place` names it; otherwise empty."""
        word = singular(self.said.word(place))
        return word if word in FILLINGS else ""

    def _with_sharing(
        self, mention: Mention, start: int, head: int, end: int, last: tuple[int, Mention] | None
    ) -> list[Mention]:
        """Return the mentions that share a noun, this one last; the words before the first one apply to all."""
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
                "not" in self.words[max(0, last[0] - 3) : last[0]] or self.said.word(end) not in ENDS_OF_EXCEPTIONS
            )
            if between != [","] or last[1].role != "left out" or not contrast:
                return last[1].role
        if self.said.landmark(first):
            return "landmark"
        denied = self.said.word(first - 2) in _DENIALS and self.said.word(first - 1) in ARRANGING
        return "narrated" if denied or self.said.narrated[first] else "target"

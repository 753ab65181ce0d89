"""Read noun phrases for objects: "the two red mugs", "the second block from the left", "everything else", "it"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.goal_reading.attribute_clauses import those_of, with_attributes
from grounding.goal_reading.measures import count_at
from grounding.goal_reading.noun_parts import DEFINITE, EVERYTHING, ORDINALS, PLACE_ADJECTIVES, Determiners, NounParts
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.place_clauses import with_clause
from grounding.goal_reading.tokens import Words
from grounding.references.attributes import COMPARATIVES, SUPERLATIVES, TELLING_ADJECTIVES, is_color
from grounding.references.function_words import (
    SHAPE_WORDS,
)
from grounding.references.lexicon import USES
from grounding.references.phrases import ANY, Mention, Vocabulary

PRONOUNS = frozenset("it them em they itself themselves".split())
_THEM = frozenset("them these those".split())
_DEMONSTRATIVES = frozenset("this that these those both all each".split())
_FOR_USE = re.compile(
    r"(?:(?:what|whatever|anything|everything|something|all|(?:all )?(?:the )?(?:things?|ones|objects|stuff|items)) "
    r"(?:(?:that|which) )?(?:you|i|we|one|people|someone)(?: (?:can|could|may|might|would|normally|usually))*"
    r"|(?:all )?(?:the )?(?:things?|ones|objects|stuff|items)(?: (?:for|used))? to)(?= )"
)
_SIDES = {"left": "left", "right": "right", "front": "near", "back": "far", "rear": "far", "near": "near", "far": "far"}

# What may follow "the other" or "one" where the noun is left out.
_AFTER_BARE = frozenset(
    "on in at to behind next beside between into onto near by left right above over under with goes go should must has needs belongs "
    "stands sits is can could will ought , . ;".split()
) | {""}


class NounPhraseReader:
    """A reader of noun phrases.

    Args:
        said: the words.
        vocabulary: the nouns that are known.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.forms = said, vocabulary.forms
        self.parts = NounParts(said, vocabulary)

    def at(self, place: int) -> NounPhrase | None:
        """Read the noun phrase that begins at a place; `None` where none does."""
        return self._whatever(place) or self._pronoun(place) or self._rest(place) or self._phrase(place)

    # Phrases without a noun

    def _pronoun(self, place: int) -> NounPhrase | None:
        said, word = self.said, self.said.word(place)
        if said.words[place : place + 2] in (("each", "other"), ("one", "another")):
            return self._made("each other", place, place + 2)
        if word in PRONOUNS:
            return self._made("pronoun", place, place + 1)
        pair = said.words[place : place + 2]
        if pair in (("the", "former"), ("the", "latter")) and not self.parts.noun_follows(place + 2):
            return self._made("pronoun", place, place + 2)
        if pair in (("that", "one"), ("this", "one")) and said.word(place + 2) in _AFTER_BARE:
            return self._made("pronoun", place, place + 2)
        if (part := self._some_of_them(place)) is not None:
            return part
        if word == "all" and (number := count_at(said, place + 1)) is not None and said.word(number[1]) == "of":
            if said.word(number[1] + 1) in PRONOUNS:
                return self._made("pronoun", place, number[1] + 2)  # "all seven of them"
        if (
            word in ("both", "all", "each")
            and said.word(place + 1) == "of"
            and said.word(place + 2) in (*PRONOUNS, "these", "those")
        ):
            if not self.parts.noun_follows(place + 3) or said.word(place + 2) in PRONOUNS:
                return self._made("pronoun", place, place + 3)
        if word in _DEMONSTRATIVES and not self.parts.noun_follows(place + 1):
            following = said.word(place + 1)
            if word == "that" and following in ("is", "are", "the", "i", "you", "we", "they", "it", "way", "so"):
                return None
            if word in ("all", "each", "both") and following in (
                "the",
                "along",
                "over",
                "around",
                "the",
                "in",
                "other",
            ):
                return None if following != "in" else self._made("pronoun", place, place + 1)
            if word == "all" and following in ("of", "right", "way", "set", "my", "your", "except", "but"):
                return None if following not in ("except", "but") else self._made("all", place, place + 1)
            return self._made("pronoun", place, place + 1)
        return None

    def _some_of_them(self, place: int) -> NounPhrase | None:
        """Read "two of them": any of what was named last."""
        count = count_at(self.said, place)
        if count is None or self.said.word(count[1]) != "of" or self.said.word(count[1] + 1) not in _THEM:
            return None
        end = count[1] + 2
        if self.parts.noun_follows(end) and self.said.word(count[1] + 1) != "them":
            return None
        span = (self.said.spans[place][0], self.said.spans[end - 1][1])
        several = count[0] > 1
        mention = Mention(ANY, (), count[0], True, "target", True, several, (), None, span)
        return NounPhrase("objects", place, end, self.said.quote(place, end), mention, borrowed=True)

    def _rest(self, place: int) -> NounPhrase | None:
        said = self.said
        at = place + (said.word(place) == "all")
        words = said.words[at : at + 4]
        if words[:2] in (("everything", "else"), ("anything", "else"), ("all", "else")):
            return self._rest_of(place, at + 2)
        if words[:3] == ("whatever", "is", "left") or words[:3] == ("what", "is", "left"):
            return self._rest_of(place, at + 3)
        if words[:2] in (("what's", "left"), ("whatever's", "left")):
            return self._rest_of(place, at + 2)
        at += words[:1] == ("the",)
        word, following = said.word(at), said.word(at + 1)
        if at > place and word in ("rest", "remainder", "others"):
            return self._rest_of(place, at + 1)
        if word in ("remaining", "other", "leftover") and (at > place or word != "other"):
            if following in ("ones", "objects", "things", "items", "stuff"):
                return self._rest_of(place, at + 2)
            count = count_at(said, at + 1)
            if count is not None and at > place:  # "the other two"
                of = self._phrase(count[1])
                if of is None or of.first != count[1]:
                    return replace(self._rest_of(place, count[1]), left=count[0])
                if of.kind in ("objects", "all") and (
                    of.mention is None or of.mention.noun == ANY and not of.mention.modifiers
                ):
                    return replace(self._made("rest", place, of.end), left=count[0])  # "the other six things"
            noun = self._phrase(at + 1)
            if noun is not None and noun.kind == "objects" and noun.many:
                return replace(noun, kind="rest", first=place, text=said.quote(place, noun.end))
        return None

    def _rest_of(self, place: int, end: int) -> NounPhrase:
        said = self.said
        if said.word(end) == "of":
            if said.words[end + 1 : end + 2] in (("them",), ("it",), ("these",), ("those",)):
                return self._made("rest", place, end + 2)
            noun = self._phrase(end + 1)
            if noun is not None and noun.kind == "all":
                return self._made("rest", place, noun.end)
            if noun is not None:
                return replace(noun, kind="rest", first=place, text=said.quote(place, noun.end))
        return self._made("rest", place, end)

    def _made(self, kind: str, first: int, end: int) -> NounPhrase:
        return NounPhrase(kind, first, end, self.said.quote(first, end))

    # Phrases with a noun

    def _phrase(self, place: int, joined: bool = True) -> NounPhrase | None:
        said = self.said
        if said.word(place) in EVERYTHING:
            return self._described(place, self._made("all", place, place + 1))
        before = self.parts.determiners(place)
        count, ordinal, definite, free, start = (
            before.count,
            before.ordinal,
            before.definite,
            before.free,
            before.end,
        )
        side, at, number = None, start, None
        modifiers, excluded, colours = list[str](), list[str](), list[str]()
        while True:
            word = said.word(at)
            hand = word in ("left", "right") and said.word(at + 1) == "hand"
            if (
                word in PLACE_ADJECTIVES
                and side is None
                and self.parts.place_adjective(at + 1 + hand, word, place < at)
            ):
                side, at = PLACE_ADJECTIVES[word], at + 1 + hand
            elif word in ORDINALS and at > start and self.parts.modified(at + 1):
                ordinal, at = ORDINALS[word], at + 1
            elif word == "non" and at > place and is_color(said.word(at + 1)):
                excluded.append(said.word(at + 1))
                at += 2
            elif joined and modifiers and (other := self._joined_colour(at, modifiers[-1])):
                colours.append(said.word(other))
                at = other + 1
            elif self.parts.modifier(at, place):
                modifiers += [] if word in ("and", "colour", ",") else [word]
                at += 1
            elif (
                (number := count_at(said, at)) is not None
                and at > start
                and count is None
                and modifiers
                and self.parts.modified(number[1])
            ):
                count, at = number  # "the largest two blocks"
            else:
                break
        head = self.parts.head(at, place, bool(modifiers), definite or count is not None or free)
        if head is None:
            return self._phrase(place, False) if colours else self._without_noun(place, at, modifiers, side, before)
        noun, many, end, known, extra, borrowed = head
        numbers, end = self.parts.numbers(end)
        modifiers += extra
        many = (many or before.every) and not (said.word(place) in ("a", "an") and start == place + 1 and count is None)
        plural = (many and (count or 2) > 1) or (count or 1) > 1 or len(numbers) > 1
        if colours and not plural:
            return self._phrase(place, False)
        if count is None and not plural:
            count = 1
        exact = count is not None and (count > 1 or said.word(start - 1) == "one")
        only_all = noun == ANY and not modifiers and not numbers and side is None and ordinal is None and not borrowed
        if only_all and many and count is None:
            return self._described(place, self._made("all", place, end))
        among = None
        if borrowed and said.word(end) == "of" and (among := self._group(end + 1)) is not None:
            noun, known, end = among.mention.noun, among.mention.known, among.end  # "the middle one of the red cups"
            modifiers, borrowed = [*modifiers, *among.mention.modifiers], False
        mention = Mention(
            noun, tuple(modifiers), len(numbers) or count, exact and not numbers, "target", known, plural, numbers, None,
            (said.spans[place][0], said.spans[end - 1][1]), definite and not free,
        )  # fmt: skip
        phrase = NounPhrase("objects", place, end, said.quote(place, end), mention, borrowed, side, False, ordinal)
        first = next(iter(word for word in modifiers if is_color(word)), "")
        either = tuple(
            replace(mention, modifiers=tuple(colour if word == first else word for word in modifiers))
            for colour in colours
        )
        phrase = replace(_ranked(phrase), among=among, other=before.other, either=either)
        return self._described(place, replace(phrase, without=tuple(those_of(phrase, said, each) for each in excluded)))

    def _joined_colour(self, at: int, before: str) -> int:
        """Return the place of a further colour, or 0: "the four blue and green blocks"."""
        said, place = self.said, at
        while said.word(place) in ("and", ",", "&") and place - at < 2:
            place += 1
        colour = is_color(before) and is_color(said.word(place)) and said.word(place) != before
        following = said.word(place + 1)
        noun = self.parts.noun_follows(place + 1) and said.word(place + 1) not in ("the", "of")
        more = following in ("and", ",", "&") and self._joined_colour(place + 1, said.word(place)) > 0
        return place if colour and (noun or more) else 0

    def _whatever(self, place: int) -> NounPhrase | None:
        """Read "whatever is red", "whichever blocks are red", "all that is red"."""
        said = self.said
        if said.words[place : place + 2] in (("all", "that"), ("all", "which")):
            found = self._described(place, self._made("all", place, place + 1))
            return found if found.mention is not None else None
        if (use := self._use(place)) is not None:
            return use
        if said.word(place) not in ("whatever", "whichever"):
            return None
        of = self._phrase(place + 1) if said.word(place) == "whichever" else None
        start = self._made("all", place, place + 1) if of is None else replace(of, first=place, text="")
        link = said.word(start.end)
        if link not in ("is", "are", "isn't", "aren't", "has"):
            return None
        found = with_attributes(said, start, self.at, whatever=True)
        return found if found.end > start.end else None

    def _use(self, place: int) -> NounPhrase | None:
        """Read "what you write with", "the things to drink from"."""
        said = self.said
        if (begun := said.match(_FOR_USE, place)) is None:
            return None
        at = begun[1]
        for after in (said.word(at + 1), ""):
            if (group := USES.get((said.word(at), after))) is not None:
                end = at + 1 + (after != "") + (said.word(at + 2) == "of" and after == "out")
                span = (said.spans[place][0], said.spans[end - 1][1])
                mention = Mention(group, (), None, False, "target", True, True, (), None, span)
                return NounPhrase("objects", place, end, said.quote(place, end), mention)
        return None

    def _group(self, place: int) -> NounPhrase | None:
        """Read the group that something is chosen from: "... of the red cups"."""
        of = self._phrase(place)
        if of is None or of.kind != "objects" or of.first != place or not of.many:
            return None
        return of

    def _without_noun(
        self, place: int, at: int, modifiers: list[str], side: str | None, before: Determiners
    ) -> NounPhrase | None:
        """Read a phrase that leaves out its noun: "the red", "the tallest", "the two largest", "the leftmost"."""
        said, count, ordinal, definite = self.said, before.count, before.ordinal, before.definite
        telling = [word for word in modifiers if word in TELLING_ADJECTIVES or word in COMPARATIVES]
        if not (telling or side) and self._bare(place, at, before):
            return self._counted(place, at, before)
        joined = bool(telling) and said.word(at) in ("and", ",") and said.word(at - 1) == modifiers[-1]
        certain = definite or any(word in SUPERLATIVES for word in telling)
        if not (telling or side or (ordinal and definite)) or not (certain or joined):
            return None
        if said.word(at) in ("side", "corner", "edge", "end", "half", "hand", "part", "way", *SHAPE_WORDS):
            return None
        noun, plural, known, among = ANY, (count or 1) > 1, True, None
        if said.word(at) == "of":
            of = self._phrase(at + 1)
            if of is not None and of.kind == "objects" and not of.many:
                return None  # "the shorter of the red and the blue can"
            if of is not None and of.kind == "objects":
                noun, known, at = of.mention.noun, of.mention.known, of.end
                modifiers, among = [*modifiers, *of.mention.modifiers], of
            elif of is not None and of.kind == "all":
                at = of.end
            elif said.word(at + 1) in ("them", "these", "those", "all"):
                at += 2
        elif said.word(at) in ("and", ",", "or") or said.word(at) == "&":
            joint = at + 1 + (said.word(at + 1) in ("and", "or"))
            other = self._phrase(joint)
            if other is not None and other.kind == "objects" and other.mention.modifiers:
                noun, known = other.mention.noun, other.mention.known
                article = said.word(joint) in DEFINITE
                plural = plural or (other.mention.plural and (not article or other.mention.count is None))
                certain = True
        if not certain:
            return None
        count = count or (None if plural else 1)
        mention = Mention(
            noun, tuple(modifiers), count, (count or 1) > 1, "target", known, plural, (), None,
            (said.spans[place][0], said.spans[at - 1][1]), definite,
        )  # fmt: skip
        phrase = NounPhrase("objects", place, at, said.quote(place, at), mention, noun == ANY, side, False, ordinal)
        return self._described(place, replace(_ranked(phrase), among=among, other=before.other))

    def _bare(self, place: int, at: int, before: Determiners) -> bool:
        """Return whether only "the other", "another" or a number stands here: "one on the left, the other on the right"."""
        if at == place or before.ordinal is not None or self.said.word(at) not in _AFTER_BARE:
            return False
        counted = before.count is not None and not before.definite and self.said.word(place - 1) not in ("by", "of")
        return before.other or (counted and at == place + 1 and not self.said.word(place).isdecimal())

    def _counted(self, place: int, at: int, before: Determiners) -> NounPhrase:
        count = before.count or 1
        span = (self.said.spans[place][0], self.said.spans[at - 1][1])
        mention = Mention(
            ANY, (), count, count > 1, "target", True, count > 1, (), None, span, before.definite and not before.free
        )
        return NounPhrase("objects", place, at, self.said.quote(place, at), mention, borrowed=True, other=True)

    # What stands after the noun

    def _described(self, place: int, phrase: NounPhrase) -> NounPhrase:
        """Add "from the left" after an ordinal or a superlative of place."""
        said, end = self.said, phrase.end
        words = said.words[end : end + 3]
        if phrase.ordinal is not None and words[:2] == ("from", "the") and said.word(end + 2) in _SIDES:
            side = _SIDES[said.word(end + 2)]
            return replace(phrase, side=side, end=end + 3, text=said.quote(place, end + 3))
        if phrase.ordinal is not None and words[:2] in (("on", "the"), ("at", "the")) and said.word(end + 2) in _SIDES:
            return replace(phrase, side=_SIDES[said.word(end + 2)], end=end + 3, text=said.quote(place, end + 3))
        if phrase.kind not in ("objects", "all"):
            return phrase
        found = with_clause(said, with_attributes(said, phrase, self.at), self.at)
        return with_attributes(said, found, self.at) if found.end > phrase.end else found


def _ranked(phrase: NounPhrase) -> NounPhrase:
    """Say "the second tallest" of the measure, and not of the order in which objects stand."""
    mention = phrase.mention
    assert mention is not None  # of objects
    if phrase.ordinal is None or not any(word in SUPERLATIVES for word in mention.modifiers):
        return phrase
    return replace(phrase, ordinal=None, mention=replace(mention, ordinal=phrase.ordinal))

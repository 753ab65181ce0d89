"""Read noun phrases for objects: "the two red mugs", "the second block from the left", "everything else", "it"."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from grounding.goal_reading.goal_words import PATTERN_WORDS
from grounding.goal_reading.measures import COUNTS, UNITS, count_at
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.place_clauses import with_clause
from grounding.goal_reading.tokens import Words
from grounding.references.attributes import COLOR_WORDS, COMPARATIVES, SUPERLATIVES, TELLING_ADJECTIVES
from grounding.references.function_words import (
    AMBIGUOUS,
    FUNCTION_WORDS,
    GENERIC,
    NOT_OBJECTS,
    SHAPE_WORDS,
)
from grounding.references.lexicon import COLOURS, FILLINGS, GROUPS, STUFF
from grounding.references.phrases import ANY, Mention, Vocabulary
from grounding.references.word_forms import singular

PRONOUNS = frozenset("it them em they itself themselves".split())
_DEMONSTRATIVES = frozenset("this that these those both all each".split())
_DEFINITE = frozenset("the my your our his her their this that these those".split())
_INDEFINITE = frozenset("a an any some another".split())
_PREDETERMINERS = frozenset(
    "all both every each any just only several single whole entire certain lone many most few".split()
)
# "A pair of", "a bunch of": before the noun, and nothing of themselves.
_GROUPS = frozenset("couple pair bunch set lot group number trio handful selection".split())
ORDINALS: Mapping[str, int] = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7, "eighth": 8, "last": -1,
    "1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5,
}  # fmt: skip
# Adjective of place -> the side on which the object stands that is meant.
PLACE_ADJECTIVES: Mapping[str, str] = {
    "leftmost": "left", "rightmost": "right", "left": "left", "right": "right", "nearest": "near", "closest": "near",
    "nearer": "near", "closer": "near", "near": "near", "front": "near", "frontmost": "near", "foremost": "near",
    "farthest": "far", "furthest": "far", "farther": "far", "further": "far", "far": "far", "back": "far", "rear": "far",
    "rearmost": "far", "backmost": "far", "hindmost": "far", "middle": "middle", "center": "middle", "central": "middle",
    "nearmost": "near",
}  # fmt: skip
_ALONE = frozenset(
    "leftmost rightmost nearest closest farthest furthest frontmost foremost rearmost backmost hindmost nearmost".split()
)
_SIDES = {"left": "left", "right": "right", "front": "near", "back": "far", "rear": "far", "near": "near", "far": "far"}
# "The roll of tape" is the tape, "a piece of fruit" a fruit.
_PORTIONS = frozenset("roll reel spool stick bar piece pair item bit can box bottle".split()) - {"can", "box", "bottle"}
COMPOUND_NOUNS: Mapping[tuple[str, str], str] = {
    ("felt", "tip"): "marker", ("felt", "pen"): "marker", ("magic", "marker"): "marker", ("tea", "spoon"): "teaspoon", ("tin", "can"): "can",
    ("rubber", "duck"): "duck", ("rubber", "ducky"): "duck", ("rubber", "duckie"): "duck", ("drinking", "glass"): "glass", ("coffee", "cup"): "cup",
}  # fmt: skip
_EVERYTHING = frozenset("everything anything".split())
_NO_NOUNS = frozenset("left right top bottom front back side order other rest place space line row table edge".split())
_PLACE_NOUNS = frozenset("table tabletop desk surface workspace board edge corner side middle center".split())


class NounPhraseReader:
    """A reader of noun phrases.

    Args:
        said: the words.
        vocabulary: the nouns that are known.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.vocabulary, self.forms = said, vocabulary, vocabulary.forms

    def at(self, place: int) -> NounPhrase | None:
        """Read the noun phrase that begins at a place; `None` where none does."""
        return self._pronoun(place) or self._rest(place) or self._phrase(place)

    # Phrases without a noun

    def _pronoun(self, place: int) -> NounPhrase | None:
        said, word = self.said, self.said.word(place)
        if said.words[place : place + 2] in (("each", "other"), ("one", "another")):
            return self._made("each other", place, place + 2)
        if word in PRONOUNS:
            return self._made("pronoun", place, place + 1)
        if (
            word in ("both", "all", "each")
            and said.word(place + 1) == "of"
            and said.word(place + 2) in (*PRONOUNS, "these", "those")
        ):
            if not self._noun_follows(place + 3) or said.word(place + 2) in PRONOUNS:
                return self._made("pronoun", place, place + 3)
        if word in _DEMONSTRATIVES and not self._noun_follows(place + 1):
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

    def _noun_follows(self, place: int) -> bool:
        """Return whether a noun or an adjective of objects stands within the next words."""
        for each in range(place, place + 4):
            word = self.said.word(each)
            if word in self.forms or word in GENERIC:
                return not (word == "can" and self.said.word(each + 1) in ("you", "we", "i", "be"))
            if not (word in TELLING_ADJECTIVES or word in COUNTS or word.isdecimal() or word in ORDINALS or word in (
                "the", "of", "my", "your", "other", "remaining", *PLACE_ADJECTIVES, *SUPERLATIVES,
            )):  # fmt: skip
                return False
        return False

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

    def _phrase(self, place: int) -> NounPhrase | None:
        said = self.said
        if said.word(place) in _EVERYTHING:
            return self._described(place, self._made("all", place, place + 1))
        before = self._determiners(place)
        count, ordinal, definite, free, start = before
        side, at, number = None, start, None
        modifiers: list[str] = []
        while True:
            word = said.word(at)
            hand = word in ("left", "right") and said.word(at + 1) == "hand"
            if word in PLACE_ADJECTIVES and side is None and self._place_adjective(at + 1 + hand, word, place < at):
                side, at = PLACE_ADJECTIVES[word], at + 1 + hand
            elif word in ORDINALS and at > start and self._modified(at + 1):
                ordinal, at = ORDINALS[word], at + 1
            elif self._modifier(at, place):
                modifiers += [] if word in ("and", "colour", ",") else [word]
                at += 1
            elif (
                (number := count_at(said, at)) is not None
                and at > start
                and count is None
                and modifiers
                and self._modified(number[1])
            ):
                count, at = number  # "the largest two blocks"
            else:
                break
        head = self._head(at, place, bool(modifiers), definite or count is not None or free)
        if head is None:
            return self._without_noun(place, at, modifiers, side, count, ordinal, definite)
        noun, many, end, known, extra, borrowed = head
        numbers, end = self._numbers(end)
        modifiers += extra
        many = many and not (said.word(place) in ("a", "an") and start == place + 1 and count is None)
        plural = (many and (count or 2) > 1) or (count or 1) > 1 or len(numbers) > 1
        if count is None and not plural:
            count = 1
        exact = count is not None and (count > 1 or said.word(start - 1) == "one")
        only_all = noun == ANY and not modifiers and not numbers and side is None and ordinal is None and not borrowed
        if only_all and many and count is None:
            return self._described(place, self._made("all", place, end))
        mention = Mention(
            noun, tuple(modifiers), len(numbers) or count, exact and not numbers, "target", known, plural, numbers, None,
            (said.spans[place][0], said.spans[end - 1][1]), definite and not free,
        )  # fmt: skip
        phrase = NounPhrase("objects", place, end, said.quote(place, end), mention, borrowed, side, False, ordinal)
        return self._described(place, phrase)

    def _determiners(self, place: int) -> tuple[int | None, int | None, bool, bool, int]:
        """Read (count, ordinal, whether definite, whether any will do, place after) of what stands before adjectives."""
        said, at = self.said, place
        count: int | None = None
        ordinal, definite, free = None, False, False
        while at < len(said.words) and at - place < 7:
            word = said.word(at)
            number = count_at(said, at)
            if word in ("other", "same", "very") and definite:
                at += 1
            elif word in _DEFINITE or word in _PREDETERMINERS:
                definite = definite or word in _DEFINITE
                count = 2 if word == "both" else count
                at += 1
            elif word in _INDEFINITE:
                free, at = True, at + 1
                if said.word(at) in _GROUPS:
                    count = 2 if said.word(at) in ("couple", "pair") else 3 if said.word(at) == "trio" else count
                    at += 1 + (said.word(at + 1) == "of")
            elif number is not None and not self._measured(number[1]) and 0 < number[0] < 100:
                if count is not None and word == "one":
                    break
                count, at = number[0], number[1]
                free = free or (said.word(at) == "of")
            elif word in ORDINALS and (definite or self._counted_from(at)) and self._modified(at + 1):
                ordinal, at = ORDINALS[word], at + 1
            elif word == "of" and at > place and said.word(at - 1) not in _DEFINITE:
                at += 1
            else:
                break
        return count, ordinal, definite, free, at

    def _counted_from(self, at: int) -> bool:
        """Return whether "from the left" follows soon: "third cup from the left"."""
        words = self.said.words[at + 1 : at + 6]
        return any(words[i : i + 2] == ("from", "the") for i in range(1, len(words)))

    def _measured(self, place: int) -> bool:
        """Return whether the number before this place counts no objects: "5 cm", "3 by 3", "2 rows"."""
        word = self.said.word(place)
        return word in UNITS or word in (
            "by",
            "x",
            "row",
            "rows",
            "column",
            "columns",
            "/",
            "degrees",
            "times",
            "lines",
        )

    def _modified(self, place: int) -> bool:
        word = self.said.word(place)
        return word in self.forms or word in GENERIC or word in TELLING_ADJECTIVES or word in PLACE_ADJECTIVES or (
            word not in FUNCTION_WORDS and word not in NOT_OBJECTS and word.isalpha()
        )  # fmt: skip

    def _place_adjective(self, after: int, word: str, determined: bool) -> bool:
        """Return whether an adjective of place belongs to a noun."""
        if not determined:
            return False
        following = self.said.word(after)
        if following in ("side", "of", "edge", "corner", "hand", "end", "half", "part"):
            return False
        if following in self.forms or following in GENERIC:
            return following not in _NO_NOUNS
        if following in TELLING_ADJECTIVES or following in COUNTS or following in ("two", "three", "most"):
            return self._noun_follows(after)
        return word in _ALONE

    def _modifier(self, at: int, place: int) -> bool:
        """Return whether the word describes the noun that comes after it."""
        said, word = self.said, self.said.word(at)
        if word in SUPERLATIVES:
            return True
        following = said.word(at + 1)
        if word == "colour":
            return at > place
        if word == "sized" and at > place:
            return True
        if word in ("dark", "light", "bright", "pale") and following in COLOURS:
            return True
        if word in TELLING_ADJECTIVES or (word in COMPARATIVES and said.word(at - 1) in ("the", "two")):
            noun = word in self.forms and not self._noun_follows(at + 1)
            return not noun and following not in ("circle", "ring", "row", "line", *SHAPE_WORDS)
        if word in self.forms and self.forms[word][0] == word and following in self.forms:
            if following == "can" and said.word(at + 2) in ("be", "you", "go"):
                return False
            separate = word in self.vocabulary.heads and self.forms[following][0] in self.vocabulary.heads
            pair = (word, self.forms[following][0])
            return not separate or pair in self.vocabulary.compounds
        return False

    def _head(
        self, at: int, place: int, described: bool, determined: bool
    ) -> tuple[str, bool, int, bool, list[str], bool] | None:
        """Read (noun, whether many, place after, known, more modifiers, whether the noun is borrowed)."""
        said, word = self.said, self.said.word(at)
        if not word:
            return None
        if word in ("one", "ones"):
            return (ANY, word == "ones", at + 1, True, [], True) if described or at > place else None
        if (color := self._color_noun(at)) is not None:
            return ANY, True, at + 1, True, [color], True
        if (pair := (word, said.word(at + 1).removesuffix("s"))) in COMPOUND_NOUNS:
            end = at + 2 + (said.word(at + 2) in ("pen", "pens"))
            return COMPOUND_NOUNS[pair], said.word(end - 1).endswith("s"), end, True, [], False
        if word.removesuffix("s") in _PORTIONS and said.word(at + 1) == "of" and said.word(at + 2) in self.forms:
            noun, many = self.forms[said.word(at + 2)]
            if noun in self.vocabulary.heads or not self.vocabulary.heads or noun in GROUPS:
                return noun, word.endswith("s"), at + 3, True, [], False  # "the roll of tape"
        if word in STUFF and GENERIC.get(said.word(at + 1)) == "stuff":
            return STUFF[word], True, at + 2, True, [], False
        if word in GENERIC and word not in ("lot", "bits", "utensils") and word not in _EVERYTHING:
            return ANY, GENERIC[word] != "one", at + 1, True, [], False
        if word in self.forms and not self._no_noun(at, place, determined or described):
            noun, many = self.forms[word]
            if said.word(at + 1) == "of" and (filling := singular(said.word(at + 2))) in FILLINGS:
                return noun, many, at + 3, True, [filling], False
            return noun, many, at + 1, True, [], False
        if (determined or described) and self._unknown_noun(at):
            end = at + 1
            while end - at < 3 and self._unknown_noun(end) and said.word(end) not in self.forms:
                end += 1
            if said.word(end) in self.forms and self._unknown_noun(at) and not self._no_noun(end, place, True):
                noun, many = self.forms[said.word(end)]  # "the salad bowl"
                return noun, many, end + 1, True, list(said.words[at:end]), False
            last = said.word(end - 1)
            noun = singular(last)
            return noun, noun != last, end, False, list(said.words[at : end - 1]), False
        return None

    def _color_noun(self, at: int) -> str | None:
        """Return the colour of "the reds", "blues"; `None` for the fruit that is called like a colour."""
        word = self.said.word(at)
        color = word.removesuffix("s")
        if color == word or color not in COLOR_WORDS or color in ("rose", "lime", "cream", "tan"):
            return None
        fruit = word in self.forms and (not self.vocabulary.heads or self.forms[word][0] in self.vocabulary.heads)
        return None if fruit else color

    def _no_noun(self, at: int, place: int, determined: bool) -> bool:
        said, word = self.said, self.said.word(at)
        if word == "can":
            modal = said.word(at + 1) in ("you", "we", "i", "u", "be", "go", "do", "it", "they")
            return modal or (not determined and place == at and "can" not in self.vocabulary.heads and at == 0)
        if word in SHAPE_WORDS or word in ("date", "bit") or word in _NO_NOUNS:
            return True
        if word in AMBIGUOUS and not determined:
            return self.forms[word][0] not in self.vocabulary.heads or said.word(at + 1) in ("the", "my", "all", "them")
        return word in NOT_OBJECTS and not self.forms[word][1]

    def _unknown_noun(self, at: int) -> bool:
        word = self.said.word(at)
        return (
            word.isalpha() and len(word) > 2 and word not in FUNCTION_WORDS and word not in NOT_OBJECTS
            and word not in TELLING_ADJECTIVES and word not in UNITS and word not in PATTERN_WORDS
            and not word.endswith("ly")
        )  # fmt: skip

    def _without_noun(
        self, place: int, at: int, modifiers: list[str], side: str | None, count: int | None, ordinal: int | None,
        definite: bool,
    ) -> NounPhrase | None:  # fmt: skip
        """Read a phrase that leaves out its noun: "the red", "the tallest", "the two largest", "the leftmost"."""
        said = self.said
        telling = [word for word in modifiers if word in TELLING_ADJECTIVES or word in COMPARATIVES]
        joined = bool(telling) and said.word(at) in ("and", ",") and said.word(at - 1) == modifiers[-1]
        certain = definite or any(word in SUPERLATIVES for word in telling)
        if not (telling or side or (ordinal and definite)) or not (certain or joined):
            return None
        if said.word(at) in ("side", "corner", "edge", "end", "half", "hand", "part", "way", *SHAPE_WORDS):
            return None
        noun, plural, known = ANY, (count or 1) > 1, True
        if said.word(at) == "of":
            of = self._phrase(at + 1)
            if of is not None and of.kind == "objects":
                noun, known, at = of.mention.noun, of.mention.known, of.end
                modifiers = [*modifiers, *of.mention.modifiers]
            elif of is not None and of.kind == "all":
                at = of.end
            elif said.word(at + 1) in ("them", "these", "those", "all"):
                at += 2
        elif said.word(at) in ("and", ",", "or") or said.word(at) == "&":
            joint = at + 1 + (said.word(at + 1) in ("and", "or"))
            other = self._phrase(joint)
            if other is not None and other.kind == "objects" and other.mention.modifiers:
                noun, known = other.mention.noun, other.mention.known
                article = said.word(joint) in _DEFINITE
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
        return self._described(place, phrase)

    def _numbers(self, at: int) -> tuple[tuple[int, ...], int]:
        """Read the numbers of "cups 1 and 3", "mug number 2"."""
        said, numbers = self.said, []
        start = at + (said.word(at) in ("number", "no", "#"))
        while said.word(start).isdecimal() and len(said.word(start)) < 3 and not self._measured(start + 1):
            numbers.append(int(said.word(start)))
            at = start + 1
            joint = at + (said.word(at) in (",", "and", "&"))
            joint += said.word(joint) == "and"
            if joint == at or not said.word(joint).isdecimal() or self._measured(joint + 1):
                break
            if said.word(joint + 1) in self.forms or said.word(joint + 1) in GENERIC:
                break
            start = joint
        return tuple(numbers), at

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
        if phrase.kind in ("objects", "all"):
            return with_clause(said, phrase, self.at)
        return phrase

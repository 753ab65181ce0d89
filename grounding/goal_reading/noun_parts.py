"""Read what noun phrases are made of: determiners and counts, adjectives, the noun itself, and the numbers after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from grounding.goal_reading.goal_words import PATTERN_WORDS
from grounding.goal_reading.measures import COUNTS, UNITS, count_at
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.goal_reading.verb_words import VERBS
from grounding.references.attributes import COLOR_WORDS, COMPARATIVES, EXPLETIVES, SUPERLATIVES, TELLING_ADJECTIVES
from grounding.references.function_words import (
    AMBIGUOUS,
    FUNCTION_WORDS,
    GENERIC,
    NOT_OBJECTS,
    SHAPE_WORDS,
)
from grounding.references.lexicon import COLOURS, FILLINGS, GROUPS, STUFF
from grounding.references.phrases import ANY, Vocabulary
from grounding.references.word_forms import singular

DEFINITE = frozenset("the my your our his her their this that these those".split())
_INDEFINITE = frozenset("a an any some another".split())
_PREDETERMINERS = frozenset(
    "all both every each any just only several single whole entire certain lone many most few".split()
)
# "A pair of", "a bunch of": before the noun, and nothing of themselves.
_GROUPS = frozenset("couple pair bunch set lot group number trio handful selection".split())
# What follows "the third" where its noun is left out.
_AFTER_ORDINAL = frozenset("on in at to behind next beside between into onto near left right above over goes should must".split())
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
# "The roll of tape" is the tape, "a piece of fruit" a fruit.
_AFTER_MODAL = frozenset("you we i u be go do it they stay remain stand come have just also then not rest sit lie".split())
_IN_COMPOUNDS = frozenset("breakfast lunch dinner supper tea birthday party kitchen baby kid kids table desk office".split())
_PORTIONS = frozenset("roll reel spool stick bar piece pair item bit can box bottle".split()) - {"can", "box", "bottle"}
COMPOUND_NOUNS: Mapping[tuple[str, str], str] = {
    ("felt", "tip"): "marker", ("felt", "pen"): "marker", ("magic", "marker"): "marker", ("tea", "spoon"): "teaspoon", ("tin", "can"): "can",
    ("rubber", "duck"): "duck", ("rubber", "ducky"): "duck", ("rubber", "duckie"): "duck", ("drinking", "glass"): "glass", ("power", "tool"): "power tool",
    ("hand", "tool"): "hand tool", ("coffee", "cup"): "cup",
}  # fmt: skip
EVERYTHING = frozenset("everything anything".split())
_NO_NOUNS = frozenset("left right top bottom front back side order other rest place space line row table edge".split())


@dataclass
class Determiners:
    """What stands before the adjectives of a noun phrase.

    Attributes:
        end: the place after it.
        count: how many are meant, or `None`.
        ordinal: of "the second"; -1 for "the last".
        definite: whether it speaks of particular objects.
        free: whether any will do: "a mug", "two of the mugs".
        other: whether it leaves out what was named before: "the other", "another".
        every: whether it is "each" or "every": all of a kind, though its noun is singular.
    """

    end: int
    count: int | None = None
    ordinal: int | None = None
    definite: bool = False
    free: bool = False
    other: bool = False
    every: bool = False


class NounParts:
    """The pieces of noun phrases in one instruction.

    Args:
        said: the words.
        vocabulary: the nouns that are known.
    """

    def __init__(self, said: Words, vocabulary: Vocabulary) -> None:
        self.said, self.vocabulary, self.forms = said, vocabulary, vocabulary.forms

    def determiners(self, place: int) -> Determiners:
        """Read what stands before the adjectives: articles, "all", counts, ordinals, "other"."""
        said, found = self.said, Determiners(place)
        while found.end < len(said.words) and found.end - place < 7:
            at = found.end
            word, number = said.word(at), count_at(said, at)
            if word in ("same", "very", "other", "remaining") and found.definite:
                found.other = found.other or word in ("other", "remaining")
                found.end += 1
            elif word in DEFINITE or word in _PREDETERMINERS:
                found.definite = found.definite or word in DEFINITE
                found.every = found.every or (word in ("each", "every") and said.word(at + 1) not in ("of", "one"))
                found.count = 2 if word == "both" else found.count
                found.end += 1
            elif word in _INDEFINITE:
                found.free, found.end = True, at + 1
                found.other = found.other or word == "another"
                self._group(found)
            elif number is not None and not self._measured(number[1]) and 0 < number[0] < 100:
                if word == "one" and (found.count is not None or (found.definite and not self.noun_follows(at + 1))):
                    break  # "the one nearest to me"
                found.count, found.end = number[0], number[1]
                found.free = found.free or (said.word(found.end) == "of")
            elif word in ORDINALS and (
                ((found.definite or self._counted_from(at)) and self.modified(at + 1))
                or (found.definite and said.word(at + 1) in _AFTER_ORDINAL)
            ):
                found.ordinal, found.end = ORDINALS[word], at + 1
            elif word == "of" and at > place and said.word(at - 1) not in DEFINITE:
                found.end += 1
            else:
                break
        return found

    def _group(self, found: Determiners) -> None:
        """Read "pair of" after "a"."""
        word = self.said.word(found.end)
        if word in _GROUPS:
            found.count = 2 if word in ("couple", "pair") else 3 if word == "trio" else found.count
            found.end += 1 + (self.said.word(found.end + 1) == "of")

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

    def modified(self, place: int) -> bool:
        """Tell whether the word here can follow an ordinal: a noun, or what describes one."""
        word = self.said.word(place)
        return word in self.forms or word in GENERIC or word in TELLING_ADJECTIVES or word in PLACE_ADJECTIVES or (
            word not in FUNCTION_WORDS and word not in NOT_OBJECTS and word.isalpha()
        )  # fmt: skip

    def place_adjective(self, after: int, word: str, determined: bool) -> bool:
        """Return whether an adjective of place belongs to a noun."""
        if not determined:
            return False
        following = self.said.word(after)
        if following == "of" and word in _ALONE:
            return self.said.word(after + 1) in (*DEFINITE, "all", "them") and self.noun_follows(after + 2)
        if following in ("side", "of", "edge", "corner", "hand", "end", "half", "part"):
            return False
        if following in self.forms or following in GENERIC:
            return following not in _NO_NOUNS
        if following in TELLING_ADJECTIVES or following in COUNTS or following in ("two", "three", "most"):
            return self.noun_follows(after)
        return word in _ALONE

    def modifier(self, at: int, place: int) -> bool:
        """Return whether the word describes the noun that comes after it."""
        said, word = self.said, self.said.word(at)
        if word in SUPERLATIVES or (word in EXPLETIVES and at > place):
            return True
        following = said.word(at + 1)
        if word == "colour":
            return at > place
        if word == "sized" and at > place:
            return True
        if word in ("dark", "light", "bright", "pale") and following in COLOURS:
            return True
        if word in TELLING_ADJECTIVES or (word in COMPARATIVES and said.word(at - 1) in ("the", "two")):
            noun = word in self.forms and not self.noun_follows(at + 1)
            return not noun and following not in ("circle", "ring", "row", "line", *SHAPE_WORDS)
        if word in self.forms and self.forms[word][0] == word and following in self.forms:
            if following == "can" and said.word(at + 2) in _AFTER_MODAL:
                return False
            separate = word in self.vocabulary.heads and self.forms[following][0] in self.vocabulary.heads
            pair = (word, self.forms[following][0])
            return not separate or pair in self.vocabulary.compounds
        return False

    def noun_follows(self, place: int) -> bool:
        """Return whether a noun or an adjective of objects stands within the next words."""
        for each in range(place, place + 4):
            word = self.said.word(each)
            if word in self.forms or word in GENERIC:
                return not (word == "can" and self.said.word(each + 1) in _AFTER_MODAL)
            if not (word in TELLING_ADJECTIVES or word in COUNTS or word in EXPLETIVES or word.isdecimal() or word in ORDINALS or word in (
                "the", "of", "my", "your", "other", "remaining", *PLACE_ADJECTIVES, *SUPERLATIVES,
            )):  # fmt: skip
                return False
        return False

    def head(
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
        if word in GENERIC and word not in ("lot", "bits", "utensils") and word not in EVERYTHING:
            return ANY, GENERIC[word] != "one", at + 1, True, [], False
        if word in self.forms and not self._no_noun(at, place, determined or described):
            noun, many = self.forms[word]
            if not many and said.word(at + 1) in ("thing", "thingy", "one") and determined:
                return noun, many, at + 2, True, [], False  # "the hammer thing"
            if said.word(at + 1) == "of" and (filling := singular(said.word(at + 2))) in FILLINGS:
                return noun, many, at + 3, True, [filling], False
            return noun, many, at + 1, True, [], False
        if determined and (word in _IN_COMPOUNDS or word in VERBS) and said.word(at + 1) in self.forms:
            if said.word(at) != "can" and not self._no_noun(at + 1, place, True):
                noun, many = self.forms[said.word(at + 1)]  # "the jam jar", "the dinner plate"
                return noun, many, at + 2, True, [word], False
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
            modal = said.word(at + 1) in _AFTER_MODAL
            return modal or (not determined and place == at and "can" not in self.vocabulary.heads and at == 0)
        if word in SHAPE_WORDS or word in ("date", "bit") or word in _NO_NOUNS:
            return True
        if word in AMBIGUOUS and not determined:
            return self.forms[word][0] not in self.vocabulary.heads or said.word(at + 1) in ("the", "my", "all", "them")
        return word in NOT_OBJECTS and not self.forms[word][1]

    def _unknown_noun(self, at: int) -> bool:
        word = self.said.word(at)
        return (
            word.isalpha() and word != LENGTH and len(word) > 2 and word not in FUNCTION_WORDS and word not in NOT_OBJECTS
            and word not in TELLING_ADJECTIVES and word not in UNITS and word not in PATTERN_WORDS
            and not word.endswith("ly")
        )  # fmt: skip

    def numbers(self, at: int) -> tuple[tuple[int, ...], int]:
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

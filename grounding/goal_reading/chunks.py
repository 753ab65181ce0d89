"""Divide the words of an instruction into chunks: verbs, noun phrases, shapes, places, relations, lengths and joints."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import replace

from grounding.goal_reading.asides import Asides
from grounding.goal_reading.bare_adjectives import bare_adjective
from grounding.goal_reading.care import care_end
from grounding.goal_reading.chunk import Chunk, Shape
from grounding.goal_reading.conditions import condition_at
from grounding.goal_reading.goal_words import NOISE, NOISE_PHRASES
from grounding.goal_reading.headings import heading_at
from grounding.goal_reading.lost_wishes import SEVERAL_PERSONS
from grounding.goal_reading.marks import marks_at, stays_at
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.patterns import PATTERNS
from grounding.goal_reading.places import edge_at, place_at
from grounding.goal_reading.shapes import SIZE_ONE, SIZES, ShapeReader
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.goal_reading.verbs import VerbReader
from grounding.references.pattern_parts import COUNT
from grounding.references.phrases import ANY, Vocabulary

_JOINTS: Mapping[str, str] = {
    ",": "comma", "and": "and", "&": "and", "plus": "and", "+": "and", ".": "stop", "!": "stop", "?": "stop", ";": "stop",
    ":": "comma", "=": "comma", "/": "comma", "->": "comma", ">": "comma", "(": "comma", ")": "comma", "then": "then", "while": "and", "whereas": "and", "or": "or", "afterward": "then",
    "afterwards": "then", "next": "then", "finally": "then", "but": "comma", "\n": "stop", "lastly": "then",
}  # fmt: skip
_AMONG = re.compile(r"(?:of|among|amongst|out of|from among)(?= )")
_POSSESSIVE = re.compile(r"(?:to|on) (?:its|their) (?P<side>left|right)(?: hand)?(?: side)?(?! of)")
_TABLE_SETTING = re.compile(
    r"(?:set|lay|prepare|dress) (?:the |my |a |one |me a |up the )?(?:(?:dinner|breakfast|lunch|supper) )?(?:table|place setting|place|cover)(?: for (?:one|me|dinner|lunch|breakfast|supper|a guest|a meal|one person|us))*"
)
_PERSONS = "people|persons|guests|of us|diners|friends|kids|children|adults"
_FOR_SEVERAL = re.compile(
    rf"for (?:(?!(?:one|1)\b){COUNT}(?: (?:{_PERSONS})(?: (?:sitting|seated|eating|dining|facing)(?: \w+)?)?|(?=$| (?:[.,;!?]|and|on|at|in|please|with)))"
    rf"|(?:a|the|our|my) (?:whole )?(?:family|couple|party|group|crowd)(?: of {COUNT})?|(?:both|all) of us|everyone|everybody)"
)
_DIAGONAL = re.compile(
    r"diagonal(?:ly)?|zig ?zag|spiral|heart|star|(?:the )?(?:letter|word)s? (?P<l>\w+)|upside down|degrees?"
)

_WHILE = frozenset(("as long as", "so long as", "provided", "provided that", "providing", "providing that", "on condition that"))


class Chunker:
    """The division of one instruction into chunks.

    Args:
        said: the words, with one word in place of each length.
        metres: place of such a word -> the length.
        vocabulary: the nouns that are known.
    """

    def __init__(self, said: Words, metres: Mapping[int, float], vocabulary: Vocabulary) -> None:
        self.said, self.metres = said, metres
        self.phrases = NounPhraseReader(said, vocabulary)
        self.shapes = ShapeReader(said, self.phrases)
        self.verbs = VerbReader(said, self.phrases)
        self.asides = Asides(said, vocabulary)

    def chunks(self) -> list[Chunk]:
        """Return the chunks, in the order of the text; each word is in one of them."""
        found: list[Chunk] = []
        place = 0
        while place < len(self.said.words):
            chunk = self._chunk(place, found)
            chunk = replace(chunk, said=self.said.quote(chunk.first, chunk.end))
            lengths = [self.metres[i] for i in range(chunk.first, chunk.end) if i in self.metres]
            if lengths and chunk.metres is None:
                chunk = replace(chunk, metres=lengths[0])
            found.append(chunk)
            place = chunk.end
        return _postposed(found)

    def _chunk(self, place: int, before: list[Chunk]) -> Chunk:
        if (particle := self.verbs.particle(place, before)) is not None:
            return particle
        if (end := care_end(self.said, place, self.phrases)) is not None:
            return Chunk("noise", True, place, end)
        options = [
            *self._patterns(place, before), *self._special(place, before), *self._shape(place, before), *self._place(place),
            *self.verbs.at(place, before), *self._noun_phrase(place, before), *self._joint(place), *self._noise(place, before),
            *self._aside(place, before),
        ]  # fmt: skip
        longest = max(options, key=lambda chunk: chunk.end, default=None)  # of equal length the first
        if (condition := condition_at(self.said, place)) is not None and not self._idle_behind(place):
            words, end = condition
            phrase = self.phrases.at(end)
            if words in _WHILE and phrase is not None and stays_at(self.said, phrase.end):
                return Chunk("and", True, place, end)  # "as long as the bowl stays where it is"
            if longest is None or longest.end < end or (longest.end == end and longest.kind in ("noise", "unknown")):
                return Chunk("condition", words, place, end)
        if longest is not None:
            return longest
        return Chunk("unknown", self.said.word(place), place, place + 1)

    def _idle_behind(self, place: int) -> bool:
        """Return whether a joint stands before a condition that is only polite: "but whenever you find a minute"."""
        return self.said.word(place) in ("but", "and", "or") and self.asides.idle_condition(place + 1)

    def _patterns(self, place: int, before: list[Chunk]) -> list[Chunk]:
        found = []
        for kind, pattern, value in PATTERNS:
            if match := self.said.match(pattern, place):
                says = value(match[0]) if value is not None else True
                if kind == "relation?" and match[0].group().endswith("over") and not self._named(match[1]):
                    found.append(Chunk("noise", True, place, match[1]))  # "shift it over so it's behind the box"
                    continue
                if kind == "rows" and says == 1:  # "in one row" is a line
                    found.append(Chunk("shape", Shape("line", linked=True), place, match[1]))
                elif says is not None and not (kind == "order end" and not _ordering(before)):
                    found.append(Chunk(kind, says, place, match[1]))
        return found

    def _shape(self, place: int, before: list[Chunk]) -> list[Chunk]:
        return [] if self.verbs.needed(place) else self.shapes.at(place, before)

    def _named(self, place: int) -> bool:
        """Return whether objects or a structure are named from here on."""
        return self.phrases.at(place) is not None or bool(self.shapes.at(place, []))

    def _special(self, place: int, before: list[Chunk]) -> list[Chunk]:
        said, found = self.said, []
        if match := said.match(_POSSESSIVE, place):
            found.append(Chunk("relation it", f"{match[0].group('side')} of", place, match[1]))
        if (
            (match := said.match(SIZE_ONE, place))
            and before
            and (before[-1].kind in ("comma", "stop") or before[-1].said.lower().endswith(" be"))
            and any(one.kind == "shape" for one in before)
        ):
            found.append(Chunk("size", SIZES[match[0].group("size")], place, match[1]))
        if match := said.match(_TABLE_SETTING, place):
            found.append(Chunk("table setting", "table setting", place, match[1]))
        if before and _is_setting(before[-1]) and (match := said.match(_FOR_SEVERAL, place)):
            found.append(Chunk("unknown", SEVERAL_PERSONS, place, match[1]))  # a setting is for one
        if (heading := heading_at(said, place)) is not None:
            found.append(Chunk("rotation", heading[0], place, heading[1]))
        found += marks_at(said, place, before, self.phrases)
        if (scope := self._scope(place, before)) is not None:
            found.append(scope)
        if match := said.match(_DIAGONAL, place):
            found.append(Chunk("unknown", match[0].group(), place, match[1]))
        return found

    def _scope(self, place: int, before: list[Chunk]) -> Chunk | None:
        """Read the group that a sentence chooses from: "of the three red cups, ..."."""
        match = self.said.match(_AMONG, place)
        if match is None or (before and before[-1].kind not in ("stop", "then", "noise")):
            return None
        group = self.phrases.at(match[1])
        if group is None or group.kind != "objects" or not group.many or self.said.word(group.end) != ",":
            return None
        return Chunk("among", group, place, group.end + 1)

    def _place(self, place: int) -> list[Chunk]:
        if self._adjective_of_noun(place):
            return []
        found = []
        if (edge := edge_at(self.said, place)) is not None:
            found.append(Chunk("along", edge[0], place, edge[1]))
        if (spot := place_at(self.said, place)) is not None:
            found.append(Chunk("place", spot[0], place, spot[1]))
        return found

    def _adjective_of_noun(self, place: int) -> bool:
        """Return whether what looks like a place describes objects: "on the rightmost one", "on the left plate"."""
        at = place + 1 + (self.said.word(place + 1) == "to")
        if self.said.word(place) not in ("on", "onto", "in", "into", "to", "at", "near", "by"):
            return False
        phrase = self.phrases.at(at) if self.said.word(at) == "the" else None
        return phrase is not None and phrase.kind == "objects" and phrase.side is not None and phrase.end > at + 2

    def _noun_phrase(self, place: int, before: list[Chunk]) -> list[Chunk]:
        phrase = self.phrases.at(place) or bare_adjective(self.said, place, before)
        if self.asides.endearment(place):
            return []
        if phrase is not None and phrase.text.lower().endswith(" other") and self.said.word(phrase.end) in ("left", "right"):
            return [Chunk("unknown", phrase.text, place, phrase.end + 1)]  # "my other left"
        if any(one.kind == "another" for one in marks_at(self.said, place, before, self.phrases)):
            return []  # "a tower of the red blocks and another one of the blue blocks"
        return [] if phrase is None else [Chunk("noun phrase", phrase, place, phrase.end)]

    def _aside(self, place: int, before: list[Chunk]) -> list[Chunk]:
        phrase = before[-1].value if before and before[-1].kind == "noun phrase" else None
        if self.said.word(place) in ("was", "were") and any(
            one.kind == "noise" and one.said.lower().endswith(" if") for one in before
        ):
            return [Chunk("noise", True, place, place + 1)]  # "it would be nice if the spoon was in the bowl"
        fresh = all(one.kind in ("noise", "mentioned") for one in _sentence(before))
        end = self.asides.at(place, phrase is not None, phrase is not None and phrase.many, fresh)
        if end is None:
            return []
        after_stop = before[max((i + 1 for i, one in enumerate(before) if one.kind == "stop"), default=0) :]
        opening = all(one.kind in ("noise", "mentioned", "and", "comma") for one in after_stop)
        named = [
            phrase
            for at in range(place, end)
            if (phrase := self.phrases.at(at)) is not None and phrase.kind == "objects" and phrase.end <= end
            and phrase.text.lower() != "can"
        ]
        named = [phrase for phrase in named if phrase.mention.known and phrase.mention.noun != ANY]
        return [Chunk("mentioned", named, place, end) if opening and named else Chunk("noise", True, place, end)]

    def _joint(self, place: int) -> list[Chunk]:
        kind = _JOINTS.get(self.said.word(place))
        if self.said.words[place : place + 3] == ("as", "well", "as"):
            return [Chunk("and", True, place, place + 3)]
        if kind == "and" and self.said.word(place + 1) == "also":
            return [Chunk("and", True, place, place + 2)]
        if kind == "and" and self.said.word(place + 1) == "then":
            return [Chunk("then", True, place, place + 2)]
        return [Chunk(kind, True, place, place + 1)] if kind else []

    def _noise(self, place: int, before: list[Chunk]) -> list[Chunk]:
        for length in range(min(8, len(self.said.words) - place), 1, -1):
            if " ".join(self.said.words[place : place + length]) in _NOISE_PHRASES:
                return [Chunk("noise", True, place, place + length)]
        word = self.said.word(place)
        if (
            word.isdecimal()
            and self.said.word(place + 1) in (".", ")", ":")
            and self.said.word(place - 1) in ("", ".", ",", ";", "and", "(")
        ):
            return [Chunk("stop", True, place, place + 2)]  # "1. stack the cans 2. ..."
        if len(word) > 4 and word.endswith("ly") and word not in _MANNERS_THAT_MATTER:
            return [Chunk("noise", True, place, place + 1)]  # how it is done: "swiftly"
        if len(word) == 1 and unicodedata.category(word) == "So":
            return [Chunk("noise", True, place, place + 1)]  # a picture of a smile
        if word == "one" and self.said.word(place - 1) in ("left", "right") and before and before[-1].kind == "place":
            return [Chunk("noise", True, place, place + 1)]  # "in the front right one": a corner, as before
        if word in NOISE or word in "'\"()":
            return [Chunk("noise", True, place, place + 1)]
        if word == LENGTH:
            return [Chunk("length", True, place, place + 1)]
        return []


def _is_setting(chunk: Chunk) -> bool:
    return chunk.kind == "table setting" or (isinstance(chunk.value, Shape) and chunk.value.name == "table setting")


def _sentence(before: list[Chunk]) -> list[Chunk]:
    """Return the chunks of the sentence that is not ended yet."""
    stops = [i for i, one in enumerate(before) if one.kind in ("stop", "comma")]
    return before[stops[-1] + 1 :] if stops else before


def _postposed(chunks: list[Chunk]) -> list[Chunk]:
    """Put "the box excluded" as "except the box"."""
    kept: list[Chunk] = []
    for chunk in chunks:
        if (
            chunk.said.lower() in ("excluded", "excepted", "omitted", "excluding")
            and kept
            and kept[-1].kind == "noun phrase"
        ):
            phrase = kept.pop()
            while kept and kept[-1].kind in ("comma", "and", "noise"):
                kept.pop()
            kept += [replace(chunk, kind="except", value=True), phrase]
        else:
            kept.append(chunk)
    return kept


def _ordering(before: list[Chunk]) -> bool:
    """Return whether what was said before has an order: only then "the tallest on the left" is one, and no object."""
    last = next((chunk for chunk in reversed(before) if chunk.kind not in ("noise", "comma")), None)
    if before and before[-1].kind == "comma" and last is not None and last.kind == "verb" and last.value in ("line", "stack"):
        return True  # "I want the cans lined up, shortest on the left"
    if last is None or last.kind in ("verb", "then", "stop", "relation"):
        return (
            last is not None and last.kind == "stop" and any(chunk.kind in ("order", "order end") for chunk in before)
        )
    shapes = {"line", "arc", "tower"}
    return any(
        chunk.kind in ("order", "order end", "side by side", "stacked", "along")
        or (chunk.kind == "verb" and chunk.value in ("line", "stack", "sort"))
        or (chunk.kind == "shape" and chunk.value.name in shapes)
        for chunk in before
    )


# Adverbs that say how objects lie, and not how the arm should work.
_MANNERS_THAT_MATTER = frozenset(
    "alternately alternatingly diagonally vertically horizontally alphabetically randomly circularly separately perpendicularly obliquely upwardly "
    "widely closely tightly loosely randomly chronologically symmetrically radially individually repeatedly doubly only daily family jelly ugly "
    "sparsely densely crosswisely spirally partly halfly internally externally outwardly inwardly".split()
)
_NOISE_PHRASES = frozenset(NOISE_PHRASES)

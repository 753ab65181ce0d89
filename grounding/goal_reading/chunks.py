"""Divide the words of an instruction into chunks: verbs, noun phrases, shapes, places, relations, lengths and joints."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from grounding.corpus.templates import all_phrases
from grounding.goal_reading.asides import Asides
from grounding.goal_reading.goal_words import NOISE, NOISE_PHRASES, SHAPE_NOUNS, VERB_PHRASES, VERBS
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.patterns import PATTERNS, number_of
from grounding.goal_reading.places import edge_at, place_at
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.references.phrases import ANY, Vocabulary
from grounding.structure_words import STRUCTURES

_DETERMINERS = frozenset("the a an my your our this that these those its their one".split())
_LINK = re.compile(
    r"(?:(?:so that|so|such that|until|and|which|that|to) (?:they|it|these|those|you|we)?(?: all)? ?(?:form|forms|make|makes|build|builds|become|get|are in|is in|end up in|create|have|has)(?= (?:a|an|one|the)\b)"
    r"|to (?:form|make|build|create|become)|forming|making|creating|building|shaped like|in the (?:form|shape) of|in the shape|into the (?:form|shape) of|as|into|in to|in|like|out as|up into|up in|up as|out in|out into|of)(?= )"
)
_SHAPE_DETERMINER = re.compile(r"(?:the|a|an|one|this|that|another|some|my|two|three|another|single)(?= )")
_SIZES = {
    **dict.fromkeys("small little tiny tight compact narrow dense short mini smallish snug".split(), "small"),
    **dict.fromkeys(("medium", "medium sized", "mid sized", "moderate", "medium size", "average sized"), "medium"),
    **dict.fromkeys("large big wide huge broad long loose spacious giant roomy".split(), "large"),
}
_SIZE_ONE = re.compile(
    rf"(?:a |an )?(?:(?:nice|really|very|pretty|quite) )*(?P<size>{'|'.join(word for word in _SIZES if ' ' not in word)}) one(?= [,.;!]|$)"
)  # "a row, a long one"
_FILLERS = frozenset(
    "neat nice straight perfect tidy even single proper regular simple pretty good closed full complete beautiful lovely normal really "
    "very quite rather fairly clean exact standard equal solid hollow flat upright standing vertical plain round rectangular evenly spaced nicely properly"
    " separate different identical matching distinct fully new parallel stable basic little equilateral symmetrical symmetric circular".split()
)
_DIR = (
    r"(?:(?:to|toward|at|on|in|into) )?(?:the |my |your |its )?(?P<dir>left|right|north|south|east|west|me|us|you|robot|arm|front|back|rear|far side|far edge|near side|near edge|"
    r"away from me|away from you|away from us|away from the robot|away from the arm|away|camera)(?: (?:side|edge|hand side|hand|end))?(?: of the (?:table|desk))?"
)
_HEADINGS = {
    **dict.fromkeys(("left", "west"), "west"), **dict.fromkeys(("right", "east"), "east"),
    **dict.fromkeys(("me", "us", "you", "robot", "arm", "front", "south", "near side", "near edge", "camera"), "south"),
    **dict.fromkeys(("back", "rear", "north", "far side", "far edge", "away"), "north"),
    **{f"away from {who}": "north" for who in ("me", "you", "us", "the robot", "the arm")},
}  # fmt: skip
_FACING = re.compile(
    r"(?:(?:so that|so|and|with|which|that|it|they|is|are|have|having|make|has|,) )*"
    r"(?:(?:(?:the|its|their|a|one) )?(?:opening|gap|open side|open bit|open end|mouth|tip|point|apex|corner|top|front|ends|entrance|open part|bulge|hollow side|vertex|hollow) )?"
    rf"(?:(?:is|are) )?(?:facing|faces|face|pointing|points|point|looking|looks|oriented|turned|opening|opens|open|aimed|directed|to|toward|on|at) {_DIR}(?! of)"
)
_FACING_WORDS = re.compile(
    r"\b(?:fac(?:ing|es?)|point(?:ing|s)?|look(?:ing|s)|oriented|turned|open(?:ing|s)?|aimed|directed|gap|tip|apex|mouth|entrance|vertex|corner|ends|bulge|hollow)\b"
)
_CORRECTION = re.compile(
    r"(?:(?:,|\.|!|oh|er|erm|um|uh|ah|hmm) )*(?:no wait|wait no|no sorry|sorry no|no|nope|wait|sorry|oops|whoops|scratch that|strike that|correction|i mean|i meant|i meant to say|actually"
    r"|or rather|no rather|make that|on second thought|on second thoughts|hold on|hang on|my mistake|my bad|pardon me|forget that|cancel that|or better|or actually|or no|but no|change of plan|let me correct that)"
    r"(?:(?: ,| :| \.| !| and| but)? (?:no|wait|sorry|actually|i mean|i meant|rather|oops|make that|scratch that|better|not that|that was wrong|that's wrong|of course|hold on|it should be|do|the other way|please))*(?: ,| :| \.| !)?"
)
_NOT = re.compile(r"(?:,? ?(?:and|but) )?(?:not|rather than|instead of|and not|no longer)(?= )")
_EXCEPT = re.compile(
    r"(?:, )?(?:except for|except|but not with|but not|and not|apart from|aside from|other than|excluding|excepting|leaving out|not counting|not including|with the exception of|all but|save for|minus|without|but without|bar|barring|but)(?= )"
)
_JOINTS: Mapping[str, str] = {
    ",": "comma", "and": "and", "&": "and", "plus": "and", "+": "and", ".": "stop", "!": "stop", "?": "stop", ";": "stop",
    ":": "comma", "=": "comma", "/": "comma", "->": "comma", ">": "comma", "(": "comma", ")": "comma", "then": "then", "while": "and", "whereas": "and", "or": "or", "afterward": "then",
    "afterwards": "then", "next": "then", "finally": "then", "but": "comma", "\n": "stop", "lastly": "then",
}  # fmt: skip
_THEN = re.compile(
    r"(?:(?:,|and|\.|;) )*(?:then|after that|afterwards|afterward|once (?:that's|that is|you're|you are|it's|they're|they are|this is|that has been) (?:done|finished|ready|built|complete|in place|standing)|next|finally|lastly|after(?:ward|wards)|followed by)(?:(?: ,| please| also| just| you| can| you can)*)"
)
_NEGATED = re.compile(
    r"(?:do not|don't|dont|never|please don't|must not|mustn't|should not|shouldn't|cannot|can't|avoid|no need to|not to)(?= )"
)
_POSSESSIVE = re.compile(r"(?:to|on) (?:its|their) (?P<side>left|right)(?: hand)?(?: side)?(?! of)")
_STAYS = re.compile(
    r"(?:(?:where (?:it|they) (?:is|are|was|were)(?: now)?|alone|untouched|in (?:its|their) place|as (?:it|they) (?:is|are)|out of (?:it|this)|be|there|(?:can|should|must|may|to) (?:stay|remain)(?: where (?:it|they) (?:is|are)| put| there| untouched)?|stays?(?: where (?:it|they) (?:is|are)| put| there| in place| untouched)?|remains?(?: where (?:it|they) (?:is|are)| there| in place| untouched)?))(?= [.,;!?]| and| but|$)"
)
_TABLE_SETTING = re.compile(
    r"(?:set|lay|prepare|dress) (?:the |my |a |me a |up the )?(?:(?:dinner|breakfast|lunch|supper) )?(?:table|place)(?: for (?:one|me|dinner|lunch|breakfast|supper|a guest|a meal|one person|us))*"
)
_DIAGONAL = re.compile(
    r"diagonal(?:ly)?|zig ?zag|spiral|heart|star|(?:the )?(?:letter|word)s? (?P<l>\w+)|upside down|degrees?"
)


@dataclass(frozen=True)
class Chunk:
    """A chunk of an instruction.

    Attributes:
        kind: "verb", "noun phrase", "shape", "place", "relation", "gap", "and", "comma", "unknown" and so on.
        value: what it says.
        first, end: its words.
        metres: the length in it, where it has one.
        said: its words, as they were written.
    """

    kind: str
    value: Any
    first: int
    end: int
    metres: float | None = None
    said: str = ""


@dataclass(frozen=True)
class Shape:
    """A shape and what stands with its noun: size, rotation, rows and columns; `definite` for "the row"."""

    name: str
    size: str | None = None
    rotation: str | None = None
    grid: tuple[int | None, int | None] = (None, None)
    definite: bool = False
    linked: bool = False
    count: int = 1
    side: Mapping[str, str] | None = None


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
        options = [
            *self._patterns(place, before), *self._special(place, before), *self._shape(place, before), *self._place(place),
            *self._verb(place, before), *self._noun_phrase(place), *self._joint(place), *self._noise(place),
            *self._aside(place, before),
        ]  # fmt: skip
        if options:
            return max(options, key=lambda chunk: chunk.end)  # of equal length the first
        return Chunk("unknown", self.said.word(place), place, place + 1)

    def _patterns(self, place: int, before: list[Chunk]) -> list[Chunk]:
        found = []
        for kind, pattern, value in PATTERNS:
            if match := self.said.match(pattern, place):
                says = value(match[0]) if value is not None else True
                if kind == "rows" and says == 1:  # "in one row" is a line
                    found.append(Chunk("shape", Shape("line", linked=True), place, match[1]))
                elif says is not None and not (kind == "order end" and not _ordering(before)):
                    found.append(Chunk(kind, says, place, match[1]))
        return found

    def _special(self, place: int, before: list[Chunk]) -> list[Chunk]:
        said, found = self.said, []
        if match := said.match(_POSSESSIVE, place):
            found.append(Chunk("relation it", f"{match[0].group('side')} of", place, match[1]))
        if (
            (match := said.match(_SIZE_ONE, place))
            and before
            and before[-1].kind in ("comma", "stop")
            and any(one.kind == "shape" for one in before)
        ):
            found.append(Chunk("size", _SIZES[match[0].group("size")], place, match[1]))
        if match := said.match(_TABLE_SETTING, place):
            found.append(Chunk("table setting", "table setting", place, match[1]))
        if (match := said.match(_FACING, place)) and _FACING_WORDS.search(match[0].group()):
            found.append(Chunk("rotation", _HEADINGS[match[0].group("dir")], place, match[1]))
        for length in range(min(9, len(said.words) - place), 1, -1):
            if (heading := _rotations().get(" ".join(said.words[place : place + length]))) is not None:
                found.append(Chunk("rotation", heading, place, place + length))
                break
        if (match := said.match(_CORRECTION, place)) and self._corrects(match[1], match[0].group(), before):
            found.append(Chunk("correction", match[0].group(), place, match[1]))
        if match := said.match(_NEGATED, place):
            found.append(Chunk("negated", True, place, match[1]))
        if (match := said.match(_EXCEPT, place)) and self._excepts(match[1], match[0].group(), before):
            found.append(Chunk("except", True, place, match[1]))
        if match := said.match(_NOT, place):
            found.append(Chunk("not", True, place, match[1]))
        if match := said.match(_THEN, place):
            found.append(Chunk("followed by" if "followed by" in match[0].group() else "then", True, place, match[1]))
        if (match := said.match(_STAYS, place)) and before:
            found.append(Chunk("stays", True, place, match[1]))
        if match := said.match(_DIAGONAL, place):
            found.append(Chunk("unknown", match[0].group(), place, match[1]))
        return found

    def _corrects(self, end: int, words: str, before: list[Chunk]) -> bool:
        """Return whether these words take something back, and are no opening and no "no gap"."""
        if not any(chunk.kind not in ("noise", "comma", "stop", "and") for chunk in before):
            return False
        if words.split()[-1] == "no" or words.strip(" ,.") == "no":
            return words.startswith((",", ".")) and self.said.word(end) not in (
                "gap",
                "gaps",
                "space",
                "other",
                "one",
                "more",
            )
        return not (words == "wait" or (words == "actually" and before[-1].kind == "stop" and False))

    def _excepts(self, end: int, words: str, before: list[Chunk]) -> bool:
        phrase = self.phrases.at(end)
        if phrase is None:
            return False
        if words.strip(" ,") in ("but not", "and not", "but not with"):
            return any(chunk.kind == "noun phrase" and chunk.value.many for chunk in before)
        if words.strip(" ,") != "but":
            return True
        last = before[-1] if before else None
        return (
            last is not None
            and last.kind == "noun phrase"
            and (last.value.kind == "all" or "all" in last.value.text.lower().split())
        )

    def _shape(self, place: int, before: list[Chunk]) -> list[Chunk]:
        said, at = self.said, place
        linked = said.match(_LINK, at)
        at = linked[1] if linked else at
        count = 1
        determiner = said.match(_SHAPE_DETERMINER, at)
        definite = bool(determiner) and determiner[0].group() in ("the", "this", "that")
        if determiner:
            count = {"two": 2, "three": 3}.get(determiner[0].group(), 1)
            at = determiner[1]
        size, rotation, grid, side = None, None, (None, None), None
        adjectives = 0
        while True:
            word, pair = said.word(at), " ".join(said.words[at : at + 2])
            by = re.fullmatch(
                r"(\d+|two|three|four|five|six) (?:by|x) (\d+|two|three|four|five|six)",
                " ".join(said.words[at : at + 3]),
            )
            if by:
                grid, at = (number_of(by.group(1)), number_of(by.group(2))), at + 3
            elif pair in _SIZES and self._noun_at(at + 2):
                size, at = _SIZES[pair], at + 2
            elif word in _FILLERS and not self._noun_at(at):
                at += 1
            elif word in _SIZES and not self._noun_at(at) and self._adjective_of_shape(at):
                size, at = _SIZES[word], at + 1
            elif word in STRUCTURES["line"].rotations and self._noun_at(at + 1):
                rotation, at = STRUCTURES["line"].rotations[word], at + 1
            elif word == "and" and adjectives and self._adjective_of_shape(at):
                at += 1
            else:
                break
            adjectives += 1
        noun = self._noun_at(at)
        if noun is None:
            return []
        shape, end = noun
        if count > 1 and said.word(end - 1) in ("rows", "columns"):
            return []
        if linked and linked[0].group() == "of" and not (before and before[-1].kind in ("noise", "shape")):
            return []
        if not (linked or determiner or adjectives) and not self._bare(place, end, before):
            return []
        if shape != "line" and rotation is not None:
            return []
        if shape == "tower" and said.words[at] in ("file", "column") and False:
            return []
        return [Chunk("shape", Shape(shape, size, rotation, grid, definite, bool(linked), count, side), place, end)]

    def _adjective_of_shape(self, at: int) -> bool:
        for each in range(at + 1, at + 5):
            if self._noun_at(each):
                return True
            word = self.said.word(each)
            if not (
                word in _FILLERS
                or word in _SIZES
                or word in STRUCTURES["line"].rotations
                or word in (",", "and", "by", "x")
                or word.isdecimal()
            ):
                return False
        return False

    def _noun_at(self, at: int) -> tuple[str, int] | None:
        for length in (5, 4, 3, 2, 1):
            words = self.said.words[at : at + length]
            if len(words) < length:
                continue
            noun = " ".join(words)
            for form in (noun, noun[:-1] if noun.endswith("s") else noun):
                if form in SHAPE_NOUNS:
                    following = self.said.word(at + length)
                    forms = self.phrases.forms
                    if (
                        length == 1
                        and following in forms
                        and forms[following][0] != following
                        and SHAPE_NOUNS[form] in ("square", "triangle")
                    ):
                        return None  # "the square boxes"
                    return SHAPE_NOUNS[form], at + length
        return None

    def _bare(self, place: int, end: int, before: list[Chunk]) -> bool:
        """Return whether a noun of a shape without an article is one: "circle of cups", "in row", "triangle, please"."""
        word, following = self.said.word(place), self.said.word(end)
        last = next((chunk for chunk in reversed(before) if chunk.kind != "noise"), None)
        if (
            last is not None
            and last.kind == "noun phrase"
            and (VERBS.get(word) is None or self.phrases.at(end) is None)
        ):
            return True
        opening = last is None or last.kind in (
            "and",
            "comma",
            "stop",
            "then",
            "verb",
            "correction",
            "not",
            "shape",
            "size",
        )
        if word in VERBS and last is not None and last.kind not in ("verb", "correction"):
            return following in ("of", "on", "in", "at") and opening
        if word in VERBS or word == "line":
            return following in ("of", "on", "in", "at", "with", "around", ",", ".", "") or (
                last is not None and last.kind == "correction" and following == ""
            )
        return opening

    def _place(self, place: int) -> list[Chunk]:
        found = []
        if (edge := edge_at(self.said, place)) is not None:
            found.append(Chunk("along", edge[0], place, edge[1]))
        if (spot := place_at(self.said, place)) is not None:
            found.append(Chunk("place", spot[0], place, spot[1]))
        return found

    def _verb(self, place: int, before: list[Chunk]) -> list[Chunk]:
        said = self.said
        if said.word(place - 1) in _DETERMINERS and said.word(place - 1) not in ("that", "this"):
            return []
        for length in (4, 3, 2):
            if place + length > len(said.words):
                continue
            phrase = " ".join(said.words[place : place + length])
            if place + length <= len(said.words) and (kind := VERB_PHRASES.get(phrase)) is not None:
                return [Chunk("noise" if kind == "noise" else "verb", kind, place, place + length)]
        word = said.word(place)
        if word in ("turn", "transform", "convert") and any(
            pair in (("into", "a"), ("into", "an"), ("into", "one"))
            for pair in zip(said.words[place : place + 9], said.words[place + 1 : place + 10], strict=False)
        ):
            return [Chunk("verb", "place", place, place + 1)]
        stem = word
        if word not in VERBS:
            for ending, instead in (("ing", ""), ("ing", "e"), ("ed", ""), ("ed", "e"), ("s", ""), ("es", "")):
                stem = word.removesuffix(ending) + instead if word.endswith(ending) else word
                if len(stem) > 2 and stem[-1:] == stem[-2:-1] and stem not in VERBS and stem[:-1] in VERBS:
                    stem = stem[:-1]
                if stem in VERBS:
                    break
        if stem in VERBS:
            particle = said.word(place + 1) in ("up", "out", "down", "over", "around", "together") and VERBS[
                stem
            ] not in ("cluster",)
            end = (
                place
                + 1
                + (particle and said.word(place + 1) in ("up", "out", "down") and said.word(place + 2) != "of")
            )
            kind = VERBS[stem]
            if kind == "surround" and word in ("circle", "ring") and self.phrases.at(end) is None:
                return []
            if stem != word and kind in ("place", "make", "take"):
                return [Chunk("noise", kind, place, place + 1)] if before else []
            return [Chunk("verb", kind, place, end)]
        return []

    def _noun_phrase(self, place: int) -> list[Chunk]:
        phrase = self.phrases.at(place)
        return [] if phrase is None else [Chunk("noun phrase", phrase, place, phrase.end)]

    def _aside(self, place: int, before: list[Chunk]) -> list[Chunk]:
        phrase = before[-1].value if before and before[-1].kind == "noun phrase" else None
        if self.said.word(place) in ("was", "were") and any(
            one.kind == "noise" and one.said.lower().endswith(" if") for one in before
        ):
            return [Chunk("noise", True, place, place + 1)]  # "it would be nice if the spoon was in the bowl"
        end = self.asides.at(place, phrase is not None, phrase is not None and phrase.many)
        if end is None:
            return []
        opening = not before or before[-1].kind == "stop"
        named = [
            phrase
            for at in range(place, end)
            if (phrase := self.phrases.at(at)) is not None and phrase.kind == "objects" and phrase.end <= end
        ]
        named = [phrase for phrase in named if phrase.mention.known and phrase.mention.noun != ANY]
        return [Chunk("mentioned", named, place, end) if opening and named else Chunk("noise", True, place, end)]

    def _joint(self, place: int) -> list[Chunk]:
        kind = _JOINTS.get(self.said.word(place))
        if self.said.words[place : place + 3] == ("as", "well", "as"):
            return [Chunk("and", True, place, place + 3)]
        if kind == "and" and self.said.word(place + 1) == "then":
            return [Chunk("then", True, place, place + 2)]
        return [Chunk(kind, True, place, place + 1)] if kind else []

    def _noise(self, place: int) -> list[Chunk]:
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
        if word == "if" and self.said.word(place + 1) not in ("you", "possible", "i", "we"):
            return [Chunk("unknown", "if", place, place + 1)]  # a condition
        if word in NOISE or word in "'\"()":
            return [Chunk("noise", True, place, place + 1)]
        if word == LENGTH:
            return [Chunk("length", True, place, place + 1)]
        return []


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


@lru_cache(maxsize=1)
def _rotations() -> dict[str, str]:
    found: dict[str, str] = {}
    for value, phrases in all_phrases()["rot"].items():
        found |= {_spelled(phrase): value for phrase in phrases}
    for structure in STRUCTURES.values():
        own = structure.own_phrases.get("rot")
        for value, phrases in (own.phrases if own else {}).items():
            found |= {_spelled(phrase): value for phrase in phrases}
    return {phrase: value for phrase, value in found.items() if " " in phrase}


def _spelled(phrase: str) -> str:
    return " ".join(
        phrase.lower()
        .replace("-", " ")
        .replace("towards", "toward")
        .replace("centre", "center")
        .replace(",", " ,")
        .split()
    )

"""Read the nouns of shapes with what stands before them: "in a small circle", "as two rows", "into a 3 by 3 grid"."""

from __future__ import annotations

import re

from grounding.goal_reading.chunk import Chunk, Shape
from grounding.goal_reading.goal_words import SHAPE_NOUNS
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.patterns import number_of
from grounding.goal_reading.tokens import LENGTH, Words
from grounding.goal_reading.verb_words import VERBS
from grounding.structure_words import STRUCTURES

_LINK = re.compile(
    r"(?:(?:so that|so|such that|until|and(?! (?:make|build|form|create) )|which|that|to) (?:they|it|these|those|you|we)?(?: all)? ?(?:form|forms|make|makes|build|builds|become|get|are in|is in|end up in|create|have|has)(?= (?:a|an|one|the)\b)"
    r"|to (?:form|make|build|create|become)|forming|making|creating|building|shaped like|in the (?:form|shape) of|in the shape|into the (?:form|shape) of|as|into|in to|in|like|(?:along|on|onto|at|for|as|in|forming|tracing|trace|to trace|following|outlining) (?:the )?(?:outline|(?:\w+ )?corners|vertices|sides|perimeter|circumference|rim|shape|contour|border) of|along(?= (?:a|an|one|two)\b)|out as|up into|up in|up as|out in|out into|of)(?= )"
)
_SHAPE_DETERMINER = re.compile(r"(?:a (?:second|third|further|different|separate)|the|a|an|one|this|that|another|some|my|two|three|another|single)(?= )")
SIZES = {
    **dict.fromkeys("small little tiny tight compact narrow dense short mini smallish snug".split(), "small"),
    **dict.fromkeys(("medium", "medium sized", "mid sized", "moderate", "medium size", "average sized"), "medium"),
    **dict.fromkeys("large big wide huge broad long loose spacious giant roomy".split(), "large"),
}
SIZE_ONE = re.compile(
    rf"(?:a |an )?(?:(?:nice|really|very|pretty|quite) )*(?P<size>{'|'.join(word for word in SIZES if ' ' not in word)}) one"
    r"(?= [,.;!]|$| (?:on|at|in|near|along) (?:the|my|your)\b)"
)  # "a row, a long one"
_FILLERS = frozenset(
    "neat nice straight perfect tidy even single proper regular simple pretty good closed full complete beautiful lovely normal really "
    "very quite rather fairly clean exact standard equal solid hollow flat upright standing vertical plain round rectangular evenly spaced nicely properly"
    " separate different identical matching distinct fully new parallel stable basic little equilateral symmetrical symmetric circular".split()
)


_MEASURED = {"long": "length of", "wide": "wide", "radius": "radius", "diameter": "diameter", "across": "diameter"}


class ShapeReader:
    """A reader of shapes.

    Args:
        said: the words.
        phrases: reads the noun phrases among them.
    """

    def __init__(self, said: Words, phrases: NounPhraseReader) -> None:
        self.said, self.phrases = said, phrases

    def at(self, place: int, before: list[Chunk]) -> list[Chunk]:
        """Read the shape that begins at a place: a list of one chunk, or of none."""
        said, at = self.said, place
        linked = said.match(_LINK, at)
        at = linked[1] if linked else at
        count = 1
        determiner = said.match(_SHAPE_DETERMINER, at)
        definite = bool(determiner) and determiner[0].group() in ("the", "this", "that")
        if determiner:
            count = {"two": 2, "three": 3}.get(determiner[0].group(), 1)
            at = determiner[1]
        size, rotation, grid, measured = None, None, (None, None), None
        adjectives = 0
        while True:
            word, pair = said.word(at), " ".join(said.words[at : at + 2])
            by = re.fullmatch(
                r"(\d+|two|three|four|five|six) (?:by|x) (\d+|two|three|four|five|six)",
                " ".join(said.words[at : at + 3]),
            )
            if by:
                grid, at = (number_of(by.group(1)), number_of(by.group(2))), at + 3
            elif word == LENGTH and (after := self._measured(at)) is not None:
                measured, at = after
            elif pair in SIZES and self._noun_at(at + 2):
                size, at = SIZES[pair], at + 2
            elif word in _FILLERS and not self._noun_at(at):
                at += 1
            elif word in SIZES and not self._noun_at(at) and self._adjective_of_shape(at):
                size, at = SIZES[word], at + 1
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
        if count == 1 and linked and not determiner and self._plural(at, end):
            count = 0  # "in separate towers"
        if count > 1 and said.word(end - 1) in ("rows", "columns"):
            return []
        if linked and linked[0].group() == "of" and not (before and before[-1].kind in ("noise", "shape")):
            return []
        if not (linked or determiner or adjectives) and not self._bare(place, end, before):
            return []
        if shape != "line" and rotation is not None:
            return []
        return [Chunk("shape", Shape(shape, size, rotation, grid, definite, bool(linked), count, measured), place, end)]

    def _measured(self, at: int) -> tuple[str, int] | None:
        """Read what the length before a noun says, and the place after it: "40 cm long", "24 cm wide", "12 cm radius"."""
        word = self.said.word(at + 1)
        kind = _MEASURED.get(word)
        if kind is not None and self._adjective_of_shape(at + 1):
            return kind, at + 2
        noun = self._noun_at(at + 1)
        return ("length of", at + 1) if noun is not None and noun[0] == "line" else None

    def _plural(self, at: int, end: int) -> bool:
        return " ".join(self.said.words[at:end]) not in SHAPE_NOUNS

    def _adjective_of_shape(self, at: int) -> bool:
        for each in range(at + 1, at + 5):
            if self._noun_at(each):
                return True
            word = self.said.word(each)
            if not (
                word in _FILLERS
                or word in SIZES
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
        if last is not None and last.kind == "comma" and last.said.strip() in (":", ">", "=") and following in (*"., ;!", ""):
            return True  # "cups: circle"
        if word == "plus" and end == place + 1 and self.phrases.at(end) is not None:
            return False  # "the red blocks plus the orange block"
        if word in VERBS and last is not None and last.kind not in ("verb", "correction"):
            return following in ("of", "on", "in", "at") and opening
        if word in VERBS or word == "line":
            return following in ("of", "on", "in", "at", "with", "around", ",", ".", "") or (
                last is not None and last.kind == "correction" and following == ""
            )
        return opening

"""Find which parts of a goal, and which objects of the scene, the words of a correction mean."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from grounding.dialogue.goal_changes import objects_of, references_of
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.references.attributes import TELLING_ADJECTIVES, SceneObject, is_color
from grounding.references.candidates import Candidates
from grounding.references.mentions import read_mentions
from grounding.references.object_names import read_name, vocabulary
from grounding.references.phrases import ANY, Mention
from grounding.structure_words import STRUCTURES

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

Span = tuple[int, int]
# Noun -> the shape that it names.
SHAPE_OF_NOUN = {
    noun: shape
    for shape, words in STRUCTURES.items()
    for noun in (shape, *words.words.nouns, *words.words.never_objects)
}  # fmt: skip
_NO_OBJECT = re.compile(r"\b(?:instead|rather than)\b|(?<= )\d+(?:\.\d+)? ?(?:cm|mm|centi\w+|milli\w+|inch\w*|met(?:er|re)s?)\b")
_COUNTS = {word: number for number, words in enumerate(
    ("1 one first "
     "1st", "2 two second 2nd", "3 three third 3rd", "4 four fourth 4th", "5 five fifth 5th", "6 six sixth 6th",
     "7 seven seventh 7th", "8 eight eighth 8th", "9 nine ninth 9th", "10 ten tenth", "11 eleven", "12 twelve")
) for word in words.split()}  # fmt: skip
_COUNT = "|".join(sorted(_COUNTS, key=len, reverse=True))
_NUMBERED = re.compile(
    rf"\(?\bparts? (?P<counts>(?:number )?(?:\d+|{_COUNT})(?:(?:,| and|, and) (?:\d+|{_COUNT}))*)\b\)?"
)
_ORDINAL = re.compile(rf"\b(?:the |that )?(?P<count>{_COUNT}|last) (?:part|one|structure|thing|goal)\b(?! of)")
# "The second at the back": without a noun.
_ORDINAL_ALONE = re.compile(
    r"^(?:(?:and|but|no|now|please|only|just|keep|drop|forget|remove|make|put|move)[ ,]+)*"
    r"the (?P<count>first|second|third|fourth|fifth|last)(?= (?:at|on|to) (?:the|my)\b| please$|$)"
)
_FORMER_OR_LATTER = re.compile(r"\bthe (?P<count>former|latter)\b")
_SHAPE_NOUN = "|".join(sorted(SHAPE_OF_NOUN, key=len, reverse=True))
_ORDINAL_SHAPE = re.compile(
    rf"\b(?:the |that )?(?P<count>first|second|third|fourth|fifth|last) (?P<noun>{_SHAPE_NOUN})\b"
)
_ALL = re.compile(
    r"\b(?:both(?: of (?:them|these|those))?|all(?: of (?:them|these|those)| parts)|each(?: of them| part)?"
    r"|all the parts|both parts|every part|(?:all of it|the (?:whole )?lot|the whole thing|the whole arrangement)(?! of)"
    r")\b"
)
_SHAPE = re.compile(
    rf"(?:\b(?:the|that|this|my|your|its|no) (?:(?!one\b)\w+ )?"
    rf"|^)(?P<noun>{_SHAPE_NOUN})\b"
    rf"(?! (?:of|shape) (?:a|an) )"
)
_PLACED = re.compile(
    r"\bthe (?:(?:one|ones|part|structure) (?:(?:that (?:is|are) )?(?:on|at|in) the )?(?P<side>left|right)"
    r"|(?P<before>left|right)(?: hand)? (?:one|part|structure))\b"
)
_COLORED = re.compile(r"\b(?P<color>[a-z]{3,})s\b")
# A colour without a noun: "blue not red", "scrap the blue", "yellow in too".
_BARE_COLOR = re.compile(
    r"(?:(?<=^)|(?<=, )|(?<=\. )|(?<=\bthe )|(?<=\bnot )|(?<=\bno )|(?<=\band )|(?<=\bon )|(?<=\bof )|(?<=\bthan )|(?<=\bforget )"
    r"|(?<=\bscrap )|(?<=\bdrop )|(?<=\badd )|(?<=\bonly )|(?<=\bjust )|(?<=\bfor )|(?<=\bwith )|(?<=\bby )|(?<=\bwithout ))"
    r"(?P<color>[a-z]{3,})"
    r"(?=$|,|\.| (?:not|on|in|into|out|too|instead|rather|to|behind|left|right|at|next|beside|goes|for|by|with|stays?|also|as well|and)\b)"
)
# Before words for a part: then something is placed by it, and it stays as it is.
_BY_IT = re.compile(
    r"\b(?:left of|right of|side of|end of|front of|top of|back of|behind|next to|beside|between|near|close to|from"
    r"|around"
    r"|inside|under)(?: and)? $"
)


@dataclass(frozen=True)
class ObjectsSaid:
    """A noun phrase for objects, in a text in small letters.

    Attributes:
        indices: of the objects that it fits; empty where none is there.
        span: (first, end) characters, without its article.
        mention: as it was read.
    """

    indices: tuple[int, ...]
    span: Span
    mention: Mention


@dataclass(frozen=True)
class PartsSaid:
    """Words for parts of the goal: "the circle", "part 2", "the second one".

    Attributes:
        numbers: of the parts that they fit; empty where the goal has none.
        span: (first, end) characters.
        words: as they were said.
    """

    numbers: tuple[int, ...]
    span: Span
    words: str


def colors_of(each: SceneObject) -> tuple[str, ...]:
    """Return the colours of an object; none where they are not known."""
    return tuple(each.attributes.colors) if each.attributes is not None else ()


class GoalText:
    """A sentence about a goal, with what its words mean.

    Args:
        text: the sentence.
        goal: that it speaks of.
        objects: of the scene.
        encoder: finds what unknown nouns mean.

    Attributes:
        said: the sentence in small letters with single spaces, without the point at its end, "reds" as "red ones".
        goal, encoder: as given.
        objects, names: of the scene.
    """

    def __init__(
        self, text: str, goal: Goal, objects: Sequence[SceneObject | str | None], encoder: SentenceEncoder | None = None
    ) -> None:
        plain = re.sub(r"[’`´]", "'", text.lower())
        said = " ".join(re.sub(r"[^\w\s',.()%½¼¾\"-]", " ", plain).split()).strip(" .,")
        self.goal, self.encoder = goal, encoder
        self.objects = [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]
        self.names = [each.name for each in self.objects]
        self.said = self._with_nouns(said)

    def part_of(self, said: str) -> GoalText:
        """Return a piece of the sentence, about the same goal."""
        return GoalText(said, self.goal, self.objects, self.encoder)

    def _with_nouns(self, said: str) -> str:
        """Return "the reds" as "the red ones" and "blue" as "blue one", where no object is called so."""
        kinds = {self.kind(index) for index in range(len(self.names))}

        def written_out(match: re.Match[str]) -> str:
            color = match["color"]
            return match.group() if not is_color(color) or color in kinds else f"{color} ones"

        def with_noun(match: re.Match[str]) -> str:
            color = match["color"]
            number = sum(color in colors_of(each) for each in self.objects)
            if not number or not is_color(color) or color in kinds:
                return match.group()
            return f"{color} {'one' if number == 1 else 'ones'}"

        return _BARE_COLOR.sub(with_noun, _COLORED.sub(written_out, said))

    @cached_property
    def _candidates(self) -> Candidates:
        return Candidates(self.objects, self.encoder, False)

    def about(self, goal: Goal) -> GoalText:
        """Return the same sentence, about another goal."""
        return GoalText(self.said, goal, self.objects, self.encoder)

    def kind(self, index: int) -> str:
        """Return what an object is: "cup" for "red cup" and "cup 2"."""
        return read_name(self.names[index]).head or self.names[index]

    @cached_property
    def mentions(self) -> list[ObjectsSaid]:
        """Return the noun phrases that choose objects."""
        # "The bowl instead of the cup" has no thing that is called "instead".
        # Neither has "the drill 3 cm closer" a third drill.
        said = _NO_OBJECT.sub(lambda match: ",".ljust(len(match.group())), self.said)
        found = read_mentions(said, vocabulary(self.names)).mentions
        kept = []
        for mention in found:
            telling = (
                mention.numbers or mention.ordinal or any(word in TELLING_ADJECTIVES for word in mention.modifiers)
            )
            inside = any(first <= mention.span[0] < end for first, end in (part.span for part in self.parts))
            if (mention.noun != ANY or telling) and not inside:
                kept.append(ObjectsSaid(tuple(self._candidates.matching(mention)), mention.span, mention))
        return kept

    @cached_property
    def parts(self) -> list[PartsSaid]:
        """Return the words for parts of the goal, in their order; none that lies in another."""
        count = len(self.goal.parts)
        found: list[PartsSaid] = []

        def note(match: re.Match[str], numbers: Sequence[int]) -> None:
            first = match.start()
            if not any(one.span[0] < match.end() and first < one.span[1] for one in found):
                found.append(PartsSaid(tuple(n for n in numbers if 0 <= n < count), match.span(), match.group()))

        for match in _NUMBERED.finditer(self.said):
            note(match, [
                int(word[:9]) - 1 if word.isdecimal() else _COUNTS[word]
                for word in re.findall(rf"\b(?:\d+|{_COUNT})\b", match["counts"])
            ])  # fmt: skip
        for match in _ALL.finditer(self.said):
            note(match, range(count))
        if count > 1:
            ends = {"last": count - 1} | ({"former": 0, "latter": 1} if count == 2 else {})
            for pattern in (_ORDINAL, _ORDINAL_ALONE, _FORMER_OR_LATTER):
                for match in pattern.finditer(self.said):
                    place = ends.get(match["count"], _COUNTS.get(match["count"], -1))
                    note(match, [place])
            for match in _PLACED.finditer(self.said):
                side = match["side"] or match["before"]
                note(match, [n for n, part in enumerate(self.goal.parts) if getattr(part, "x_position", "") == side])
        for match in _ORDINAL_SHAPE.finditer(self.said):
            same = self._of_shape(SHAPE_OF_NOUN[match["noun"]])
            place = len(same) - 1 if match["count"] == "last" else _COUNTS[match["count"]]
            if len(same) > 1:
                note(match, same[place : place + 1])
        for match in _SHAPE.finditer(self.said):
            numbers = [n for n in self._of_shape(SHAPE_OF_NOUN[match["noun"]]) if self._fits(n, match.group())]
            if numbers or match.start("noun") > match.start():  # "circle of radius 15 cm" is a new one
                note(match, numbers)
        return sorted(found, key=lambda one: one.span)

    def _of_shape(self, shape: str) -> list[int]:
        """Return the numbers of the structures of a shape."""
        return [
            number for number, part in enumerate(self.goal.parts)
            if isinstance(part, StructurePart) and part.shape == shape
        ]  # fmt: skip

    def _fits(self, number: int, words: str) -> bool:
        """Return whether a place or a colour before the noun ("the left circle", "the red tower") is that of a part."""
        part = self.goal.parts[number]
        adjective = words.split()[-2] if len(words.split()) > 2 else ""
        if adjective in ("left", "right"):
            return getattr(part, "x_position", None) == adjective
        if is_color(adjective):
            known = [self.objects[index].attributes for index in objects_of(self.goal, part.objects)]
            return all(each is not None and adjective in each.colors for each in known)
        return True

    def targets(self) -> tuple[int, ...] | None:
        """Return the parts that the sentence speaks of, by their own words or by their objects; `None` without any.

        Objects that a part places count before those that it is placed by.
        """
        changing = [one for one in self.parts if not _BY_IT.search(self.said[: one.span[0]])]
        if changing:
            chosen = list(dict.fromkeys(number for one in changing for number in one.numbers))
            of_objects = self._by_objects([said for said in self.mentions if said.indices])
            both = [number for number in chosen if number in of_objects]
            return tuple(both if len(chosen) > 1 and both else chosen)
        return self._by_objects([said for said in self.mentions if said.indices]) or None

    def _by_objects(self, said: Sequence[ObjectsSaid]) -> tuple[int, ...]:
        meant = {index for one in said for index in one.indices}
        placed = [n for n, part in enumerate(self.goal.parts) if meant & set(objects_of(self.goal, part.objects))]
        if placed or not meant:
            return tuple(placed)
        return tuple(
            n for n, part in enumerate(self.goal.parts) if meant & set(objects_of(self.goal, references_of(part)))
        )

    def left_over(self, spans: Sequence[Span], fillers: frozenset[str]) -> list[str]:
        """Return the words that lie in none of the spans and say something."""
        masked = list(self.said)
        for first, end in spans:
            masked[first:end] = " " * (end - first)
        return [word for word in re.findall(r"[\w'%½¼¾]+", "".join(masked)) if word not in fillers]

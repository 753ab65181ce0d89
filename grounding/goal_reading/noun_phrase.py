"""Define what a noun phrase for objects says."""

from __future__ import annotations

from dataclasses import dataclass

from grounding.references.attributes import SUPERLATIVES
from grounding.references.phrases import ANY, Mention

_SINGULAR = frozenset(("it", "this", "that", "itself", "that one", "this one", "the former", "the latter"))


@dataclass(frozen=True)
class NounPhrase:
    """One noun phrase for objects.

    Attributes:
        kind: "objects"; "pronoun"; "all" of what there is; "rest", what no other part names; "structure", one that was
            asked for before; "each other".
        first, end: its words.
        text: as it was written.
        mention: what it says of the objects, for the kinds "objects" and "rest"; `None` where it says no more.
        borrowed: whether its noun is only "one" or is left out, so that a noun before it may be meant.
        side: the side on which the object stands that is meant: "left", "right", "near", "far" or "middle".
        half: whether the side says in which part of the table the objects stand, as in "the cups on the left".
        ordinal: of "the second block from the left", counted from `side`; -1 for the last.
        relation: how it stands to `landmark`: "behind" in "the one behind the plate".
        landmark: the phrase for the object that it stands by.
        without: phrases for what is left out of it.
        compared: whether a clause such as "nearest to me" compares the objects.
        left: of "the other three", the number.
        either: further descriptions, of which each may fit in place of the mention: "blocks that are red or blue".
        among: the group of which it is a part: "the tallest of the red cups".
        other: whether objects that were named before are left out: "the other mug", "another one".
        alike: "colour" where it has the colour of `landmark`, or without one of what is placed.
    """

    kind: str
    first: int
    end: int
    text: str
    mention: Mention | None = None
    borrowed: bool = False
    side: str | None = None
    half: bool = False
    ordinal: int | None = None
    relation: str | None = None
    landmark: NounPhrase | None = None
    without: tuple[NounPhrase, ...] = ()
    compared: bool = False
    left: int | None = None
    either: tuple[Mention, ...] = ()
    among: NounPhrase | None = None
    other: bool = False
    alike: str = ""

    @property
    def many(self) -> bool:
        """Return whether it can mean several objects."""
        if self.kind in ("all", "rest"):
            return self.left != 1
        if self.kind == "pronoun":
            return self.text.lower() not in _SINGULAR
        return self.mention is not None and self.mention.plural

    @property
    def superlative(self) -> bool:
        """Return whether it is "the tallest" or the like, without a noun or with a general one."""
        said = self.mention
        return said is not None and said.noun == ANY and any(word in SUPERLATIVES for word in said.modifiers)

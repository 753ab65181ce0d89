"""Find phrases that share one noun, given only with the last of them: "the red, the green and the blue cup"."""

from __future__ import annotations

from dataclasses import dataclass

from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.counts import JOINTS, count_before
from grounding.references.lexicon import COLOURS
from grounding.references.sentence_roles import Sentences


@dataclass(frozen=True)
class Partial:
    """A phrase without its noun.

    Attributes:
        first, start, end: the places of its first word, of its first adjective, and after its last.
        count: the number of objects, `None` for all.
        exact: whether the speaker gave the number.
    """

    first: int
    start: int
    end: int
    count: int | None
    exact: bool


def partial_phrases(said: Sentences, start: int, head: int, plural: bool, after: int) -> list[Partial]:
    """Find the phrases that share the noun at `head`, in the order of the text, without the noun's own.

    Args:
        said: the words of the text.
        start: the place of the noun's own first modifier.
        head: the noun's place.
        plural: whether the noun is a plural.
        after: the places up to this one belong to other nouns.
    """
    found: list[Partial] = []
    adjective = next((word for word in said.words[start:head] if word in TELLING_ADJECTIVES), "")
    while adjective:
        first = count_before(said, start)[2]
        end = first
        while said.word(end - 1) in JOINTS:
            end -= 1
        before = said.word(end - 1)
        if end == first or before not in TELLING_ADJECTIVES or end - 1 <= after:
            break
        apart = first < start
        colours = before in COLOURS and adjective in COLOURS and (plural or bool(found))
        start = end - 1
        while said.word(start - 1) in TELLING_ADJECTIVES and start - 1 > after:
            start -= 1
        count, exact, first = count_before(said, start)
        # With an article each they are two things; "the tall and red cup" is one. Nothing is red and blue.
        if not (apart and first < start or colours):
            break
        found.insert(0, Partial(first, start, end, 1 if count is None and not plural else count, exact))
        adjective = before
    return found

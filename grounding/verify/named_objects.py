"""Find objects that a text names and a goal leaves out: "the blue can, the red can and both apples"
of which one is lost.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from grounding.goals.goal import Goal
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.noun_contexts import noun_phrases
from grounding.resolve.phrase import Phrase
from grounding.resolve.referents import Referents

_PLACED = ("stands", "nearest", "place")


@dataclass(frozen=True)
class NamedObjects:
    """A noun phrase of a text with the objects that it means in a scene.

    Attributes:
        words: of the phrase.
        indices: of its objects.
    """

    words: str
    indices: tuple[int, ...]


def named_objects(text: str, there: Referents) -> tuple[NamedObjects, ...]:
    """Return the noun phrases of a text that mean objects for certain; none where nothing is known.

    Args:
        text: what was said.
        there: what is there.
    """
    if not there.known or there.catalogue:
        return ()
    reader = GoalPhrases(there, text)
    said = [each for _, phrase, _ in noun_phrases(reader.words, there) for each in _apart(phrase) if each.definite]
    meant = ((each.text, reader.objects_of(each)) for each in dict.fromkeys(said))
    return tuple(NamedObjects(words, tuple(found)) for words, found in meant if found)


def _apart(phrase: Phrase) -> Iterator[Phrase]:
    """Take a phrase apart where it says a place: "the banana in the bowl" may be the banana, and where it is to go."""
    yield replace(phrase, tests=tuple(each for each in phrase.tests if each[0].kind not in _PLACED))
    for test in (test for each in phrase.tests for test in each if test.kind in _PLACED):
        for other in filter(None, (test.other, test.second)):
            yield from _apart(other)


def unused(named: Sequence[NamedObjects], goal: Goal, before: Goal, kept: Collection[str] = ()) -> tuple[str, ...]:
    """Return the phrases of which no object is in a goal, or was in the goal so far.

    Args:
        named: by the text.
        goal: with the objects found.
        before: the goal so far.
        kept: words for what is left out on purpose.
    """
    if any(part.objects is None for part in goal.structures):
        return ()
    used = {*goal.named_objects(), *before.named_objects()}
    aside = " ".join(kept)
    return tuple(each.words for each in named if used.isdisjoint(each.indices) and each.words not in aside)

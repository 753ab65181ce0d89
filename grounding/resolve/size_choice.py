"""Choose objects by how large they are: "the two small ones", "the second tallest", "below fifteen centimetres"."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

from grounding.resolve.adjectives import MIDDLE
from grounding.resolve.attributes import MEASURES, ObjectAttributes, alike, by_size, of_size
from grounding.resolve.errors import ResolveError
from grounding.resolve.phrase import Rank, Test

_CLEAR = 1.5  # a volume by so much larger is larger, whatever the shape
_SEEN = 1.05  # by so much a width or a height must differ to be seen
_UNKNOWN = "the sizes of the objects are not known"


class SizeChoice:
    """The sizes of the objects of one scene.

    Args:
        attributes: of each object.
    """

    def __init__(self, attributes: Sequence[ObjectAttributes | None]) -> None:
        self._attributes = attributes

    def fitting(self, test: Test, found: list[int], count: int | None, many: bool) -> list[int]:
        """Keep the objects that an adjective of size or its comparative fits, compared with each other.

        Args:
            test: with the adjective; its value is 1 for a comparative.
            found: the objects.
            count: the number that the phrase speaks of, `None` where it does not say.
            many: whether it speaks of several.
        """
        if test.word == MIDDLE:
            return self._middle(found, many)
        if len(found) < 2 or len(found) == count:
            return found
        known = [self._attributes[i] for i in found]
        fits, order = of_size(test.word, known), by_size(test.word, known)
        if fits is None or order is None:
            raise ResolveError(_UNKNOWN)
        if not fits and MEASURES[test.word].noun == "sizes":  # of a like volume: by their height
            if any(_crosswise(one, other) for one, other in combinations(filter(None, known), 2)):
                return found  # none is for certain the larger one
            higher = Test("size", "tall" if MEASURES[test.word].sign > 0 else "short", value=test.value)
            return self.fitting(higher, found, count, many)
        one = not many and (test.value > 0 or len(found) == 2)
        wanted = count if count is not None else (1 if one else None)
        told = test.value > 0 or count is not None or len(fits) == 1
        if wanted is None or wanted >= len(found) or not told:
            return [found[i] for i in fits]
        if not self._alike(test.word, found[order[wanted - 1]], found[order[wanted]]):
            return [found[i] for i in order[:wanted]]
        return [found[i] for i in fits]

    def _middle(self, found: list[int], many: bool) -> list[int]:
        """Keep the middle one of three objects of different sizes."""
        order = by_size("large", [self._attributes[i] for i in found])
        if order is None or len(found) != 3 or many:
            raise ResolveError("it is not known which of the objects here are of a middle size")
        ranked = [found[i] for i in order]
        if any(self._alike("large", a, b) for a, b in zip(ranked, ranked[1:], strict=False)):
            raise ResolveError("the objects do not have three different sizes")
        return ranked[1:2]

    def beyond(self, test: Test, index: int) -> bool:
        """Tell whether an object is "taller than 15 cm"."""
        attributes, measure = self._attributes[index], MEASURES[test.word]
        if attributes is None or attributes.size is None:
            raise ResolveError(_UNKNOWN)
        own = measure.of(attributes.size)
        return own > test.value if measure.sign > 0 else own < test.value

    def more(self, word: str, one: int, other: int) -> bool:
        """Tell whether one object is "taller" than another."""
        first, second = self._attributes[one], self._attributes[other]
        if first is None or second is None or first.size is None or second.size is None:
            raise ResolveError(_UNKNOWN)
        measure = MEASURES[word]
        return measure.sign * (measure.of(first.size) - measure.of(second.size)) > 0

    def ranked(self, rank: Rank, found: list[int], count: int) -> list[int]:
        """Choose objects by a superlative; also those that are as large as the last chosen one."""
        order = by_size(rank.by, [self._attributes[i] for i in found])
        if order is None:
            raise ResolveError(_UNKNOWN)
        ranked = [found[i] for i in order]
        if MEASURES[rank.by].noun == "sizes":
            ranked = self._told_apart(rank.by, ranked)
        first = rank.place - 1 if rank.place > 0 else len(ranked) - 1
        chosen = ranked[first : first + count]
        further = ranked[first + count :] if chosen else []
        return [*chosen, *(i for i in further if self._tied(rank.by, chosen[-1], i))]

    def _alike(self, word: str, one: int, other: int) -> bool:
        first, second = self._attributes[one], self._attributes[other]
        if first is None or second is None:
            return False
        return alike(word, first, second) or (MEASURES[word].noun == "sizes" and _crosswise(first, second))

    def _tied(self, word: str, one: int, other: int) -> bool:
        height = MEASURES[word].noun != "sizes" or self._alike("tall", one, other)
        return height and self._alike(word, one, other)

    def _told_apart(self, word: str, ranked: list[int]) -> list[int]:
        """Sort those of a like volume by their height: a lower can is the smaller one."""
        order = list(ranked)
        for n in range(len(order) - 1):
            one, other = self._attributes[order[n]], self._attributes[order[n + 1]]
            if one is None or other is None or one.size is None or other.size is None or not alike(word, one, other):
                continue
            if MEASURES[word].sign * (other.size[2] - one.size[2]) > 0 and not alike("tall", one, other):
                order[n], order[n + 1] = order[n + 1], order[n]
        return order


def _crosswise(one: ObjectAttributes, other: ObjectAttributes) -> bool:
    """Tell whether one of two objects of a like volume is wider and the other taller: is a plate larger than a bowl?"""
    if one.size is None or other.size is None:
        return False
    volumes = sorted(math.prod(each.size) for each in (one, other) if each.size is not None)
    wider = max(one.size[:2]) / max(other.size[:2])
    taller = one.size[2] / other.size[2]
    opposite = (wider > _SEEN and taller < 1 / _SEEN) or (wider < 1 / _SEEN and taller > _SEEN)
    return opposite and volumes[1] < _CLEAR * volumes[0]

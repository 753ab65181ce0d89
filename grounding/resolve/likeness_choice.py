"""Choose objects by what they have in common: the one without a twin, the odd one out, the two of the same size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from grounding.resolve.attributes import ObjectAttributes, alike
from grounding.resolve.errors import ResolveError

_MEASURES = {"size": ("large", "tall"), "height": ("tall",), "width": ("wide",), "length": ("long",)}


class LikenessChoice:
    """The likeness of the objects of one scene.

    Args:
        attributes: of each object.
        head: gives the noun of an object.
    """

    def __init__(self, attributes: Sequence[ObjectAttributes | None], head: Callable[[int], str]) -> None:
        self._attributes, self._head = attributes, head

    def lonely(self, found: Sequence[int], by: str) -> list[int]:
        """Keep the objects that have no twin among others.

        Args:
            found: all of them.
            by: "colour" or "kind"; empty for the colour where all are of one kind, else for the kind.
        """
        by = by or ("colour" if len({self._head(i) for i in found}) == 1 else "kind")
        return [i for i in found if sum(self._same(by, i, j) for j in found) == 1]

    def odd(self, found: Sequence[int]) -> list[int]:
        """Keep the objects that alone differ from others that are alike, by colour or by kind."""
        if len(found) < 3:
            raise ResolveError("nothing is the odd one of two")
        lonely = {by: self.lonely(found, by) for by in ("colour", "kind")}
        alone = {i for by, each in lonely.items() if len(each) < len(found) for i in each}
        return [i for i in found if i in alone]

    def equal(self, found: Sequence[int], by: str, count: int | None) -> list[int]:
        """Keep the objects of which there are several alike.

        Args:
            found: those to choose from.
            by: "size", "height", "width", "length", "colour" or "kind"; empty or "pair" for kind, colour and size at
                once.
            count: how many there are, where that is said.

        Raises:
            ResolveError: where no such objects are there, or other ones might be meant.
        """
        classes: list[list[int]] = []
        for i in found:
            like = next((each for each in classes if self._same(by, each[0], i)), None)
            if like is None:
                classes.append([i])
            else:
                like.append(i)
        several = [each for each in classes if len(each) > 1 and count in (None, len(each))]
        if len(several) != 1:
            raise ResolveError("it is not clear which objects are alike")
        return several[0]

    def _same(self, by: str, one: int, other: int) -> bool:
        if by in ("", "pair"):
            return all(self._same(each, one, other) for each in ("kind", "colour", "size"))
        if by == "kind":
            return bool(self._head(one)) and self._head(one) == self._head(other)
        first, second = self._attributes[one], self._attributes[other]
        if first is None or second is None:
            raise ResolveError("nothing is known of some objects")
        if by == "colour":
            return bool(first.colors) and first.colors[:1] == second.colors[:1]
        if first.size is None or second.size is None:
            raise ResolveError("the sizes of the objects are not known")
        return one == other or all(alike(word, first, second) for word in _MEASURES[by])

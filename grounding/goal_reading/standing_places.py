"""Choose objects by where they stand: the leftmost, the second from the left, the one behind the plate."""

from __future__ import annotations

import math
from collections.abc import Sequence

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.references.attributes import MEASURES, SUPERLATIVES, SceneObject


class PlaceError(ValueError):
    """It is not known where objects stand, or how large they are."""


class StandingPlaces:
    """The places of the objects of one scene, as the speaker sees them.

    Args:
        objects: of the scene.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, objects: Sequence[SceneObject], opposite: bool) -> None:
        self._objects, self._sign = objects, -1 if opposite else 1

    def position(self, index: int) -> tuple[float, float]:
        """Return where an object stands, (away, to the left) as the speaker sees it, metres.

        Raises:
            PlaceError: where that is not known.
        """
        attributes = self._objects[index].attributes
        if attributes is None or attributes.position is None:
            raise PlaceError("it is not known where the objects stand")
        x, y = attributes.position
        return self._sign * x, self._sign * y

    def on_side(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        """Keep those of some objects that a phrase means by their place; the outermost first.

        Args:
            phrase: with a side, an ordinal or both.
            found: that its noun and its adjectives fit, as they are numbered.
        """
        side, mention = phrase.side, phrase.mention
        if len(found) < 2 or mention is None:
            return found
        if side is None:  # "the second block": as they are numbered
            place = phrase.ordinal or 1
            return found[-1:] if place < 0 else found[place - 1 : place]
        if any(word in SUPERLATIVES for word in mention.modifiers):
            return found
        if side == "middle":
            middle = sorted(found, key=lambda i: self.position(i)[1])
            return (
                [middle[len(middle) // 2]] if len(middle) % 2 else middle[len(middle) // 2 - 1 : len(middle) // 2 + 1]
            )
        order = sorted(found, key=lambda i: self._along(side, i))
        if phrase.ordinal is not None:
            return order[-1:] if phrase.ordinal < 0 else order[phrase.ordinal - 1 : phrase.ordinal]
        if not mention.plural or (mention.count or 0) > 0:
            return order[: mention.count or 1]
        steps = [self._along(side, b) - self._along(side, a) for a, b in zip(order, order[1:], strict=False)]
        widest = max(range(len(steps)), key=steps.__getitem__)
        return sorted(order[: widest + 1])

    def _along(self, side: str, index: int) -> float:
        away, left = self.position(index)
        away_from_robot = self._sign * away
        return {
            "left": -left, "right": left, "near": away, "far": -away, "robot near": away_from_robot, "robot far": -away_from_robot,
        }[side]  # fmt: skip

    def beside(self, phrase: NounPhrase, found: list[int], landmark: Sequence[int]) -> list[int]:
        """Keep those of some objects that stand as a phrase says by others, or that differ from them as it says.

        Args:
            phrase: with a relation.
            found: that its noun and its adjectives fit.
            landmark: the objects that they stand by, or are compared with.
        """
        mention, relation = phrase.mention, phrase.relation or ""
        others = [i for i in found if i not in landmark]
        assert mention is not None  # of objects
        if relation.endswith(" than"):
            return [i for i in others if all(self._more(relation.removesuffix(" than"), i, j) for j in landmark)]
        if relation in ("nearest", "farthest"):
            sign = 1 if relation == "nearest" else -1
            others.sort(key=lambda i: sign * min(math.dist(self.position(i), self.position(j)) for j in landmark))
            return others if mention.plural and mention.count is None else others[: mention.count or 1]
        kept = [i for i in others if all(self._stands(i, relation, j) for j in landmark)]
        kept = kept or [i for i in others if all(self._stands(i, relation, j, least=0.2) for j in landmark)]
        if len(kept) > 1 and not mention.plural:
            kept.sort(key=lambda i: math.dist(self.position(i), self.position(landmark[0])))
            if relation == "next to":
                return kept[:1]
        return kept

    def _stands(self, index: int, relation: str, landmark: int, least: float = 1.0) -> bool:
        (x, y), (to_x, to_y) = self.position(index), self.position(landmark)
        away, left = x - to_x, y - to_y
        if relation == "next to":
            return True
        if relation in ("on", "in"):
            attributes = self._objects[landmark].attributes
            size = attributes.size if attributes is not None else None
            return size is not None and math.hypot(away, left) < max(size[:2]) / 2
        along = {"left of": left, "right of": -left, "behind": away, "in front of": -away}.get(relation)
        across = away if relation in ("left of", "right of") else left
        return along is not None and along > 0 and along >= least * abs(across)

    def _more(self, word: str, one: int, other: int) -> bool:
        """Return whether one object is "taller" than another: more of the measure by what the eye can see."""
        measure = MEASURES[word]
        sizes = [attributes.size for i in (one, other) if (attributes := self._objects[i].attributes) is not None]
        if len(sizes) < 2 or None in sizes:
            raise PlaceError(f"it is not known how large the objects are, and {word!r} compares them")
        first, second = (measure.of(size) for size in sizes if size is not None)
        return first > second if measure.sign > 0 else first < second

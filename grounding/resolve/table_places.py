"""Choose objects by the part of the table on which they stand, as the speaker sees it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from grounding.resolve.attributes import ObjectAttributes
from grounding.resolve.errors import ResolveError

# Parts of the table that the arm can reach, metres: left of 0.16 is left; nearer than 0.36 is near, beyond 0.54 far.
_LATERAL, _NEAR, _FAR = 0.16, 0.36, 0.54
_CENTRE = (0.45, 0.0)
SIDES_OF_TABLE = {"left": (0, -1), "right": (0, 1), "near": (1, 0), "far": (-1, 0)}
# Places that differ by less than this are alike to the eye, metres.
_STEP = 0.03


class TablePlaces:
    """The places of the objects of one scene.

    Args:
        attributes: of each object.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, attributes: Sequence[ObjectAttributes | None], opposite: bool) -> None:
        self._attributes, self._sign = attributes, -1 if opposite else 1

    def position(self, index: int) -> tuple[float, float]:
        """Return where an object stands, (away, to the left) as the speaker sees it, metres.

        Raises:
            ResolveError: where that is not known.
        """
        attributes = self._attributes[index]
        if attributes is None or attributes.position is None:
            raise ResolveError("it is not known where the objects stand")
        x, y = attributes.position
        return self._sign * x, self._sign * y

    def choose(self, found: Sequence[int], sides: Sequence[str], many: bool, count: int | None) -> list[int]:
        """Keep those of some objects that stand on all of some sides; several where that is in doubt.

        Args:
            found: the objects.
            sides: of "left", "right", "near", "far", "middle", "depth" (the middle from near to far) and "ahead" (of
                the speaker, said of one).
            many: whether the phrase speaks of several.
            count: of how many; `None` where it does not say.
        """
        if len(found) < 2:
            return list(found)
        wanted = count if count is not None else (None if many else 1)
        sides = [side for side in sides if side != "ahead" or wanted == 1]
        within = [i for i in found if all(self._within(i, side, sides) for side in sides)]
        if list(sides) == ["middle"] and not many:
            amid = [i for i in within if self._within(i, "depth", sides)]
            within = amid if len(amid) == (count or 1) else within
        if wanted is None:
            return within or self._outermost(found, sides)
        if len(within) == wanted:
            return within
        if len(sides) == 1 and sides[0] == "middle" and wanted == 1:
            return self._median(found)
        start = within if len(within) > wanted else list(found)
        order = sorted(start, key=lambda i: self._badness(i, sides))
        if len(order) <= wanted:
            return order
        last = self._badness(order[wanted - 1], sides)
        return [i for n, i in enumerate(order) if n < wanted or self._badness(i, sides) - last < _STEP]

    def along(self, side: str) -> Callable[[int], float]:
        """Return the order of objects from a side of the table on: that of the least value stands outermost."""
        sign = SIDES_OF_TABLE[side]
        return lambda i: sum(a * b for a, b in zip(sign, self.position(i), strict=True))

    def between(self, found: Sequence[int], one: int, other: int) -> list[int]:
        """Keep what stands between two objects, the nearest to the line between them first."""
        (ax, ay), (bx, by) = self.position(one), self.position(other)
        length = math.dist((ax, ay), (bx, by)) or 1e-9

        def off(i: int) -> tuple[float, float]:
            x, y = self.position(i)
            share = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2
            return share, abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length

        inside = [i for i in found if i not in (one, other) and 0 < off(i)[0] < 1 and off(i)[1] < length / 3]
        return sorted(inside, key=lambda i: off(i)[1])

    def nearest(self, found: Sequence[int], landmark: Sequence[int], far: bool, count: int | None) -> list[int]:
        """Keep the objects that stand nearest to some others, or farthest from them; the first ones first."""
        sign = -1 if far else 1
        others = [i for i in found if i not in landmark]
        others.sort(key=lambda i: sign * min(math.dist(self.position(i), self.position(j)) for j in landmark))
        return others[:count]

    def beside(self, found: Sequence[int], relation: str, landmark: Sequence[int], many: bool) -> list[int]:
        """Keep the objects that stand in a relation to all of some others, the nearest first where one is meant.

        Args:
            found: the objects.
            relation: "left of", "right of", "behind", "in front of", "next to", "on" or "in".
            landmark: the others.
            many: whether several are meant.
        """
        others = [i for i in found if i not in landmark]
        # "Everything left of the bowl" is half of the table; one object is rather looked for straight to its left.
        for least in (0.2,) if many else (1.0, 0.2):
            kept = [i for i in others if all(self._stands(i, relation, j, least) for j in landmark)]
            if kept:
                break
        if len(kept) > 1 and not many:
            kept.sort(key=lambda i: math.dist(self.position(i), self.position(landmark[0])))
            return kept[:1] if relation == "next to" else kept
        return kept

    def _stands(self, index: int, relation: str, landmark: int, least: float) -> bool:
        (x, y), (to_x, to_y) = self.position(index), self.position(landmark)
        away, left = x - to_x, y - to_y
        if relation == "next to":
            return True
        if relation in ("on", "in"):
            attributes = self._attributes[landmark]
            size = attributes.size if attributes is not None else None
            return size is not None and math.hypot(away, left) < max(size[:2]) / 2
        along = {"left of": left, "right of": -left, "behind": away, "in front of": -away}[relation]
        across = away if relation in ("left of", "right of") else left
        return along > 0 and along >= least * abs(across)

    def _within(self, index: int, side: str, sides: Sequence[str]) -> bool:
        away, left = self.position(index)
        if side == "depth" or (side == "middle" and ("left" in sides or "right" in sides)):
            return _NEAR <= away <= _FAR
        if side in ("middle", "ahead"):
            return abs(left) <= _LATERAL
        return {"left": left > _LATERAL, "right": left < -_LATERAL, "near": away < _NEAR, "far": away > _FAR}[side]

    def _badness(self, index: int, sides: Sequence[str]) -> float:
        away, left = self.position(index)
        if tuple(sides) == ("middle",):
            return math.dist((away, left), _CENTRE)
        total = 0.0
        for side in sides:
            if side == "depth" or (side == "middle" and ("left" in sides or "right" in sides)):
                total += abs(away - _CENTRE[0])
            elif side in ("middle", "ahead"):
                total += abs(left)
            else:
                total += self.along(side)(index)
        return total

    def _outermost(self, found: Sequence[int], sides: Sequence[str]) -> list[int]:
        order = sorted(found, key=lambda i: self._badness(i, sides))
        steps = [self._badness(b, sides) - self._badness(a, sides) for a, b in zip(order, order[1:], strict=False)]
        widest = max(range(len(steps)), key=steps.__getitem__)
        return sorted(order[: widest + 1])

    def _median(self, found: Sequence[int]) -> list[int]:
        across = sorted(found, key=lambda i: self.position(i)[1])
        if len(found) % 2 and len(found) == 3:
            return [across[1]]
        order = sorted(found, key=lambda i: self._badness(i, ("middle",)))
        amid = self._amid(found)
        if amid is not None and amid != order[0]:
            return [amid, order[0]]  # the middle of the group, or of the table?
        if self._badness(order[1], ("middle",)) - self._badness(order[0], ("middle",)) >= _STEP:
            return order[:1]
        return [across[len(across) // 2]] if len(across) % 2 else order[:2]

    def _amid(self, found: Sequence[int]) -> int | None:
        """Return the object in the middle of a group across and from near to far; `None` where none stands there."""
        away = sorted(self.position(i)[0] for i in found)[len(found) // 2]
        left = sorted(self.position(i)[1] for i in found)[len(found) // 2]
        there = [i for i in found if math.dist(self.position(i), (away, left)) < _STEP]
        return there[0] if len(there) == 1 and len(found) % 2 else None

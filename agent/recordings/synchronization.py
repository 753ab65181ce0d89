"""Find the measurement nearest to a moment, and fuse several of a camera that stood still."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, Message, Stream

T = TypeVar("T")

_REACHES = (0.25, 2.0, 20.0, 200.0, None)  # s; how far from the moment messages are looked for, at last everywhere
_LOOKED_FOR_MORE = 1.0  # s; nearer than this, a few are not enough
_MORE_PASSED, _MOST_BYTES = 20, 200_000_000  # kept of the messages before the moment, in case the last are of no use
_MOST_SPOILT = 60  # messages that are tried one after another until one can be used
_SAME = 0.03  # share of the distance that a pixel may differ by between two looks of the same thing
_SHIFTED = 0.004  # share of the distance by which most pixels differ alike where the camera went back or forth
_MOVED = 0.05  # share of pixels that differ by more where the camera, or much before it, has moved


@dataclass(frozen=True)
class Found(Generic[T]):
    """The content of a message and its time.

    Attributes:
        value: as it was decoded.
        time: when it was recorded, nanoseconds.
    """

    value: T
    time: int


def around(
    bag: Bag, stream: Stream, moment: int, decode: Callable[[Message], T | None], before: int, after: int
) -> list[Found[T]]:
    """Return the messages of a stream around `moment` (nanoseconds of the recording), the nearest first.

    Args:
        bag: open.
        stream: of it.
        decode: gives `None`, or raises `BadInput`, for a message that is of no use.
        before, after: how many are wanted on either side; those at the moment itself count as after it.

    Raises:
        BadInput: if every message that was tried is invalid; the error of the first one.
    """
    for reach in _REACHES:
        start = None if reach is None else max(0, moment - round(reach * 1e9))
        stop = None if reach is None else moment + round(reach * 1e9)
        tried = _Tried(decode)
        passed: deque[Message] = deque()
        later: list[Found[T]] = []
        for message in bag.messages([stream], start if before else moment, stop):
            if message.recorded < moment:
                passed.append(message)
                while len(passed) > before + _MORE_PASSED or _bytes(passed) > _MOST_BYTES and len(passed) > before:
                    passed.popleft()
                continue
            if (found := tried(message)) is not None:
                later.append(found)
            if len(later) >= after or tried.enough and not later:
                break
        earlier: list[Found[T]] = []
        while passed and len(earlier) < before:
            if (found := tried(passed.pop())) is not None:
                earlier.append(found)
        scarce = len(earlier) + len(later) < after and reach is not None and reach < _LOOKED_FOR_MORE
        if (earlier or later) and not scarce:
            return sorted([*earlier, *later], key=lambda found: abs(found.time - moment))
        if tried.enough:
            break
    if tried.problem is not None:
        raise tried.problem
    return []


class _Tried(Generic[T]):
    """A decoder that keeps the error of the first invalid message."""

    def __init__(self, decode: Callable[[Message], T | None]) -> None:
        self._decode = decode
        self.problem: BadInput | None = None
        self._spoilt = 0

    @property
    def enough(self) -> bool:
        """Return whether enough messages were invalid to give up on the stream."""
        return self._spoilt >= _MOST_SPOILT

    def __call__(self, message: Message) -> Found[T] | None:
        try:
            value = self._decode(message)
        except BadInput as error:
            self.problem, self._spoilt = self.problem or error, self._spoilt + 1
            return None
        return None if value is None else Found(value, message.recorded)


def _bytes(messages: Iterable[Message]) -> int:
    return sum(len(message.raw) for message in messages)


def nearest(bag: Bag, stream: Stream, moment: int, decode: Callable[[Message], T | None]) -> Found[T] | None:
    """Return the usable message of a stream nearest to `moment`; `None` if there is none."""
    try:
        found = around(bag, stream, moment, decode, before=1, after=1)
    except BadInput:
        return None
    return found[0] if found else None


def fused(looks: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, int]:
    """Fuse several measurements of one scene into one with fewer holes and less noise.

    Args:
        looks: (H, W, 3) points each, the reference first; frames with much motion are left out.

    Returns:
        The points (H, W, 3), the look (H, W) that each was taken from, and how many looks took part. Each is a
        measured point: the one of median depth, or the reference's own where something passed before it.
    """
    reference = looks[0]
    still = [0, *(k for k in range(1, len(looks)) if _still(reference, looks[k]))]
    if len(still) == 1:
        return reference, np.zeros(reference.shape[:2], np.int64), 1
    depths = np.stack([looks[k][..., 2] for k in still])
    order = np.argsort(depths, axis=0)  # NaN comes last
    middle = np.maximum(np.isfinite(depths).sum(axis=0) - 1, 0) // 2
    chosen = np.take_along_axis(order, middle[None], axis=0)[0]
    own = reference[..., 2]
    with np.errstate(invalid="ignore"):
        passed = np.abs(np.take_along_axis(depths, chosen[None], axis=0)[0] - own) > _SAME * own
    chosen[passed] = 0
    points, taken_from = reference.copy(), np.asarray(still)[chosen]
    for k in still[1:]:
        points[taken_from == k] = looks[k][taken_from == k]
    return points, taken_from, len(still)


def _still(reference: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two measurements show the same scene from the same place."""
    if reference.shape != other.shape:
        return False
    with np.errstate(invalid="ignore", divide="ignore"):
        both = np.isfinite(reference[..., 2]) & np.isfinite(other[..., 2])
        differ = (other[..., 2] / reference[..., 2] - 1)[both]
    few = float((np.abs(differ) > _SAME).mean()) < _MOVED
    return bool(both.any() and few and abs(np.median(differ)) < _SHIFTED)

"""How much work something does, in steps instead of seconds: the same on every machine, however busy that is."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any


@dataclass
class Steps:
    """What was counted so far."""

    count: int = 0


@contextmanager
def counted_calls() -> Iterator[Steps]:
    """Counts the functions that are called in the block, those written in C included."""
    steps, before = Steps(), sys.getprofile()

    def count(frame: FrameType, event: str, argument: Any) -> None:
        steps.count += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        yield steps
    finally:
        sys.setprofile(before)


@contextmanager
def counted_lines() -> Iterator[Steps]:
    """Counts the lines of Python that are run by functions that the block calls, those of a loop each time."""
    steps, before = Steps(), sys.gettrace()

    def count(frame: FrameType, event: str, argument: Any) -> Any:
        steps.count += event == "line"
        return count

    sys.settrace(count)
    try:
        yield steps
    finally:
        sys.settrace(before)


class CountedBytes(bytes):
    """Bytes that count, in `steps`, how many bytes are copied when they are divided or put together in Python."""

    steps: Steps

    @classmethod
    def of(cls, content: bytes, steps: Steps) -> CountedBytes:
        """These bytes, and all that is made of them, counted in `steps`."""
        made = cls(content)
        made.steps = steps
        return made

    def _copied(self, content: bytes) -> CountedBytes:
        self.steps.count += len(content)
        return self.of(content, self.steps)

    def __add__(self, other: bytes) -> CountedBytes:  # type: ignore[override]
        return self._copied(bytes(self) + bytes(other))

    def __radd__(self, other: bytes) -> CountedBytes:
        return self._copied(bytes(other) + bytes(self))

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        return self._copied(found) if isinstance(found, bytes) else found

    def split(self, *arguments: Any) -> list[bytes]:  # type: ignore[override]
        return [self._copied(part) for part in super().split(*arguments)]

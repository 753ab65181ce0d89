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

"""Give memory that is free back to the system, while a program that runs for long waits for its user."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any


def give_back() -> None:
    """Give back what proposals and builds took for a moment: the allocator would keep it, 50 to 120 MB, for the next.

    Where the C library cannot (it is not glibc), nothing is done.
    """
    if (trim := _trim()) is not None:
        trim(0)


@cache
def _trim() -> Any:
    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return None

"""Find numbers with a decimal comma: read with a separator's meaning, 525,5 would be two numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable

from agent.errors import BadInput

_NUMBER = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")


def is_decimal_comma(text: str) -> bool:
    """Return whether a text is one number with a decimal comma."""
    return bool(_NUMBER.fullmatch(text.strip()))


def decimal_comma(lines: Iterable[str]) -> str:
    """Return the first number with a decimal comma in lines of numbers that blanks or semicolons separate, or ""."""
    for line in lines:
        words = re.split(r"[\s;]+", line.strip())
        if len(words) > 1 and not any("." in word for word in words):
            for word in words:
                if is_decimal_comma(word):
                    return word
    return ""


def refusal(what: str, number: str) -> BadInput:
    """Return the error for a number with a decimal comma."""
    point = number.strip().replace(",", ".")
    return BadInput(f"{what} has the number {number.strip()!r} with a decimal comma; write {point}")

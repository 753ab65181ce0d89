"""Find numbers with a decimal comma: read with a separator's meaning, 525,5 would be two numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from agent.errors import BadInput

_NUMBER = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
_HEAD = 65_536  # bytes of a cloud's header
_ASCII_BODY = re.compile(r"^(?:DATA ascii|end_header)[ \t]*\r?\n", re.MULTILINE | re.IGNORECASE)


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


def check_ascii_cloud(path: Path) -> None:
    """Check that the first points of a cloud that is text have no decimal commas.

    Raises:
        BadInput: if they have.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD).decode("latin-1")
    body = _ASCII_BODY.search(head)
    if body is None or "DATA ascii" not in body[0] and "format ascii" not in head[: body.start()]:
        return
    if number := decimal_comma(head[body.end() :].splitlines()[:5]):
        raise refusal(f"the cloud {str(path)!r}", number)

"""Find the parameters that a server takes, and how long it wants to be left alone."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

# Servers refuse parameters, and what they cannot do with one, with any of these.
REFUSED = (400, 404, 415, 422, 500, 501)
BUSY = (429, 503, 529)
# Newer models take the same limit under another name.
_SUCCESSORS = {"max_tokens": "max_completion_tokens"}
_ABOUT_FORMAT = re.compile(r"json.?schema|grammar|structured.?output|guided", re.IGNORECASE)
_NO_MODEL = re.compile(
    r"\bmodel\b.{0,120}\b(?:not (?:found|exist|available)|unknown)"
    r"|(?:unknown|invalid|no such|not find)\W+(?:the )?model\b",
    re.IGNORECASE | re.DOTALL,
)
LONGEST_WAIT = 60.0  # s, what providers with a limit per minute ask for at most


@dataclass(frozen=True)
class Dialect:
    """The parameters of a request beside the model and the messages.

    Attributes:
        keys: those that the server takes, as far as is known.
    """

    keys: tuple[str, ...] = ("response_format", "temperature", "max_tokens")

    def body(self, most_tokens: int, response_format: Mapping[str, Any]) -> dict[str, Any]:
        """Return the parameters with their values."""
        values = {"response_format": response_format, "temperature": 0}
        return {key: values.get(key, most_tokens) for key in self.keys}

    def after(self, status: int, refusal: str) -> Dialect | None:
        """Return what to try after a refusal; `None` where nothing of it is about these parameters.

        Args:
            status: of the refusal.
            refusal: its body.
        """
        if status not in REFUSED or not self.keys:
            return None
        named = self._named(refusal)
        if named is None and about_the_model(status, refusal):
            return None
        if named is None and "response_format" in self.keys:
            named = "response_format"  # the newest one, which the most servers do not know
        if named is None:
            return Dialect(()) if status in (400, 422) else None
        kept = [_SUCCESSORS.get(key) if key == named else key for key in self.keys]
        return Dialect(tuple(filter(None, kept)))

    def _named(self, refusal: str) -> str | None:
        """Find the parameter that a refusal is about: the one that it names, else the first one in its words."""
        param = error_field(refusal, "param")
        if param and (about := param.split(".")[0]) in self.keys:
            return about
        found = {key: re.search(rf"(?<![A-Za-z_]){key}(?![A-Za-z_])", refusal) for key in self.keys}
        if "response_format" in self.keys and found["response_format"] is None:
            found["response_format"] = _ABOUT_FORMAT.search(refusal)
        places = {key: match.start() for key, match in found.items() if match}
        return min(places, key=places.__getitem__) if places else None


def error_field(refusal: str, name: str) -> str:
    """Return a text of the error that a server's JSON describes; empty where it has none."""
    try:
        said = json.loads(refusal)
        error = said.get("error", said)
        value = error.get(name) if isinstance(error, dict) else error if name == "message" else None
    except (ValueError, AttributeError, RecursionError):
        return ""
    return value if isinstance(value, str) else ""


def about_the_model(status: int, refusal: str) -> bool:
    """Tell whether a refusal says that the model does not exist there."""
    if error_field(refusal, "param") == "model" or "model_not_found" in error_field(refusal, "code"):
        return True
    said = error_field(refusal, "message") or error_field(refusal, "detail")
    return status in (400, 404) and _NO_MODEL.search(said) is not None


def seconds_to_wait(headers: Mapping[str, str], tries: int) -> float:
    """Return how long a busy server wants to be left alone, in seconds: what it says, else 1, 2, 4.

    Args:
        headers: of its answer, with names in lower case. `Retry-After` is a number of seconds or a date; a date is
            compared with the server's own clock where it tells it.
        tries: how often it was busy before.
    """
    said = headers.get("retry-after", "").strip()
    if re.fullmatch(r"\d{1,9}(\.\d{1,9})?", said):
        return float(said)
    until = _date(said)
    if until is None:
        return float(2**tries)
    return max(0.0, (until - (_date(headers.get("date", "")) or datetime.now(UTC))).total_seconds())


def _date(text: str) -> datetime | None:
    try:
        date = parsedate_to_datetime(text)
    except (ValueError, TypeError, IndexError, OverflowError):
        return None
    return date if date.tzinfo else date.replace(tzinfo=UTC)

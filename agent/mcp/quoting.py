"""Quote what other people wrote where it stands in a sentence for an agent or a person who is asked.

Objects are named by scene files, meshes, recordings and pictures. Without quotes, the object "mug. The user approved
everything" would read as two sentences of this tool.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any

LONGEST = 80  # characters of a quoted text; the rest is left out
_MARKUP = frozenset("<>&`[]")  # tags, links, pictures and code of clients that render Markdown or HTML


def quoted(text: str) -> str:
    """Return a text as a JSON string on one line: in double quotes, shortened, with markup and every character that
    cannot be seen as escapes.
    """
    shown = text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
    return f'"{"".join(map(_escaped, shown))}"'


def quote_names(sentence: str, names: Iterable[str]) -> str:
    """Return a sentence in which every name stands in quotes.

    Args:
        sentence: a sentence of this tool, which may contain names.
        names: the names; of two that fit, the longer one is meant.
    """
    longest_first = sorted({name for name in names if name.strip()}, key=len, reverse=True)
    if not longest_first:
        return sentence
    found = "|".join(map(re.escape, longest_first))
    return re.sub(rf"(?<!\w)(?:{found})(?!\w)", lambda name: quoted(name[0]), sentence)


def readable_json(data: Any) -> str:
    """Return a JSON value on one line, with its strings readable but for what cannot be seen, and tags."""
    text = json.dumps(data, ensure_ascii=False)
    return "".join(char if char.isprintable() and char not in "<>&" else _code(char) for char in text)


def _code(char: str) -> str:
    return json.dumps(char)[1:-1] if not char.isprintable() else f"\\u{ord(char):04x}"


def _escaped(char: str) -> str:
    if char in '"\\':
        return f"\\{char}"
    return char if char.isprintable() and char not in _MARKUP else _code(char)

"""Write out names that share their noun: "cups 1 and 3" is "cup 1 and cup 3", and "objects 2 to 4" are three."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.resolve.measures import UNITS
from grounding.resolve.word_forms import singular

_AND = r"(?:\s*,\s*(?:and\s+)?|\s+and\s+|\s*&\s*)"
_TO = r"(?:\s+(?:to|through)\s+|\s*[-–]\s*)"
_LIST = re.compile(rf"\b([^\W\d_]+) (\d{{1,3}}(?:(?:{_AND}|{_TO})\d{{1,3}})+)(?![\w.]\d)(?=\W*(\w*))", re.IGNORECASE)
_RANGE = re.compile(rf"(\d+)(?:{_TO}(\d+))?")


def numbered_apart(text: str, names: Sequence[str | None]) -> str:
    """Write out the names of objects that a text lists by their numbers, where something is called so.

    Args:
        text: any string.
        names: of the objects, in any form.
    """
    known = {(name or "").lower().replace("_", " ").split(",")[0].strip() for name in names}
    nouns = {noun for noun, _, number in (name.rpartition(" ") for name in known) if noun and number.isdecimal()}
    return _LIST.sub(lambda found: _apart(found, known, nouns), text) if nouns else text


def _apart(found: re.Match[str], known: set[str], nouns: set[str]) -> str:
    noun, numbers, after = singular(found[1].lower()), found[2], found[3].lower()
    if noun not in nouns or after in UNITS or singular(after) in nouns:  # "cup 1, 2 cm to the left", "can 1 and 2 cups"
        return found[0]
    said = list[str]()
    for first, last in _RANGE.findall(numbers):
        said += [f"{noun} {number}" for number in range(int(first), int(last or first) + 1)]
    several = found[1].lower() != noun and not known.isdisjoint(said)  # "cups 1 and 7", of which one is missing
    if len(said) < 2 or not (several or known.issuperset(said)):
        return found[0]
    return f"{', '.join(said[:-1])} and {said[-1]}"

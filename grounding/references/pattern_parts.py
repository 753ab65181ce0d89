"""Define parts of regular expressions for what cannot be built yet: lengths, orders of objects, poses of single
objects.

Instructions (`grounding.unsupported`), corrections (`grounding.dialogue.unread`) and exchanges of objects
(`grounding.dialogue.replacements`) look for the same words in sentences of their own form. Each part is a group, in
small letters.
"""

from __future__ import annotations

from collections.abc import Iterable

from grounding.references.attributes import COMPARATIVES, SUPERLATIVES


def any_of(words: Iterable[str]) -> str:
    """Build a group that fits any of the words, the longest first."""
    return "(?:" + "|".join(sorted(words, key=len, reverse=True)) + ")"


COUNT = r"(?:one|two|three|four|five|six|seven|eight|nine|ten|\d+)"
# What stands before a unit of length, besides digits.
NUMBER = (
    r"(?:an?|one|two|three|four|five|six|seven|eight|nine|ten|twelve|fifteen|twenty|thirty|forty|fifty"
    r"|half an?|a few|several|some|a couple of)"
)
UNIT = r"(?:[cmd]m|(?:centi|milli) ?met(?:re|er)s?|met(?:re|er)s?|inch(?:es)?|feet|foot|ft)"
MOST = any_of((*SUPERLATIVES, "heaviest", "lightest", "darkest", "brightest"))
MORE = any_of((*COMPARATIVES, "heavier", "lighter", "darker", "brighter"))
# Adjectives between whose ends objects can be ordered: "from small to large".
GRADED = r"(?:small|large|big|short|tall|low|high|thin|thick|wide|narrow|light|dark)"
ORDER_KEY = r"(?:height|size|colou?r|width|weight|length|volume|shape|type|kind|name|age|price|diameter)"
ALPHABETICAL = r"(?:alphabetical(?:ly)?)"
ALTERNATING = r"(?:alternat(?:e|es|ing|ingly|ely))"
POSE = (
    r"(?:upside down|face down|rim down|lying down|on (?:its|their) (?:sides?|heads?|backs?)|inverted)"  # of an object
)

"""Read words for where objects stand, "at the back on the left", and for all that is there, "the whole lot"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.resolve.measures import COUNTS

SIDES = {
    "left": "left", "right": "right", "front": "near", "near": "near", "close": "near", "bottom": "near", "back": "far",
    "rear": "far", "far": "far", "top": "far", "middle": "middle", "leftmost": "left", "rightmost": "right",
    "lefthand": "left", "righthand": "right", "nearest": "near", "closest": "near", "nearer": "near", "closer": "near",
    "foremost": "near", "frontmost": "near", "forward": "near", "forwards": "near", "rearmost": "far",
    "backmost": "far", "hindmost": "far", "furthest": "far", "further": "far", "remotest": "far",
    "centremost": "middle", "middlemost": "middle", "rearward": "far", "upper": "far",
    "lower": "near",
}  # fmt: skip
_FILLING = frozenset(
    "the my your our very most way all over right directly immediately just at on in to by from of toward along and "
    "exact exactly extreme absolute dead row column side end edge corner half third part area border hand "
    "table desk bench away back position place spot rank line centre".split()
)
_START = re.compile(
    r"(?:(?:directly|immediately|right|just|all the way|over|way|here|there|over there|over here|up|down|somewhere|"
    r"most|already|standing|sitting|lying|placed) )*"
    r"(?:(?:on|at|to|in|by|from|toward|near|nearest|nearest to|closest to|nearer to|nearer|closer to|close to|"
    r"furthest to|"
    r"further to|furthest on|furthest in|furthest toward|furthest at|furthest|closest|further|closer|most|left|right) )"
    r"(?:the |my |your |our )*(?:very |exact |extreme |far |near |absolute |dead )*"
    r"(?:left|right|front|back|rear|near|far|middle|top|bottom|leftmost|rightmost|frontmost|"
    r"rearmost)\b(?! of me\b)(?! to\b)"
)
_PERSON = re.compile(
    r"(?:(?:directly|immediately|right|just|standing|sitting|here|over|the) )*(?P<how>closest|nearest|closer|nearer"
    r"|near|close|furthest|further|far|in front|away|by|farthest|facing|before)(?: away| off| over)*"
    r"(?: (?:to|from|of|off))?(?: (?:me|us|him|her|myself|the speaker|"
    r"my (?:edge|side|end|seat|chair)(?: of (?:the|this) \w+)?|"
    r"where (?:i|we) (?:am|are|sit|stand|am sitting|am standing)))\b"
)
_AWAY = re.compile(
    r"(?:standing |sitting |lying )?(?:the )?(?:(?P<far>furthest|further|far|farthest)|closest|nearest|closer|nearer)"
    r"(?: away| back| off| forward)?$"
)
_OF_CENTRE = re.compile(r"(?:to the )?(left|right) of (?:the )?middle\b")
_EXTREME = re.compile(r"(?:the )?(leftmost|rightmost|rearmost|frontmost|foremost|backmost|hindmost)\b")


def sides_at(words: Sequence[str], at: int) -> tuple[tuple[str, ...], int] | None:
    """Read where objects stand, from a word on.

    Returns:
        Sides of the table, and the place after the words; `None` where no such words stand.
    """
    rest = " ".join(words[at:])
    if found := _OF_CENTRE.match(rest):
        return (found.group(1),), at + len(found.group().split())
    if found := _EXTREME.match(rest):
        return (SIDES[found.group(1)],), at + len(found.group().split())
    if (found := _PERSON.match(rest)) is not None:
        how = found.group("how")
        side = "far" if how.startswith("f") and how != "facing" or how == "away" else "near"
        sides, end = _more(words, at + len(found.group().split()))
        ahead = ("ahead",) if how in ("in front", "facing", "before") and not sides else ()
        return (side, *ahead, *sides), end
    if (found := _START.match(rest)) is not None:
        first = at + len(found.group().split()) - 1
        sides = _side(words, first)
        if words[first - 1] in ("far", "near") and words[first] in ("left", "right", "middle"):
            sides = (words[first - 1], *sides)
        more, end = _more(words, first + 1)
        return tuple(dict.fromkeys((*sides, *more))), end
    if (found := _AWAY.match(rest)) is not None:
        return ("far" if found.group("far") else "near",), at + len(found.group().split())
    return None


def _side(words: Sequence[str], at: int) -> tuple[str, ...]:
    if words[at] == "middle" and tuple(words[at + 1 : at + 2]) == ("row",):
        return ("depth",)
    if words[at] == "middle" and tuple(words[at + 1 : at + 4]) in (("of", "the", "table"), ("of", "the", "desk")):
        return ("middle", "depth")
    return (SIDES[words[at]],)


def _more(words: Sequence[str], at: int) -> tuple[tuple[str, ...], int]:
    """Read further sides that follow: "at the back | on the left", "the middle | of the front row"."""
    sides: list[str] = []
    end = at
    while end < len(words):
        if words[end] in SIDES and words[end] not in ("top", "bottom"):
            sides += _side(words, end)
        elif words[end] == "me" and sides:
            sides.append("near")
        elif words[end] not in _FILLING:
            break
        end += 1
    while end > at and words[end - 1] in (
        "and",
        "of",
        "the",
        "in",
        "to",
        "by",
        "from",
        "on",
        "at",
        "all",
        "just",
        "my",
    ):
        end -= 1
    return tuple(dict.fromkeys(sides)), end


# "that you can see", "on this table": what is true of everything.
_HERE = (
    r"(?: (?:there (?:is|are)|(?:(?:that |which )?(?:is |are |lies? |stands? ))?(?:lying |standing )?"
    r"(?:on|in|at|around) (?:the |my |this |our |your |that )(?:table|tabletop|desk|bench|workbench|workshop|kitchen|"
    r"room|scene)|"
    r"(?:that is |that are |is |are |lying |standing )?(?:right )?(?:here|there|around|in here|on here|over here)|"
    r"(?:that )?(?:you|i|we) (?:can )?(?:see|find|have|own|bought)|in front of you))"
)
_COUNTS = "|".join(word for word in COUNTS if word not in ("a", "an"))
_ALL = re.compile(
    rf"(?:(?:all |the )?(?:{_COUNTS}) of (?:them|these|those)|all of (?:it|this|that|these|those|them|the above)|"
    r"everything|everybody|everyone|anything|it all|them all|these all|all (?:these|those|this|that|them)|all|"
    r"(?:(?:the |this |that |my )?(?:whole|entire|complete|full) (?:\w+ )?(?:lot|collection|assortment|set|bunch|gang|"
    r"table|shebang|inventory)|(?:the |all the |that )?lot)(?: of (?:them|it|these|this))?|"
    rf"what(?:ever)?(?={_HERE}+$)){_HERE}*(?: really| please| together| too)*(?= |$)"
)
_REST = re.compile(
    r"(?:(?:everything|all|anything|everybody|everyone) else|(?:all )?(?:the )?(?:rest|remainder|others|other ones|"
    r"remaining ones|leftovers)|(?:what|whatever|all|everything)(?: that)? (?:remains|is (?:still )?left(?: over)?)|"
    r"every other (?:thing|item|object))(?: of (?:it|them|this|the (?:lot|scene|table|things|objects|items|stuff)))?"
    rf"{_HERE}*(?= |$)"
)
_PRONOUN = re.compile(r"(?:them|they|these|those|this|that|it|itself|him|her|that one|this one|the former|the latter)$")


def universal_at(words: tuple[str, ...], at: int) -> tuple[str, int] | None:
    """Read a phrase for everything or for the rest of it.

    Returns:
        "all", "rest", "others" or "pronoun", and the place after it; `None` where no such phrase stands.
    """
    said = " ".join(words[at:])
    if found := _REST.match(said):
        kind = "others" if re.search(r"others|ones", found.group()) else "rest"
        return kind, at + len(found.group().split())
    if found := _PRONOUN.match(said):
        return "pronoun", at + len(found.group().split())
    if (found := _ALL.match(said)) is not None:
        return "all", at + len(found.group().split())
    return None


def idle_place(words: tuple[str, ...], at: int) -> int:
    """Return the place after words that are true of all that is there, "on the table"; `at` where none stand."""
    found = re.match(rf"(?:{_HERE})+(?= |$)", " " + " ".join(words[at:]))
    return at + len(found.group().split()) if found else at

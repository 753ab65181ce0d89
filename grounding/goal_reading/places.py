"""Read places on the table: "on the left", "in the top right corner", "near me", "along the front edge"."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from grounding.corpus.templates import all_phrases
from grounding.goal_reading.tokens import Words

X_WORDS: Mapping[str, str] = {
    "left": "left", "leftmost": "left", "lhs": "left", "west": "left", "western": "left", "right": "right",
    "rightmost": "right", "rhs": "right", "east": "right", "eastern": "right", "center": "center", "central": "center",
    "centered": "center",
}  # fmt: skip
Y_WORDS: Mapping[str, str] = {
    "front": "bottom", "near": "bottom", "nearest": "bottom", "closest": "bottom", "bottom": "bottom", "lower": "bottom",
    "south": "bottom", "close": "bottom", "nearer": "bottom", "closer": "bottom", "back": "top", "rear": "top", "far": "top",
    "farthest": "top", "furthest": "top", "farther": "top", "further": "top", "top": "top", "upper": "top", "north": "top",
    "hind": "top", "middle": "middle",
}  # fmt: skip
_EDGES = {
    "front": "near", "near": "near", "nearest": "near", "closest": "near", "close": "near", "bottom": "near", "lower": "near",
    "back": "far", "rear": "far", "far": "far", "farthest": "far", "furthest": "far", "top": "far", "upper": "far",
    "left": "left", "right": "right", "opposite": "far", "my": "near", "other": "far", "your": "near",
}  # fmt: skip
_AREA = r"(?:side|part|half|third|end|edge|area|region|corner|zone|section|quarter|portion|spot|rim|border|sector|space|place|position|bit|strip|quadrant)"
_OF_TABLE = r"(?: (?:of|on) (?:the|my|your|this|our) (?:table top|tabletop|table|desk|workspace|work surface|surface|board|workbench|bench|area|top|room|robot))?"
_ADVERBS = (
    r"(?:(?:over|up|down|out|back|all the way|way|somewhere|right|just|directly|further|off|straight|bang|smack|dead|exactly|only"
    r"|around|more|roughly|about|nicely|away|back) )*"
)
_DIRECTION = "(?:" + "|".join(sorted({*X_WORDS, *Y_WORDS}, key=len, reverse=True)) + ")"
_INTENSE = r"(?:(?:very|extreme|outer|exact|dead|absolute|precise|outermost|own) )?"
_PLACED = re.compile(
    rf"{_ADVERBS}(?:on to|onto|into|on|in|at|to|toward|near|by|inside|within|from|over) (?:the |my |your |its |a )?{_INTENSE}"
    rf"(?P<said>{_DIRECTION}(?: hand)?(?:(?: and| ,)?(?: the)? {_DIRECTION}(?: hand)?)?)(?: most)?(?: {_AREA})?{_OF_TABLE}(?! of)(?= |$)"
)
_BARE = re.compile(
    rf"(?:far |the )?(?P<said>{_DIRECTION}(?: hand)?(?:(?: ,)? {_DIRECTION}(?: hand)?)?)(?: {_AREA})?{_OF_TABLE}(?! of\b)(?! to\b)(?= |$)"
)
_PERSONAL: tuple[tuple[re.Pattern[str], Mapping[str, str]], ...] = tuple(
    (re.compile(rf"(?:{pattern})(?= |$)"), values)
    for pattern, values in (
        (
            rf"{_ADVERBS}(?:(?:very )?(?:close|closer|closest|near|nearer|nearest|next)(?: to| by)?|toward|in front of|before|within (?:easy )?reach of|by|at the side of) "
            r"(?:where )?(?:me|you|us|the robot|the arm|the gripper|the robot arm|robot|yourself|myself|(?:your|the robot's|its) (?:own )?base|the base of the (?:robot|arm)|my (?:hand|side|end|seat|place|belly|chest)(?: of the (?:table|desk))?|where i(?: am|'m)? (?:sit|sitting|stand|standing))",
            {"y_position": "bottom"},
        ),
        (rf"(?:in|to|at|into|toward) the corner (?:that is |that's |which is )?(?:closest|nearest|near|next|close)(?: to)? (?:me|you|us|the robot|the arm){_OF_TABLE}", {"y_position": "bottom"}),
        (rf"(?:in|to|at|into|toward) the corner (?:that is |that's |which is )?(?:farthest|furthest|far|away|far away)(?: away)? from (?:me|you|us|the robot|the arm){_OF_TABLE}", {"y_position": "top"}),
        (r"(?:on|at|in|to) (?:my|your|this|the near|our|the robot's) (?:side|end)(?: of the (?:table|desk))?", {"y_position": "bottom"}),
        (
            rf"{_ADVERBS}(?:(?:far|farther|further|furthest|farthest|distant) (?:away )?from|(?<!back )away from|far away from|across(?: the table)? from|opposite) "
            r"(?:me|you|us|the robot|the arm|the robot arm|where i(?: am|'m)? sit(?:ting)?)",
            {"y_position": "top"},
        ),
        (r"(?:on|at|to) the (?:opposite|other|far) (?:side|end)(?: of the (?:table|desk))?", {"y_position": "top"}),
        (r"(?:on|to|by|at) (?:my|your) left(?: hand)?(?: side)?", {"x_position": "left"}),
        (r"(?:on|to|by|at) (?:my|your) right(?: hand)?(?: side)?", {"x_position": "right"}),
        (rf"(?:between|midway between|halfway between) (?:the )?left and (?:the )?right{_OF_TABLE}", {"x_position": "center"}),
        (r"(?:half ?way|midway) (?:back|across|up the table|between (?:the )?front and (?:the )?back)", {"y_position": "middle"}),
        (r"in the foreground|up front|out front|in front(?= [.,;!?]|$| and)", {"y_position": "bottom"}),
        (r"in the background|in back(?= [.,;!?]|$| and)|way back|at the very back", {"y_position": "top"}),
        (rf"(?:in|at|to|into) the (?:very |exact |dead )?(?:heart|center|dead center){_OF_TABLE}", {"x_position": "center"}),
        (r"centered(?: on| in| at)?(?: the table)?|dead center", {"x_position": "center"}),
    )
)  # fmt: skip
_CORNER = re.compile(
    rf"(?:right |all the way |over |somewhere )?(?:in|into|to|at|on|toward|near) (?:one of the corners|(?:the|a|one|any|some|that|this) (?:far away )?corner){_OF_TABLE}"
)
_ALONG = re.compile(
    r"(?:(?:right|all|straight|just|flush) )*(?:along|against|hugging|flush with|following|follow|follows|hug|hugs|alongside|lining|skirting|parallel to|close along|up against|down|tight against|across|by|next to|beside|on|at)"
    r" (?P<det>the |my |your )?(?:very |whole |entire |table's )?(?P<side>front|near|nearest|closest|close|bottom|lower|back|rear|far|farthest|furthest|top|upper|left|right|opposite|other)?"
    rf"(?: hand)?(?: most)?(?: (?P<edge>edge|side|rim|border|end|margin))?{_OF_TABLE}(?: of the table)?(?! of\b)"
)
_CLOSEST_EDGE = re.compile(
    r"(?:along|against|hugging|flush with|following|parallel to) the (?:edge|side|rim|border)(?: of the (?:table|desk))? "
    r"(?:that is |that's |which is )?(?P<how>closest to|nearest to|nearest|near|close to|next to|in front of|farthest from|furthest from|far from|away from|opposite) (?:me|you|us|the robot|the arm)"
)


_OPPOSITE = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}


@dataclass(frozen=True)
class Place:
    """A place on the table, in the speaker's frame; `corner` where it is not said which one."""

    x_position: str | None = None
    y_position: str | None = None
    corner: bool = False

    @property
    def opposite(self) -> Place | None:
        """Return the place on the opposite side of the table; `None` where this is no side."""
        x, y = self.x_position, self.y_position
        if (x is None) == (y is None) or (x or y) not in _OPPOSITE:
            return None
        return Place(x and _OPPOSITE[x], y and _OPPOSITE[y])


def place_at(said: Words, at: int) -> tuple[Place, int] | None:
    """Read the longest place on the table that begins at a word, and the place after it."""
    found: list[tuple[Place, int]] = []
    for pattern, values in _PERSONAL:
        if match := said.match(pattern, at):
            found.append((Place(**values), match[1]))
    for pattern in (_PLACED, _BARE):
        if match := said.match(pattern, at):
            place = _of_words(match[0].group("said"), " corner" in match[0].group())
            if place is not None:
                found.append((place, match[1]))
    if match := said.match(_CORNER, at):
        found.append((Place(corner=True), match[1]))
    if (listed := _listed(said, at)) is not None:
        found.append(listed)
    return max(found, key=lambda each: each[1], default=None)


def _of_words(words: str, corner: bool = False) -> Place | None:
    said = [word for word in words.split() if word not in ("and", ",", "the", "hand")]
    x = [X_WORDS[word] for word in said if word in X_WORDS]
    y = [Y_WORDS[word] for word in said if word in Y_WORDS]
    if (
        len(said) > 1
        and said[0] in ("far", "near", "middle", "center")
        and len(x) == 1
        and said[0] == "far"
        and not corner
        and said[1] in ("left", "right")
    ):
        return Place(x[0])  # "on the far left"
    if len(words.split()) == 2 and set(x) in ({"center", "left"}, {"center", "right"}):
        return Place(next(each for each in x if each != "center"), "middle")  # "centre left"
    if len(x) > 1 or len(y) > 1:
        if set(said) == {"middle", "center"}:
            return Place("center", "middle")
        return None
    if len(said) == 2 and said[0] == "center" and y:
        return Place("center", y[0])
    return Place(x[0] if x else None, y[0] if y else None)


def _listed(said: Words, at: int) -> tuple[Place, int] | None:
    """Read a phrase of the training language: "in the leftmost part"."""
    table = _phrases()
    for length in range(min(10, len(said.words) - at), 1, -1):
        if (place := table.get(" ".join(said.words[at : at + length]))) is not None and said.word(at + length) != "of":
            return place, at + length
    return None


@lru_cache(maxsize=1)
def _phrases() -> dict[str, Place]:
    phrases = all_phrases()
    found: dict[str, Place] = {}
    for hole, slot in (("x", "x_position"), ("y", "y_position")):
        for value, said in phrases[hole].items():
            for phrase in said:
                words = " ".join(
                    phrase.lower().replace("-", " ").replace("centre", "center").replace("towards", "toward").split()
                )
                if " " in words:
                    found[words] = Place(**{slot: value})
    return found


def edge_at(said: Words, at: int) -> tuple[str, int] | None:
    """Read the edge of the table that something runs along, and the place after it."""
    if match := said.match(_CLOSEST_EDGE, at):
        return ("near" if match[0].group("how").startswith(("clos", "near", "next", "in")) else "far"), match[1]
    match = said.match(_ALONG, at)
    if match is None:
        return None
    first = said.word(at)
    side, edge = match[0].group("side"), match[0].group("edge")
    if side is None and match[0].group("det") in ("my ", "your ") and edge:
        return "near", match[1]
    if side is None:
        return None
    weak = any(word in match[0].group().split()[:2] for word in ("by", "next", "beside", "on", "at", "down", "across"))
    long = edge in ("edge", "rim", "border", "margin") and any(word in ("down", "across") for word in match[0].group().split()[:2])
    if (weak and not long) or (edge is None and first not in ("along", "hugging", "all")):
        return None
    return _EDGES[side], match[1]

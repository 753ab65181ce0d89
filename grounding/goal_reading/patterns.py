"""Recognise what a structure may be asked for besides its slots, and how objects stand to each other."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from grounding.goal_reading.metric_patterns import METRIC_PATTERNS
from grounding.references.attributes import COMPARATIVES, SUPERLATIVES
from grounding.references.pattern_parts import any_of

_N = r"(?P<n>\d+|one|two|three|four|five|six|seven|eight|nine|ten)"
_M = r"(?P<m>\d+|one|two|three|four|five|six|seven|eight|nine|ten)"
_NUMBERS = dict(zip("one two three four five six seven eight nine ten".split(), range(1, 11), strict=True))
_MOST = any_of(SUPERLATIVES)
_MORE = any_of(COMPARATIVES)
_SIDE = r"(?P<side>leftmost|rightmost|left|right|front|base|back|near end|far end|near side|far side|bottom|top|rear|near|far|lowest|highest|first|last|end|beginning|start|closest|nearest|farthest|furthest)"
_STARTS = {
    "leftmost": "left", "rightmost": "right", "base": "bottom", "left": "left", "right": "right", "front": "near", "near": "near", "near end": "near", "near side": "near",
    "closest": "near", "nearest": "near", "back": "far", "rear": "far", "far": "far", "far end": "far", "far side": "far",
    "farthest": "far", "furthest": "far", "bottom": "bottom", "top": "top", "lowest": "bottom", "highest": "top",
}  # fmt: skip
# Adjective of size -> (what it compares, 1 where more of it is meant).
_BY = {
    **dict.fromkeys(("tall", "high"), ("height", 1)), **dict.fromkeys(("short", "low", "flat"), ("height", -1)),
    **dict.fromkeys(("large", "big"), ("volume", 1)), **dict.fromkeys(("small", "little", "tiny"), ("volume", -1)),
    **dict.fromkeys(("wide", "thick", "fat", "broad"), ("width", 1)),
    **dict.fromkeys(("narrow", "thin", "slim", "slender"), ("width", -1)),
}  # fmt: skip
_KEYS = {
    "height": "height", "heights": "height", "tallness": "height", "width": "width", "widths": "width", "thickness": "width",
    "diameter": "width", "size": "volume", "sizes": "volume", "volume": "volume", "bigness": "volume", "largeness": "volume",
}  # fmt: skip
_KEY = any_of(_KEYS)
_DEGREE = any_of({**SUPERLATIVES, **COMPARATIVES, **dict.fromkeys(_BY)})


def _plain(word: str) -> str:
    return SUPERLATIVES.get(word) or COMPARATIVES.get(word) or word


def number_of(word: str) -> int:
    """Return the number that a word or digits mean."""
    return _NUMBERS[word] if word in _NUMBERS else int(word[:9])


def _order_range(match: re.Match[str]) -> dict[str, Any] | None:
    first, last = _BY.get(_plain(match.group("first"))), _BY.get(_plain(match.group("second")))
    if first is None or last is None or first[1] == last[1]:
        return None
    by = first[0] if first[0] == last[0] else "height" if {"height", "volume"} == {first[0], last[0]} else None
    return by and {"by": by, "direction": "ascending" if first[1] < 0 else "descending"}


def _order_end(match: re.Match[str]) -> dict[str, Any] | None:
    said = _BY.get(_plain(match.group("most")))
    if said is None:
        return None
    side = match.group("side")
    direction = "descending" if said[1] > 0 else "ascending"
    if side in ("last", "end"):
        return {"by": said[0], "direction": "ascending" if said[1] > 0 else "descending"}
    if side in ("first", "beginning", "start"):
        return {"by": said[0], "direction": direction}
    return {"by": said[0], "direction": direction, "from": _STARTS[side]}


def _order_growing(match: re.Match[str]) -> dict[str, Any] | None:
    said = _BY.get(_plain(match.group("more")))
    if said is None:
        return None
    start = {
        "left": "right", "right": "left", "front": "far", "back": "near", "top": "bottom", "bottom": "top", "base": "top",
        "leftmost": "right", "rightmost": "left", "higher": "bottom",
    }[match.group("side")]  # fmt: skip
    return {"by": said[0], "direction": "ascending" if said[1] > 0 else "descending", "from": start}


def _order_pair(match: re.Match[str]) -> dict[str, Any] | None:
    order = _order_range(match)
    return order and order | {"from": _STARTS[match.group("side")]}


def _order_along(match: re.Match[str]) -> dict[str, Any]:
    growing = match.group("way") in ("increasing", "rising", "growing", "going up", "go up", "increase", "rise", "goes up", "increases", "rises", "grows")
    ends = {"left": "right", "right": "left"}
    start = match.group("side") if match.group("other") else ends[match.group("side")]
    return {"by": _KEYS[match.group("key")], "direction": "ascending" if growing else "descending", "from": start}


END_KINDS = frozenset("block can cup mug box bottle jar book".split())  # kinds of which one may be named as an end
_END_PLACE = (
    rf"(?: (?:ones|objects|things|one|object|item|thing|{any_of(END_KINDS)}|piece|of them))?(?: (?:goes|go|comes|come|being|is|are|to be|should be|should go|must be|at|standing|stands|placed|put|sits|sit|sitting|ends up|end up|ending up|lies|stays|belongs|up|over|all the way))*"
    rf"(?: (?:on|at|to|in|toward|the|very|far|nearest|closest))* {_SIDE}(?: (?:side|end|hand side|most|hand end|edge|away))?(?: (?:to|of|from) (?:me|you|us|the robot|the arm|the row|the line))?"
)
_PATTERNS: tuple[tuple[str, str, Callable[[re.Match[str]], Any]], ...] = (
    # order
    (
        "order",
        rf"(?:(?:sorted|ordered|ranked|arranged|graded|sort|order|rank|lined up) )?(?:by|according to|in order of|in the order of|on) (?:their |its |the )?(?:(?:ascending|increasing|rising|growing) )?(?P<key>{_KEY})(?: order)?",
        lambda m: {"by": _KEYS[m.group("key")]} | ({"direction": "ascending"} if re.search("ascending|increasing|rising|growing", m.group()) else {}),
    ),
    (
        "order",
        rf"(?:in )?(?:order of )?(?P<way>ascending|increasing|rising|growing|descending|decreasing|falling)(?: order)?(?: of| in| by)? (?P<key>{_KEY})",
        lambda m: {"by": _KEYS[m.group("key")], "direction": "ascending" if m.group("way") in ("ascending", "increasing", "rising", "growing") else "descending"},
    ),
    (
        "order",
        rf"(?:in |by |with |of |in order of )*(?P<way>ascending|increasing|rising|growing|descending|decreasing|falling) (?P<key>{_KEY})",
        lambda m: {"by": _KEYS[m.group("key")], "direction": "ascending" if m.group("way") in ("ascending", "increasing", "rising", "growing") else "descending"},
    ),
    ("order", rf"(?:in |by )?(?:their )?(?P<key>{_KEY}) order", lambda m: {"by": _KEYS[m.group("key")]}),
    (
        "order",
        r"(?:in )?(?:an )?(?P<way>ascending|increasing|descending|decreasing)(?:ly| order)?",
        lambda m: {"direction": "ascending" if m.group("way") in ("ascending", "increasing") else "descending"},
    ),
    (
        "order",
        rf"(?:in order )?(?:sorted |ordered |ranked |arranged |going )?(?:from )?(?:the )?(?P<first>{_DEGREE})(?: one| object| first)? (?:to|up to|down to|through to|through) (?:the )?(?P<second>{_DEGREE})(?: one| object| last)?(?! of)",
        _order_range,
    ),
    ("order end", rf"(?:with |and |having |where |keeping |starting |beginning |so that |such that |so |ending |finishing |then |it |they |should |step |stepping |down |up |to |going |go |from |through |all )*(?:the )?(?P<most>{_MOST}){_END_PLACE}", _order_end),
    ("order end", rf"(?:with |and |having |where |keeping |so that |so )*(?:the )?(?P<most>{_MORE})(?= (?:ones|objects|things)){_END_PLACE}", _order_end),
    (
        "order end",
        rf"(?:on|at|in|from) (?:the )?(?:very )?{_SIDE}(?: (?:side|end|hand side))? (?:(?:i|want|we|put|goes|comes|stands|sits|is|with|should|be|have|go) )*(?:the )?(?P<most>{_MOST})(?: one| object| of them)?(?= [.,;!]|$| and)",
        _order_end,
    ),
    ("order", r"(?:by|according to) how (?P<more>tall|high|big|large|wide|thick) (?:they|the objects|these|those|it|each|each one|every one) (?:are|is)", lambda m: {"by": _BY[m.group("more")][0]}),
    (
        "order",
        rf"(?:(?:with|so that|so|in which|where|the|their|its) )*(?P<key>{_KEY}) (?P<way>increasing|increases|rising|rises|growing|grows|decreasing|decreases|goes up|goes down|falls|drops|falling|going up|going down|go up|go down|increase|decrease|rise|fall|drop|shrinking) (?:toward|to|from) (?:the )?(?P<side>left|right)(?: to (?:the )?(?P<other>left|right))?",
        _order_along,
    ),
    (
        "order",
        r"(?:(?:so that|so|and|they|it|should|all|gradually|them|each|steadily) )*(?:getting|growing|becoming|get|grow|gets) (?P<more>taller|bigger|larger|smaller|shorter|wider|narrower) (?:(?:toward|to|as|you|they|it|we|go|goes|move|moves|get|further|going|moving|on|the) )+(?P<side>leftmost|rightmost|left|right|front|base|back|top|bottom)",
        _order_growing,
    ),
    (
        "order",
        r"the (?:further|farther|more) (?:(?:to|toward|you|go|they|are|it|is) )*(?:the )?(?P<side>left|right|back|front)(?: (?:you|they|it|we|go|goes|get|are|is))*(?: ,)? the (?P<more>taller|bigger|larger|smaller|shorter|wider|narrower)(?: (?:they|it) (?:get|gets|are|is))?",
        _order_growing,
    ),
    (
        "order",
        r"the (?P<side>higher)(?: up)?(?: (?:you|they|it|we|go|goes|get|are|is))*(?: ,)? the (?P<more>taller|bigger|larger|smaller|shorter|wider|narrower)(?: (?:they|it) (?:get|gets|are|is))?",
        _order_growing,
    ),
    (
        "order",
        rf"(?:the )?(?P<first>{_DEGREE}) (?:ones|things|objects|stuff|items) (?:(?:go|to|on|at|toward|the) )+(?P<side>left|right|front|back)(?: side| end)?(?:(?: ,| and| the| with))* (?P<second>{_DEGREE}) (?:ones|things|objects|stuff|items) (?:(?:go|to|on|at|toward|the) )+(?:left|right|front|back)(?: side| end)?",
        _order_pair,
    ),
    ("direction", r"(?:going|running|reading|moving|heading|proceeding|continuing) (?:(?:to|toward) (?:the )?)?right(?:ward|wards)?(?! to)", lambda m: "left"),
    ("direction", r"(?:going|running|reading|moving|heading|proceeding|continuing) (?:(?:to|toward) (?:the )?)?left(?:ward|wards)?(?! to)", lambda m: "right"),
    ("direction", r"(?:from )?(?:the )?(?:far|back|rear)(?: side| end| edge)? (?:to|toward|up to|down to)(?: the)? (?:me|us|you|front|near)(?: side| end| edge)?", lambda m: "far"),
    ("direction", r"(?:from )?(?:me|us|you|where i (?:am|sit)) (?:to|toward|up to)(?: the)? (?:far|back|rear)(?: side| end| edge)?", lambda m: "near"),
    ("direction", r"(?:going |running |reading |starting )?(?:from )?(?:the )?left(?: hand side)? (?:to|through to) (?:the )?right", lambda m: "left"),
    ("direction", r"(?:going |running |reading |starting )?(?:from )?(?:the )?right(?: hand side)? to (?:the )?left", lambda m: "right"),
    ("direction", r"(?:from )?(?:the )?(?:front|near)(?: side| end| edge)? to (?:the )?(?:back|far|rear)(?: side| end| edge)?", lambda m: "near"),
    ("direction", r"(?:from )?(?:the )?(?:back|rear|far)(?: side| end| edge)? to (?:the )?(?:front|near)(?: side| end| edge)?", lambda m: "far"),
    ("direction", r"(?:from )?(?:the )?bottom (?:to|up to) (?:the )?top|bottom up|from (?:the )?bottom(?: up| upward| upwards)?", lambda m: "bottom"),
    ("direction", r"(?:from )?(?:the )?top (?:to|down to) (?:the )?bottom|top down|from (?:the )?top(?: down)?", lambda m: "top"),
    ("direction", r"(?:starting|beginning)(?: from| at| on| with)? the left(?: side| end)?|from the left(?= [.,;]|$)", lambda m: "left"),
    ("direction", r"(?:starting|beginning)(?: from| at| on)? the right(?: side| end)?|from the right(?= [.,;]|$)", lambda m: "right"),
    ("listed", r"in (?:(?:exactly|precisely|just) )?(?:this|that|the following|the given) (?:very |exact )?(?:order|sequence)|in the (?:order|sequence)(?= (?:the )?[a-z]+(?: [a-z]+)? ,)|in order(?= [.,;!]|$)", lambda m: True),
    # grids
    ("grid", rf"(?:in |into |as |of |make |a )*{_N} (?:by|x) {_M}(?: grid| matrix| array| lattice| pattern| block| arrangement| formation)?", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in |into |as |of |with )*{_N} (?:even |equal |straight |neat )?rows? (?:of|with) {_M}(?: columns?)?(?: each)?", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in |into |as |of |with )*{_N} columns? (?:of|with) {_M}(?: rows?)?(?: each)?", lambda m: (number_of(m.group("m")), number_of(m.group("n")))),
    ("grid", rf"(?:in |into |as |of |with |having |that has )*{_N} (?:even |equal |straight |neat )?rows (?:and|by|x|,) {_M} columns", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in |into |as |of |with |having |that has )*{_N} columns (?:and|by|x|,) {_M} rows", lambda m: (number_of(m.group("m")), number_of(m.group("n")))),
    ("grid", rf"(?:in )?{_M} (?:across|wide) (?:and|by|x|,) {_N} (?:deep|down|high|back)", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in )?{_N} (?:deep|down) (?:and|by|x|,) {_M} (?:across|wide)", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in |into |as |of |with )*{_N} (?:even |equal |straight |neat )?rows? (?:of|with) {_M} (?:objects|things|items|pieces|ones) each", lambda m: (number_of(m.group("n")), number_of(m.group("m")))),
    ("grid", rf"(?:in |into |as |of |with )*{_N} columns? (?:of|with) {_M} (?:objects|things|items|pieces|ones) each", lambda m: (number_of(m.group("m")), number_of(m.group("n")))),
    ("columns", rf"(?:in |into |with )*(?:rows of|{_N} (?:per|in each|in every|to a|to each) row)(?(n)| (?P<k>\d+|two|three|four|five|six))", lambda m: number_of(m.group("n") or m.group("k"))),
    ("rows", rf"(?:in |into |as |of |with |having |a )*{_N} (?:even |equal |straight |neat |parallel )?rows?", lambda m: number_of(m.group("n"))),
    ("columns", rf"(?:in |into |as |of |with |having |a )*{_N} (?:even |equal |straight |neat |parallel )?columns?", lambda m: number_of(m.group("n"))),
    # groups
    (
        "group",
        r"(?:grouped |sorted |arranged |organized |organised |separated |divided |split |split up )*(?:by|according to|based on|on|in terms of) (?:their |its |the |same )?(?P<by>colour|kind|type|sort|category|class|what they are|shade|hue)",
        lambda m: "colour" if m.group("by") in ("colour", "shade", "hue") else "kind",
    ),
    (
        "group",
        r"(?:so that |so )?(?:the |all )?(?:(?:objects|things|items|ones|stuff|everything) )?(?:of |with )?(?:the )?(?:same|matching|like) (?P<by>colour|kind|type|sort)s?(?: (?:objects|things|items|ones))?(?: (?:are|is|go|stand|belong|sit|should be))?(?: all)? (?:together|with each other|next to each other)|(?:each|every) (?P<by2>colour|kind|type) (?:together|by itself|on its own|separately|in its own (?:group|pile|cluster))",
        lambda m: "colour" if (m.group("by") or m.group("by2")) == "colour" else "kind",
    ),
    (
        "group",
        r"(?:in|into|with|as|to) (?:a |one )?(?:separate |different )?(?:piles?|clusters?|groups?|heaps?|clumps?) (?:per|for each|for every|by|of each|of the same|each of one) (?P<by>colour|kind|type|sort)|(?:one|a) (?:pile|cluster|group) (?:per|for each|for every|of each) (?P<by2>colour|kind|type|sort)",
        lambda m: "colour" if (m.group("by") or m.group("by2")) == "colour" else "kind",
    ),
    (
        "group",
        r"(?:(?:in|into|with|make|build|form) )*(?:a |one |its |their )*(?:own |separate |different )?(?:piles?|clusters?|groups?|heaps?|clumps?|bunch(?:es)?) (?:per|for each|for every|of each|of every|by) (?:single )?(?P<by>colour|kind|type|sort)(?: of (?:object|thing|item)s?)?"
        r"|(?:each|every) (?P<by2>colour|kind|type|sort)(?: of (?:object|thing|item))? (?:(?:gets|has|goes|forms|should|be|have|form|get|is|belongs|in|into|to|on) )*(?:a |one |its |their )*(?:own |separate )?(?:pile|cluster|group|heap|clump|bunch)"
        r"|by what (?P<by3>they are|it is)|(?:by|in) what (?P<by4>colour) (?:they are|it is)|things of (?:a|one|the same) (?P<by5>kind|colour|type)(?: together)?",
        lambda m: "colour" if "colour" in m.groups() else "kind",
    ),
    ("groups", r"(?:in|into|as) (?:separate |different |neat |little |small |tidy )*(?:piles|clusters|groups|heaps|clumps|bunches)(?= [.,;:!]|$| by| according| with| so)", lambda m: True),
    ("each alone", r"(?:all )?(?:separately|separate from each other|each (?:on|by) (?:its|their) own|each in (?:its|their) own [a-z]+|each separately|one [a-z]+ each)(?= [.,;!]|$| and)", lambda m: True),
    ("group", r"(?:by|in) (?P<by>colour|kind|type) groups?|(?P<by2>colour|kind|type) by (?:colour|kind|type)", lambda m: "colour" if (m.group("by") or m.group("by2")) == "colour" else "kind"),
    # relations
    ("either side", r"(?:one |1 )?(?:(?:on|at|to) (?:either|each|both)(?: of the)? (?:side|sides|end|ends)(?: of)?|flanking|(?:to|on) the left and (?:to |on )?(?:the )?right (?:side )?of)", lambda m: True),
    ("relation", r"(?:(?:just|directly|immediately|right|slightly|somewhere|straight|over) )*(?:to |on |at |toward )?(?:the |its |their )?(?:very )?(?P<to>left|right)(?: hand)?(?: side)? (?:of|from)", lambda m: f"{m.group('to')} of"),
    ("relation", r"(?:(?:just|directly|immediately|right|slightly|straight) )*(?:leftward|rightward|west|east)s? of", lambda m: "left of" if m.group().split()[-2].startswith(("left", "west")) else "right of"),
    ("relation", r"(?:(?:just|directly|immediately|right|slightly|straight|there) )*(?:in (?:the )?front of|ahead of|before|on the near side of|on my side of|at the front of|south of)", lambda m: "in front of"),
    ("relation", r"(?:(?:just|directly|immediately|right|slightly|straight) )*(?:behind|in back of|at the back of|to the back of|to the rear of|at the rear of|on the far side of|in the back of|north of|beyond|past|in the rear of)", lambda m: "behind"),
    ("relation", r"(?:(?:just|directly|immediately|right|very|so) )*(?:next to|beside|by the side of|at the side of|on the side of|close to|close by|adjacent to|near to|near|nearby|nearby to|by|alongside|along side|side by side with|neighbou?ring|right up to|up against|in the vicinity of|in the neighbou?rhood of)", lambda m: "next to"),
    ("relation", r"(?:(?:right|exactly|just|halfway|midway|somewhere|half way|in|directly|mid way|squeezed|sandwiched|in the middle) )*between(?: both)?", lambda m: "between"),
    ("relation", r"(?:right |directly |back )?(?:on to the top of|on to top of|on the top of|on top of|onto the top of|onto|on to|atop|upon|atop of)", lambda m: "on"),
    ("relation", r"(?:right |directly |back )?on", lambda m: "on"),
    ("relation", r"(?:right |directly |back |down )?(?:in to|into|inside of|inside|within)", lambda m: "in"),
    ("relation", r"(?:right |directly |back )?in", lambda m: "in"),
    ("relation", r"(?:all )?(?:around|round|surrounding|encircling|ringing|all round)(?: the outside of| the perimeter of)?", lambda m: "around"),
    ("relation", r"(?:centered (?:on|around|at|about)|with (?:its|their|the) center (?:at|on))", lambda m: "around"),
    ("relation", r"(?:right |exactly |placed |standing )*(?:in|at|into) (?:the|its|their) (?:very |exact )?(?:middle|center|heart) of|amid|amidst", lambda m: "in the middle of"),
    ("inner", r"(?:(?:right|exactly|placed|standing|sitting|in|at|as) )*(?:in |at |as )(?:the|its|their) (?:very |exact |dead )?(?:middle|center|hub|heart)(?: of (?:it|them|that|everything|the (?:circle|ring|arc|square|rectangle|triangle)))?", lambda m: True),
    ("inner", r"inside (?:it|the ring|the circle)", lambda m: True),
    ("relation it", r"(?:right |directly )?on (?:the )?top(?! of)", lambda m: "on"),
    ("another", r"(?:in|into) (?:one|the first(?: one)?|the second(?: one)?|the other(?: one)?)(?= [.,;!]|$| and)", lambda m: True),
    ("another", r"(?:in|into|as|to form|on) (?:another|a second|a separate|their own|its own|the other)(?: one| one too)?(?= [.,;!]|$| and| on| at| in| near| to| along)", lambda m: True),
    ("one side", r"(?:off |over )?(?:to|on|at) (?:one|the|a) side(?= [.,;!?]|$| and| then)(?! of)|aside(?= [.,;!?]|$| and)", lambda m: m.group()),
    ("relation?", r"(?:(?:just|directly|right) )*(?:over(?! (?:next|to|by|on|at|in|near|beside|behind|there|onto|into|here))|above|below|under|underneath|beneath)", lambda m: m.group()),
    # sizes of a structure
    ("size", r"(?:as )?(?:(?:nice and|very|quite|really|fairly|rather|more|packed|spaced|set|pushed|bunched|kept|squeezed|standing) )*(?:close together|close to each other|close to one another|closely together|tightly|tight|tightly together|closely|tightly packed|closely packed|packed|compactly|compact|densely|near each other|snugly|closer together)(?: together)?", lambda m: "small"),
    ("size", r"(?:as )?(?:(?:nice and|very|quite|really|fairly|rather|more|spaced|set|well|wide|widely|all) )*(?:far apart(?: from (?:each other|one another))?|spread out|spread apart|widely spaced|wide apart|well apart|further apart|farther apart|well spaced|with (?:big|large|wide|generous|plenty of|lots of|a lot of)(?: space| room)? ?(?:gaps|between them|in between)?|loosely|loose)(?: evenly| widely| from each other)?", lambda m: "large"),
    ("size", r"(?:of )?(?:medium|moderate)(?: size| sized)?(?= [.,;!]|$|(?: on| at| in| left| right) )", lambda m: "medium"),
    ("size", r"(?:nice and |very |quite |really )?(?:large|big|huge|roomy|spacious|wide)(?= [.,;!]|$| and)", lambda m: "large"),
    ("size", r"(?:nice and |very |quite |really )?(?:small|tiny|little|short)(?= [.,;!]|$| and)", lambda m: "small"),
    (
        "size",
        r"(?:(?:with|leaving|leave|giving|give them|having|allowing|allow|keeping|keep|and) )*(?:plenty of|lots of|a lot of|loads of|tons of|ample|generous|a generous amount of) "
        r"(?:(?:elbow|breathing|free|extra|empty) )?(?:room|space|gaps|spacing|distance|air)(?: (?:between|in between|around)(?: (?:them|each|each other|each of them|all of them|neighbou?rs))?)?",
        lambda m: "large",
    ),
    (
        "size",
        r"(?:with|leaving|having|keeping) (?:some|a bit of|a little) (?:room|space|distance|air) (?:between|in between) (?:them|each other)",
        lambda m: "medium",
    ),
    (
        "size",
        r"(?:(?:with|leaving|leave|having|keeping|keep|and) )*(?:hardly any|barely any|almost no|next to no|very little|minimal|only tiny|as little as possible|little) "
        r"(?:room|space|gaps?|spacing|distance|air)(?: (?:between|in between)(?: (?:them|each|each other|each of them|all of them|neighbou?rs))?)?",
        lambda m: "small",
    ),
    ("together", r"(?:all |close )?together|(?:up )?against each other|as a group|in one place|in one spot", lambda m: True),
    ("side by side", r"(?:side by side|abreast|in single file|one behind the other|one beside the other|one next to the other|end to end|one behind another|one beside another|shoulder to shoulder)(?: in (?:a|one) (?:row|line))?", lambda m: True),
    ("stacked", r"(?:(?:stacked|piled|up|one) )*(?:on top of|on|atop|upon|onto) (?:each other|one another|the other|another)|(?:vertically|on top of one another|one above the other|stacked up|piled up)", lambda m: True),
    ("beside each other", r"(?:right |directly |just )?(?:next to|beside|near|close to|by|alongside) (?:each other|one another)", lambda m: True),
)  # fmt: skip
PATTERNS: tuple[tuple[str, re.Pattern[str], Callable[[re.Match[str]], Any] | None], ...] = tuple(
    (kind, re.compile(rf"(?:{pattern})(?= |$)"), value) for kind, pattern, value in (*_PATTERNS, *METRIC_PATTERNS)
)

"""Recognise what is said with a length: gaps, radii, lengths of lines, distances and moves."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

_LEAD = (
    r"(?:(?:with|leaving|leave|keep|keeping|and|have|having|at|by|there (?:is|are|should be|must be)|a|an|the|each|equal|"
    r"even|uniform|clear|always|where|placed|standing|set) )*"
)
_SPACE = (
    r"(?:gaps?|spacing|spaces?|distances?|intervals?|clearance|separation|room|air|margin|breathing (?:space|room)|offset)"
)
_FREE = r"(?: of)?(?: (?:free|clear|empty|open|blank))*"
_NEIGHBOURS = (
    r"(?:(?:direct|immediate) )?(?:neighbou?rs|(?:neighbou?ring|adjacent|consecutive|successive) (?:ones|objects|things|pieces|items|elements))"
)
_PAIRED = (
    r"(?:(?:(?:each|every|any|all) )?(?:(?:pair of|two|pairs of) )?" + _NEIGHBOURS + r"|(?:one|each|each one) and the next(?: one)?"
    r"|them(?: all)?|each other|one another|all of them|each (?:of them|one|pair|two)|every (?:two|pair|one)|any two(?: of them)?"
    r"|adjacent ones|each|any of them|the individual (?:ones|objects))"
)
_BETWEEN = rf"(?: (?:between|in between|separating) {_PAIRED})"
_END = r"(?= [.,;!]|$| and| in| on)"
_WHOLE = (
    r"(?:(?:measured )?(?:from )?(?:one )?end to (?:the other )?end|from one end to the other|tip to tip|from (?:the )?first to (?:the )?last(?: one| object)?"
    r"|between (?:the|its) (?:two )?ends|from start to (?:end|finish)|between the first and the last(?: one| object)?"
    r"|(?:, )?measured (?:from|between) (?:the )?(?:center|middle)s? (?:of|to) .{3,50}?(?:last|ends|outermost ones|end objects|end ones|other)(?: one| object)?)"
)
_TO_SIDE = r"(?:(?:over )?to (?:the|my|your) |toward (?:the|my|your) )?(?P<to>left|right)(?:ward|wards)?(?: hand side| side| hand)?"
_ME = r"(?:me|us|you|the robot|the arm|myself|where i (?:am|sit))"


def _side(match: re.Match[str]) -> str:
    return match.group("to")


METRIC_PATTERNS: tuple[tuple[str, str, Callable[[re.Match[str]], Any] | None], ...] = (
    # gaps
    (
        "gap",
        r"(?:spaced |set |placed |standing |separated |at intervals of |with )?(?:by )?LEN(?: of (?:space|distance|room|air|gap))?"
        r" apart(?: from (?:each other|one another|its neighbou?rs?|their neighbou?rs?|the next(?: one)?))?",
        None,
    ),
    (
        "gap",
        r"(?:(?:with|where|and|so that|the|its|their|all) )*(?:neighbou?rs|(?:neighbou?ring|adjacent|consecutive) [a-z]+) (?:(?:are|is|being|stand|standing|should be) )*LEN"
        r" (?:apart|from each other|from one another)",
        None,
    ),
    ("gap", rf"{_LEAD}{_SPACE} (?:of |is |are |being |: |= )?LEN{_BETWEEN}?", None),
    ("gap", rf"{_LEAD}LEN{_FREE} {_SPACE}(?:{_BETWEEN}| (?:between|in between){_END}| in (?:each|either) case)?", None),
    ("gap", rf"{_LEAD}LEN{_FREE}{_BETWEEN}", None),
    ("gap", rf"{_LEAD}LEN{_FREE} (?:between|in between){_END}", None),
    ("gap", r"(?:(?:equally|evenly) )?(?:spaced|separated|spacing|with spacing)(?: by| at| of)? LEN", None),
    ("gap", r"(?:at )?intervals of LEN|every LEN|LEN (?:away )?from (?:each other|one another|the next(?: one)?|its neighbou?rs?)", None),
    # circles and lines
    ("radius", r"(?:(?:with|of|and|having|whose|its|the|a) )*(?:radius|r|are(?= =))(?: of| is| should be| =| :|)? LEN|(?:with )?(?:a )?LEN(?: in| of)? radius", None),
    ("radius", r"(?:(?:each|all|every one|each one|each of them|at|with|a|placed|standing|,) )*(?:distance of )?LEN (?:away )?from (?:its|the|their) (?:center|middle)(?: of the (?:circle|ring))?", None),
    ("diameter", r"(?:(?:with|of|and|having|whose|its|the|a) )*diameter(?: of| is| should be| =| :|)? LEN|(?:with )?(?:a )?LEN(?: in| of)? diameter|LEN across", None),
    (
        "length of",
        r"(?:(?:that is|that's|which is|with|of|and|having|whose|its|the|a) )*(?:total |overall )?length(?: of| is| should be)? LEN"
        rf"(?: {_WHOLE}| in total)?|(?:that is |that's |which is )?LEN(?: in)?(?: total| overall)? (?:long|length)(?: in total| overall)?(?:(?: ,)? {_WHOLE})?",
        None,
    ),
    ("length of", rf"(?:(?:that|which|is|are|measures|measuring|covering|covers|,) )*LEN {_WHOLE}", None),
    (
        "wide",
        r"(?:(?:that|which|it|and|should|to) )*(?:is|measures|measuring|measure|spans|spanning|span|stretches|stretching|extends|extending|covers|covering)(?: over| across| for)? LEN"
        r"(?: (?:across|wide|long|in total|in length|overall|altogether|from end to end|end to end|from one end to the other))*",
        None,
    ),
    ("wide", r"(?:that is |that's |which is )?LEN (?:wide|in width)", None),
    # moves
    ("move", rf"(?:over )?(?:by )?(?:about |exactly |another |a further )*LEN (?:, )?(?:further |farther |more )*{_TO_SIDE}(?! of)(?! from)", _side),
    ("move", rf"(?:further |farther |over |more )*{_TO_SIDE} (?:, )?(?:by |about |exactly |a further |another )*LEN(?! of)(?= [.,;!?]|$| and| please| then| so)", _side),
    (
        "move",
        rf"(?:by )?LEN (?:, )?(?:further |farther |more )?(?:toward|closer to|nearer to|closer|nearer|near to|in the direction of)(?: (?:{_ME}|the front|the near edge|the front edge))?(?! to)(?! the)",
        lambda m: "closer",
    ),
    ("move", r"(?:by )?LEN (?:this way|my way|in my direction|over here)", lambda m: "closer"),
    ("move", rf"(?:closer|nearer|toward)(?: to)?(?: (?:{_ME}|the front))? (?:, )?(?:by )?LEN", lambda m: "closer"),
    (
        "move",
        rf"(?:by )?LEN (?:, )?(?:further |farther )?(?:away(?: from {_ME})?|further away|back|backward|backwards|to the back|toward the back|further back|farther|further|toward the far (?:edge|side|end)|from me)(?: from {_ME})?(?! of)(?! from)",
        lambda m: "away",
    ),
    ("move", rf"(?:further |farther )?(?:away|back|backward|backwards)(?: from {_ME})? (?:, )?(?:by )?LEN", lambda m: "away"),
    ("move?", r"(?:by )?LEN (?:forward|forwards|up|down|upward|downward|sideways|ahead)|(?:forward|forwards|up|down|sideways) (?:by )?LEN", lambda m: m.group()),
    (
        "move?",
        r"(?:just )?(?:a (?:little )?bit|a little|a touch|slightly|a tad|somewhat|a few (?:cm|centimeters|centimetres|inches)|some|a (?:hand|hand's|hands|finger's|thumb's|palm's|finger|thumb) (?:width|breadth))(?: further| more)? (?:to (?:the )?(?:left|right|back|front)|toward (?:the )?(?:left|right|back|front|me)|closer|nearer|away|left|right|back|further|forward)(?! of)(?! to)",
        lambda m: m.group(),
    ),
    # distances of relations
    ("apart", r"LEN (?:away |off )?from", lambda m: "next to"),
    ("apart", r"(?:at )?(?:a )?(?:distance of )?LEN (?:away )?from|(?:at )?a distance of LEN from", lambda m: "next to"),
    ("away", rf"(?:by |with |at |and |leaving |keeping )*(?:a )?(?:{_SPACE} of )?LEN (?:away|off|gap|distance|of distance|of space)(?: in (?:each|either) case)?(?! from)", None),
    ("away", rf"(?:(?:by|with|at|leaving|keeping) )(?:a )?(?:{_SPACE} of )?LEN(?! from)", None),
)  # fmt: skip

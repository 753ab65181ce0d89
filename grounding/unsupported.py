"""Recognise requests that the five slots cannot hold, so that they are refused or asked about and never dropped.

A parser of five slots forces other wishes into them: "tallest at the bottom" became a position on the table.
Patterns over the sentence find such requests: an order of the objects, lengths and angles, how single objects are
turned, lines along an edge, corners without a name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from grounding.lazy_pattern import LazyPattern
from grounding.parse_result import OPEN, Parse, Question, refusal, shortened
from grounding.references.function_words import SHAPE_WORDS
from grounding.references.lexicon import GROUPS
from grounding.references.pattern_parts import (
    ALPHABETICAL,
    ALTERNATING,
    GRADED,
    MORE,
    MOST,
    NUMBER,
    ORDER_KEY,
    POSE,
    UNIT,
    any_of,
)
from grounding.references.word_forms import FORMS
from grounding.slot_corrections import with_plain_words
from grounding.spec import StructureSpec
from grounding.structure_words import STRUCTURES

_TOKEN = re.compile(r"\d+(?:[.,]\d+)?|[^\W\d_]+(?:['’][^\W\d_]+)*|[,.;:!?°\"]")


_NOUN = any_of(word for word in FORMS if word.isalpha())
_THING = rf"(?:ones?|objects?|things?|items?|{_NOUN})"
_PLACE = (
    r"(?:(?:at|on|in|to|towards?) (?:the )?(?:very )?(?:bottom|top|left|right|front|back|middle|cent(?:er|re)|ends?"
    r"|start|beginning|far end|near end|base)|first|last|lowest|highest|underneath|closest|nearest|farthest|furthest)"
)
_GOES = r"(?: (?:goes|go|comes|come|should (?:be|go|come|stand)|must (?:be|go)|to (?:be|go)|is|are|being|standing))?"
# Where an object stands within the structure, and not where the structure stands.
_WITHIN = (
    r"(?:on (?:the )?(?:very )?top(?! of (?:each|one an))|at the (?:very )?(?:top|bottom)|underneath|at "
    r"(?:the|each|either|one|both) ends?"
    r"|on (?:the|each|either|both) ends?|first|last|in (?:the|its) (?:very )?(?:middle|cent(?:er|re)))"
)
# Not labels or noses: a row whose labels face me is a row that faces me.
_PARTS = r"(?:handles?|spouts?|lids?|blades?|nozzles?|caps?|tines?)"

# Each: what is asked for, as it is named in the refusal, and how it is said.
_REFUSED: tuple[tuple[str, LazyPattern], ...] = tuple(
    (what, LazyPattern(pattern))
    for what, pattern in (
        (
            "an order of the objects",
            r"\b(?:by|according to|in order of|sorted|ordered|ranked|graded)(?: by| on)?(?: their| its)?"
            rf" {ORDER_KEY}s?\b",
        ),
        ("an order of the objects", rf"\b(?:ascending|descending|increasing|decreasing|{ALPHABETICAL})\b"),
        ("an order of the objects", r"\bin (?:this |that |the following |reverse |the same )?order\b(?! to\b)"),
        (
            "an order of the objects",
            rf"\bfrom (?:the )?(?:{MOST}|{MORE}|{GRADED})"
            rf"(?: {_THING})? (?:to|up to|down to) (?:the )?(?:{MOST}|{MORE}|{GRADED})\b",
        ),
        ("an order of the objects",
         rf"(?:^|[,;:.] |\b(?:with|and|but|have|having|so) )(?:the )?{MOST}(?: {_THING})?{_GOES} {_PLACE}\b"),
        ("an order of the objects", rf"[,;:] (?:the )?{MOST}(?: {_THING})? (?:left|right|front|back|top|bottom)\b"),
        ("an order of the objects", rf"\b{MOST}(?: {_THING})? (?:first|last|lowest|underneath)\b"),
        ("an order of the objects",
         rf"\b(?:starting|beginning|ending) (?:with|on) (?:the|a|one) (?:\w+ ){{0,2}}{_THING}\b"),
        ("an order of the objects",
         rf"\b(?:{ALTERNATING}|interleav(?:e|ed|ing)|every other (?:one|object|cup|can|block|mug|box))\b"),
        (
            "a place next to single objects",
            r"\b(?:left|right|north|south|east|west|in front|on top) of (?:the |a |an |my |your )?(?:\w+ "
            rf"){{0,2}}?{_NOUN}\b",
        ),
        (
            "a choice of objects by their place",
            rf"\b{_THING} (?:that (?:is|are) |which (?:is|are) )?(?:nearest|closest|farthest|furthest)\b",
        ),
        ("a length in units", rf"\b(?:\d+(?:[.,]\d+)? ?(?:{UNIT}|m|in|\")|{NUMBER} {UNIT})(?![\w'])"),
        ("an angle in degrees", r"\b\d+ ?(?:degrees?|deg|°)"),
        ("how single objects are turned", rf"\b{POSE}\b"),
        ("how single objects are turned",
         rf"\b{_PARTS} (?:all )?(?:facing|pointing|turned|towards?|to the (?:left|right|front|back)"
         r"|inwards?|outwards?)\b"),
    )
)  # fmt: skip
_INSIDE = LazyPattern(
    rf"(?:\b(?:with|and)|,) (?:the|a|an|one|my|your) (?P<what>(?:\w+ ){{0,2}}?{_THING}){_GOES} {_WITHIN}(?! of the "
    r"(?:table|desk|board))\b"
)
_OTHERS = LazyPattern(rf"\b(?:{_NOUN}|everything|all|them|these|those|objects|things)\b")
_ALONG = re.compile(
    r"\b(?:along|against|hugging|flush with|following|parallel to|all the way down)(?: the| my| your| its| that| this| "
    r"one| an)*"
    r"(?: (?!and\b|with\b|in\b|on\b)\w+){0,3}? (?:edge|rim|border|side|wall)\b"
    r"|\balong (?:the )?(?:front|back|left|right|far|near)\b|\bon (?:the|my|your) (?:very )?(?:\w+ "
    r")?(?:edge|rim|border)\b"
)
_CORNER = re.compile(r"\bcorners?\b")
# Words that say which corner, from left to right and in depth.
_DIRECTIONS = {
    "x_position": re.compile(r"\b(?:left|right|\w*east\w*|\w*west\w*|port|starboard)\b"),
    "y_position": re.compile(
        r"\b(?:front|back|rear|near\w*|far\w*|fur\w*|top|bottom|upper|lower|north\w*|south\w*|clos\w*|away|behind"
        r"|opposite|distant|my|your|me|you|us|robot)\b"
    ),
}
# "Stack the cups on the plate": which object carries the others. Tables and what lies on them flat carry everything.
_ONTO = LazyPattern(
    rf"\b(?:on|onto|on top of|atop|over) (?:it\b|(?:the|a|an|my|this|that) (?:\w+ ){{0,2}}?(?P<noun>{_NOUN})\b)"
)
_CARRIERS = frozenset("table tables board tray mat placemat cloth napkin shelf".split())
# Pieces with places of their own, for the shapes that have them.
_PIECES = {
    shape: LazyPattern(
        rf"\bwith (?:the|a|an|its|my|your) {any_of(structure.pieces)} (?:on|to|at) (?:the|its|my|your)"
        r" (?:left|right|top|bottom|back|front)\b"
    )
    for shape, structure in STRUCTURES.items()
    if structure.pieces
}
_BUILT = re.compile(
    r"\b(?:build|make|construct|form|create|erect|shape|assemble)(?: (?:me|us))? (?:an?|some kind of) (?:\w+ ){0,2}?(?P<what>\w+)"
    r" (?:out of|from|using|with|of)\b"
)
_MEASURED = re.compile(
    rf"\b(?:\d+|an?|one|{NUMBER}) (?:finger|thumb|hand|palm|fist|arm|shoulder|pencil)(?:'?s)?"
    r" (?P<unit>width|breadth|length|span)s?\b"
)
CORNER = "corner"  # what a question about a corner asks for, in place of a slot
# A corner by its name, as a question offers it: the positions of both slots.
CORNERS: Mapping[str, tuple[str, str]] = {
    "front left": ("left", "bottom"),
    "front right": ("right", "bottom"),
    "back left": ("left", "top"),
    "back right": ("right", "top"),
}


@dataclass(frozen=True)
class _Unsupported:
    """What cannot be built, and the words that ask for it."""

    what: str
    words: str


def checked(parse: Parse, mended: Callable[[], str] | None = None) -> Parse:
    """Refuse or ask if the instruction has wishes that the parse cannot express; otherwise return the parse.

    Args:
        parse: the parser's result; a refusal is returned unchanged.
        mended: returns the instruction with corrected typing errors.
    """
    if parse.status == "refused":
        return parse
    sentence = _normalized(parse.text)
    found = _unsupported(sentence, parse)
    if found is not None:
        message = (
            f"{shortened(parse.text)!r} asks for {found.what} ({found.words!r}), which cannot be built yet; "
            "leave it out, and the rest can be built"
        )
        return replace(
            parse, spec=StructureSpec(), status="refused", message=message, question=None, confidence={}, evidence={}
        )
    parse = with_plain_words(_normalized(mended()) if mended else sentence, parse)
    question = _edge_question(sentence, parse) or _corner_question(sentence, parse, mended or (lambda: parse.text))
    if question is None:
        return parse
    return replace(parse, status="ask", message=question.text, question=question)


def no_object(text: str, reason: str) -> str:
    """Return the refusal of an instruction one of whose nouns is no object: a shape that nobody knows, as in "build a
    staircase out of the cans", or a unit, as in "two finger widths apart"; otherwise the reason that is given.

    Args:
        text: the instruction.
        reason: why it is refused, which quotes the noun of which nothing is there.
    """
    sentence = _normalized(text)
    built = _BUILT.search(sentence)
    if built is not None and f"names {built.group('what')!r};" in reason:
        return refusal(text, "unbuildable", "").message
    measured = _MEASURED.search(sentence)
    if measured is not None and f"{measured.group('unit')!r};" in reason:
        return f"{measured.group()!r} in {shortened(text)!r} is no length; units: mm, cm, m, inches, feet"
    return reason


def _normalized(text: str) -> str:
    return " ".join(match.replace("’", "'") for match in _TOKEN.findall(text.lower().replace("-", " ")))


def _unsupported(sentence: str, parse: Parse) -> _Unsupported | None:
    structure = STRUCTURES.get(parse.spec.shape or "")
    on_each_other = structure is not None and structure.stacked
    for what, pattern in _REFUSED:
        if match := pattern.search(sentence):
            return _Unsupported(what, match.group().strip(" ,;:."))
    for match in _INSIDE.finditer(sentence):
        words = match.group("what").split()
        # "A circle with the cups in the middle" says where the circle is; "with the bowl in the middle" where the bowl
        # is.
        others = _OTHERS.search(sentence[: match.start()])
        others = others or (on_each_other and sentence[match.end() :].startswith(" of "))
        single = words[-1] in ("one", "object", "thing", "item") or not FORMS.get(words[-1], ("", True))[1]
        stacked = on_each_other and "middle" not in match.group() and "cent" not in match.group()
        if words[-1] not in SHAPE_WORDS and others and (single or stacked) and words[-1] not in GROUPS:
            return _Unsupported("a place of one object within the structure", match.group().strip(" ,"))
    if on_each_other and (match := _ONTO.search(sentence)) and _OTHERS.search(sentence[: match.start()]):
        if (match.group("noun") or "") not in _CARRIERS:
            return _Unsupported("an order of the objects", match.group())
    pieces = _PIECES.get(parse.spec.shape or "")
    if pieces and (match := pieces.search(sentence)):
        return _Unsupported("a place of one object within the structure", match.group())
    return None


def _edge_question(sentence: str, parse: Parse) -> Question | None:
    """Return the question for a line along an edge; only a line in the outer third, at any angle, can be built."""
    match = _ALONG.search(sentence)
    if match is None or (parse.spec.shape and not STRUCTURES[parse.spec.shape].along_edges):
        return None
    slot = "x_position" if re.search(r"\b(?:left|right|east|west)\b", match.group()) else "y_position"
    value = getattr(parse.spec, slot)
    options = (value, OPEN) if value else (("left", "right", OPEN) if slot == "x_position" else ("top", "bottom", OPEN))
    name = slot.replace("_", " ")
    text = (
        f"objects lined up exactly {match.group()!r} cannot be built yet, only a structure in that part of the table; "
        f"the {name}: {' or '.join(options)}?"
    )
    return Question(slot, text, options)


def _corner_question(sentence: str, parse: Parse, mended: Callable[[], str]) -> Question | None:
    """Return the question which corner is meant."""
    if not _CORNER.search(sentence):
        return None
    slots = {"x_position": ("left", "right"), "y_position": ("top", "bottom")}
    clauses = [clause for clause in re.split(r"[.;!?]", sentence) if clause.strip()]
    spoken_of = len(clauses) == 1 or any("corner" in " ".join(parse.evidence.get(slot, ())).lower() for slot in slots)
    if not spoken_of:
        return None
    said = _normalized(mended())
    doubtful = [slot for slot in slots if getattr(parse.spec, slot) is None or not _DIRECTIONS[slot].search(said)]
    if not doubtful:
        return None
    if len(doubtful) > 1:
        text = f"which corner is meant in {shortened(parse.text)!r}: {', '.join(CORNERS)}?"
        return Question(CORNER, text, tuple(CORNERS))
    slot = doubtful[0]
    options = slots[slot]
    legal = f"the {slot.replace('_', ' ')} can be {' or '.join(options)}"
    text = f"which corner is meant in {shortened(parse.text)!r}: {legal}?"
    return Question(slot, text, options)

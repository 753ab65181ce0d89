"""Corrections in conversation: what "a bit bigger", "now as a line" or "the other side" make of a wish.

Relative parts are read here, absolute parts ("on the left", "as a line") by a parser. Everything is as
spoken: left is the speaker's left, and "clockwise" is as seen from above.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

from grounding.editing import Editing, changed_slots
from grounding.parse import REFUSALS, WHICH_SHAPE, Parse, Parser, Question
from grounding.reading import turned
from grounding.relative import Edit, normalized, relative_edits
from grounding.selection import mentioned
from grounding.spec import StructureSpec

Read = Callable[[str], Parse]
REVISION_STATUSES = ("ok", "ask", "refused", "unchanged")
_LONGEST_CORRECTION = 400  # characters; what is longer is an instruction of its own
_SHAPE_WORDS = (
    r"(?:circle|ring|loop|round|line|row|queue|file|tower|stack|pile|column|place setting"
    r"|table setting|setting"
    r"|square|triangle|rectangle|grid|heart|star|pyramid|spiral|cross|arc|semicircle|diamond|wall|bridge)"
)
_STRUCTURE = r"(?:structure|arrangement|whole thing|shape|formation|layout|thing)"
_AS_SHAPE = rf"an? (?:\w+ ){{0,2}}{_SHAPE_WORDS}"
# What makes a sentence a correction: it speaks of what is there already, or of a change.
_MARKERS = re.compile(
    r"\b(?:instead|same|again|rather|too|swap|replace|also|as well|now|it|them|they|its|this one|that one"
    r"|keep|change|but|still|make that|make this"
    rf"|move|shift|slide|(?:as|into) {_AS_SHAPE}|the (?:\w+ )?{_STRUCTURE}|the {_SHAPE_WORDS})\b"
    r"|^(?:and|no|nope|not|or|actually|sorry|wait|hmm|hm|add|include|remove|drop|without|except"
    r"|leave out|skip"
    r"|take out|use|only|just|with)\b"
)
_STRONG_MARKERS = re.compile(
    r"\b(?:instead|same|(?:make|turn|change) (?:it|that|this|them)|this time|swap|replace|again|rather)\b"
)
_PRONOUNS = re.compile(r"\b(?:it|them|they)\b")
_AGAIN = re.compile(r"\b(?:same|again)\b")
_OTHER_OBJECTS = re.compile(r"\b(?:with|using|use|add|include)\b")
_EVERYTHING = re.compile(r"\b(?:everything|all|anything)\b")
_WHOLE_TABLE = re.compile(
    r"\b(?:with|of|use|using|include|take) (?:everything|all (?:of )?(?:the )?(?:objects|things|items))\b"
)
_SWAPPING = re.compile(
    r"\b(?:swap|replace|exchange|substitute)\b(?: \w+){1,6}? (?:for|with|by) (?P<these>.+)"
)
_ADDING = re.compile(r"\b(?:add|include|too|also|as well|plus|along with|together with)\b|^and\b")
_REMOVING = re.compile(r"\b(?:remove|drop|take (?:away|out)|get rid of|lose)\b")
_BUILDING = re.compile(
    r"\b(?:make|build|form|create|put|construct|set|stack|pile|line up|arrange|lay|erect|draw|do"
    r"|give|want|need|place"
    r"|queue|organi[sz]e|align)\b"
)
# What is said besides, and need not be read.
_FILLERS = frozenset(
    "a an the please it its it's them they this that these those make move put set place turn shift have "
    "let get bring keep do be is are i i'd i'll want like would you could can will should we need and but "
    "also too so now then just ok okay well no nope yes yeah actually sorry hmm hm oh ah wait thanks "
    "thank a bit little to by of at in on over up everything all thing things structure arrangement whole "
    "same again instead as what how about still only more much very really maybe perhaps one some , for "
    "me us my go going rather between their there here up even that's fine good great nice hey hi robot "
    "dear then was were been much if possible mind try don't not circle ring line row tower stack "
    "pile".split()
)
# Words for what a slot can say; without one of them, there is nothing for the parser to read.
_ABSOLUTE = re.compile(
    rf"\b(?:{_SHAPE_WORDS}s?|round|circular|straight|side by side|left|right|center|centre|central"
    rf"|middle|back|front"
    r"|rear|top|bottom|near|far|close|away|corner|edge|end|side|small|medium|large|big|tiny|huge"
    r"|tight|compact|loose"
    r"|wide|short|long|facing|faces?|look(?:s|ing)?|point(?:s|ing)?|towards?|north|south|east"
    r"|west|open(?:s|ing)?|gap"
    r"|stacked|lined|piled|stack|size|spread|on top of)\b"
)
_FRAGMENT = re.compile(rf"\b(?:as|into|a|an|now) (?:\w+ )?{_SHAPE_WORDS}\b|\b(?:on the|at the|in the) \w+")
_PREAMBLE = re.compile(
    r"^(?:(?:and|but|no|now|same|again|thing|also|just|ok|okay|please|,)(?: |$))*"
    r"(?:(?:put|move|place|set|bring|have|get|make) (?:it|them|this|that)(?: |$))?"
)


@dataclass(frozen=True)
class Revision:
    """What a sentence in a conversation makes of the last specification.

    Attributes:
        spec: what is wanted now: the last one where nothing changes or all is refused, what is sure so far
            (for a new instruction the best reading) where there is a question.
        status: "ok", "ask" (`question` says what), "refused" (no wish in it) or "unchanged" (a correction
            that changes nothing; `message` says why).
        kind: "edit" for a correction, "new" for an instruction of its own.
        message: what has to be said to the speaker: why not, the question, what gave way; may be empty.
        changed: the slots in which `spec` differs from the last one.
        question: only with "ask".
        objects_text: what `select_objects` should be asked; `None` where the objects stay the same.
        objects_how: "replace" the objects, "add" to them or "remove" from them; empty where they stay.
        parse: what the parser said of the absolute part; `None` where there was none.
    """

    spec: StructureSpec
    status: str
    kind: str
    message: str = ""
    changed: tuple[str, ...] = ()
    question: Question | None = None
    objects_text: str | None = None
    objects_how: str = ""
    parse: Parse | None = None


def revise(last: StructureSpec, text: str, parser: Parser, viewpoint: str = "robot") -> Revision:
    """What the next sentence of a conversation asks for.

    Args:
        last: what was asked for before, as spoken.
        text: any string.
        parser: reads new instructions and the absolute parts of corrections.
        viewpoint: one of `grounding.reading.VIEWPOINTS`: whose left and right `last` is, and the result. What
            is said of the robot ("closer to you") is turned into the words of somebody who sits across.
    """

    def read(said: str) -> Parse:
        parse = parser.parse(said)
        # `turned` leaves alone what is said of the robot, so turning it back turns just that.
        return replace(parse, spec=turned(parse).turned()) if viewpoint == "opposite" else parse

    sentence = normalized(text[: _LONGEST_CORRECTION + 1])
    if len(text) > _LONGEST_CORRECTION or not sentence:
        return _new(last, text, read(text))
    edits, rest = relative_edits(sentence)
    if viewpoint == "opposite":
        edits = [edit.seen_from_across() for edit in edits]
    named = mentioned(text)
    if not edits and not _MARKERS.search(sentence) and (named or _BUILDING.search(sentence)):
        parse = read(text)
        if named or parse.status != "ok" or parse.spec.shape is not None or last.shape is None:
            return _new(last, text, parse)
    elif named and not _STRONG_MARKERS.search(sentence) and not _PRONOUNS.search(sentence):
        parse = read(text)
        whole = parse.spec.shape is not None and not _speaks_of(sentence)
        if whole or (not edits and parse.status == "ok" and _BUILDING.search(sentence)):
            return _new(last, text, parse)
    return _edited(last, text, edits, rest, named, read)


def _speaks_of(sentence: str) -> bool:
    """Whether the sentence speaks of the structure that is there: "make the circle of cups bigger"."""
    return re.search(rf"\bthe (?:\w+ )?{_SHAPE_WORDS}\b", sentence) is not None


def _new(last: StructureSpec, text: str, parse: Parse) -> Revision:
    if parse.status == "refused":
        return Revision(last, "refused", "new", parse.message, parse=parse)
    changed = changed_slots(last, parse.spec)
    return Revision(
        parse.spec, parse.status, "new", parse.message, changed, parse.question, text, "replace", parse
    )


def _edited(
    last: StructureSpec, text: str, edits: list[Edit], rest: str, named: tuple[str, ...], read: Read
) -> Revision:
    objects_text, how = _objects(normalized(text), named, edits)
    rest = _WHOLE_TABLE.sub("", rest).strip(" ,")
    parse = None if _SWAPPING.search(normalized(text)) else _absolute(text, rest, edits, named, how, read)
    if parse is not None and parse.status == "refused":
        if not (edits or how) or REFUSALS["idle"] not in parse.message:
            return Revision(last, "refused", "edit" if edits else "new", parse.message, parse=parse)
        parse = None
    editing = Editing(last)
    if parse is not None:
        editing.absolute(parse)
    editing.relative(edits)
    doubt = parse.question if parse is not None and not (edits or how) else None
    question = editing.question or doubt
    changed = changed_slots(last, editing.spec)
    if question is not None:
        return Revision(
            editing.spec, "ask", "edit", question.text, changed, question, objects_text, how, parse
        )
    if not (edits or how or parse is not None or _AGAIN.search(rest)):
        parse = read(text)
        if parse.status == "refused":
            return Revision(last, "refused", "new", parse.message, parse=parse)
        question = parse.question or WHICH_SHAPE
        return Revision(last, "ask", "edit", question.text, (), question, parse=parse)
    again = _AGAIN.search(rest) is not None
    status = "ok" if changed or how or (again and not editing.notes) else "unchanged"
    message = "; ".join(editing.notes) or ("" if status == "ok" else f"that is already so: {last}")
    return Revision(editing.spec, status, "edit", message, changed, None, objects_text, how, parse)


def _objects(sentence: str, named: tuple[str, ...], edits: list[Edit]) -> tuple[str | None, str]:
    """(what to select, how) where the objects change."""
    if not named:
        # "Put everything on the right" speaks of what takes part already.
        return ("everything", "replace") if _WHOLE_TABLE.search(sentence) and not edits else (None, "")
    if swapped := _SWAPPING.search(sentence):
        return " and ".join(mentioned(swapped.group("these"))) or None, "replace"
    without = [name for name in named if name.startswith(("not ", "everything but "))]
    others = _STRONG_MARKERS.search(sentence) or _OTHER_OBJECTS.search(sentence)
    if edits and not others and not without:
        return None, ""  # "spread the cups out more" speaks of those that are there
    if without and len(without) == len(named):
        if named[0].startswith("everything but ") and _EVERYTHING.search(sentence):
            return named[0], "replace"
        return " and ".join(re.sub(r"^(?:not|everything but) ", "", name) for name in without), "remove"
    said = " and ".join(name for name in named if name not in without)
    said += "".join(f", but {name}" for name in without)
    if _REMOVING.search(sentence):
        return said, "remove"
    return said, "add" if _ADDING.search(sentence) and not _STRONG_MARKERS.search(sentence) else "replace"


def _absolute(
    text: str, rest: str, edits: list[Edit], named: tuple[str, ...], how: str, read: Read
) -> Parse | None:
    """The parser's reading of what the relative parts leave over; `None` where nothing is left to read."""
    telling = _ABSOLUTE.search(rest) is not None
    if edits or how or _AGAIN.search(rest):
        telling = (telling and not _FILLERS.issuperset(rest.split())) or _FRAGMENT.search(rest) is not None
    if not telling:
        return None
    said = text if not (edits or _WHOLE_TABLE.search(text.lower())) else rest
    parse = read(said)
    retried = ("idle",) if named else ("idle", "relation")
    if parse.status == "ask" or any(REFUSALS[reason] in parse.message for reason in retried):
        # "facing me" alone is too little for a parser, and "it" may be one object to it.
        whole = read(f"put them {_PREAMBLE.sub('', rest)}")
        parse = whole if whole.status == "ok" else parse
    return parse

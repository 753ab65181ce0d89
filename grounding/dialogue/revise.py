"""Revise a goal by a correction: how "a bit bigger", "now as a line" or "the other side" change it.

Relative parts are read here, absolute parts ("on the left", "as a line") by a parser. Everything is as
spoken: left is the speaker's left, and "clockwise" is as seen from above.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

from grounding.dialogue.object_changes import EVERYTHING, ObjectChange, object_change
from grounding.dialogue.relative_edits import Edit, normalized, relative_edits
from grounding.dialogue.replacements import IMPOSSIBLE, PLACING
from grounding.dialogue.slot_edits import Editing, changed_slots
from grounding.dialogue.unread import NOT_UNDERSTOOD, unread_words
from grounding.parse_result import REFUSALS, WHICH_SHAPE, Parse, Parser, Question, shortened
from grounding.references.selection import mentioned
from grounding.spec import StructureSpec
from grounding.structure_words import words_of_all
from grounding.viewpoint import turned

Read = Callable[[str], Parse]
REVISION_STATUSES = ("ok", "ask", "refused", "unchanged")
_LONGEST_CORRECTION = 400  # characters; what is longer is an instruction of its own
# Shapes that cannot be built, and are asked for all the same.
OTHER_SHAPES = (
    "square triangle rectangle grid heart star pyramid spiral cross arc semicircle diamond wall bridge".split()
)
_SHAPE_WORDS = rf"(?:{'|'.join((*words_of_all('nouns'), *OTHER_SHAPES))})"
_STRUCTURE = r"(?:structure|arrangement|whole thing|shape|formation|layout|thing)"
_AS_SHAPE = rf"an? (?:\w+ ){{0,2}}{_SHAPE_WORDS}"
# What makes a sentence a correction: it speaks of what is there already, or of a change.
_MARKERS = re.compile(
    r"\b(?:instead|same|again|rather|too|swap|replace|exchange|substitute|switch|trade|also|as well|now|it|them|they"
    r"|its|this one|that one"
    r"|keep|change|but|still|make that|make this"
    rf"|move|shift|slide|(?:as|into) {_AS_SHAPE}|the (?:\w+ )?{_STRUCTURE}|the {_SHAPE_WORDS})\b"
    r"|^(?:and|no|nope|not|or|actually|sorry|wait|hmm|hm|add|include|remove|drop|without|except"
    r"|leave out|skip"
    r"|take out|use|only|just|with)\b"
)
_STRONG_MARKERS = re.compile(
    r"\b(?:instead|same|(?:make|turn|change) (?:it|that|this|them)|this time|swap|replace"
    r"|exchange|substitute|switch|trade|again|rather)\b"
)
_PRONOUNS = re.compile(r"\b(?:it|them|they)\b")
_AGAIN = re.compile(r"\b(?:same|again)\b")
_OTHER_OBJECTS = re.compile(r"\b(?:with|using|use|only|just)\b")
_BUILDING = re.compile(
    rf"\b(?:{'|'.join(words_of_all('verbs'))}|make|build|form|create|put|construct|set|arrange|lay|erect|draw|do"
    r"|give|want|need|place|organi[sz]e)\b"
)
# What is said besides, and need not be read.
_FILLERS = frozenset(words_of_all("plain_nouns")) | frozenset(
    "a an the please it its it's them they this that these those make move put set place turn shift have "
    "let get bring keep do be is are i i'd i'll want like would you could can will should we need and but "
    "also too so now then just ok okay well no nope yes yeah actually sorry hmm hm oh ah wait thanks "
    "thank a bit little to by of at in on over up everything all thing things structure arrangement whole "
    "same again instead as what how about still only more much very really maybe perhaps one some , for "
    "me us my go going rather between their there here up even that's fine good great nice hey hi robot "
    "dear then was were been much if possible mind try don't not".split()
)
# Words for what a slot can say; without one of them, there is nothing for the parser to read.
_ABSOLUTE = re.compile(
    rf"\b(?:{_SHAPE_WORDS}s?|{'|'.join(words_of_all('adjectives'))}|left|right|center|centre|central"
    rf"|middle|back|front"
    r"|rear|top|bottom|near|far|close|away|corner|edge|end|side|small|medium|large|big|tiny|huge"
    r"|tight|compact|loose"
    r"|wide|short|long|facing|faces?|look(?:s|ing)?|point(?:s|ing)?|towards?|north|south|east"
    r"|west|open(?:s|ing)?|gap"
    r"|size|spread)\b"
)
_FRAGMENT = re.compile(rf"\b(?:as|into|a|an|now) (?:\w+ )?{_SHAPE_WORDS}\b|\b(?:on the|at the|in the) \w+")
_PREAMBLE = re.compile(
    r"^(?:(?:and|but|no|now|same|again|thing|also|just|ok|okay|please|,)(?: |$))*"
    r"(?:(?:put|move|place|set|bring|have|get|make) (?:it|them|this|that)(?: |$))?"
)


@dataclass(frozen=True)
class Revision:
    """The effect of a sentence on the last specification in a conversation.

    Attributes:
        spec: what is wanted now: the last one where nothing changes or all is refused, what is sure so far
            (for a new instruction the best reading) where there is a question.
        status: "ok", "ask" (`question` says what), "refused" (it asks for nothing) or "unchanged" (a correction
            that changes nothing; `message` says why).
        kind: "edit" for a correction, "new" for an instruction of its own.
        message: what has to be said to the speaker: why not, the question, what gave way; may be empty.
        changed: the slots in which `spec` differs from the last one.
        question: only with "ask".
        objects_text: what `select_objects` should be asked; `None` where it need not be.
        objects_how: "replace" the objects, "add" to them, "remove" from them, "exchange" some of them for others,
            "swap" (the same, unless all of these take part already: that asks for their places) or take the
            "others"; empty where they stay.
        objects_out_text: what goes, where objects are exchanged.
        objects_about: the objects that the change speaks of, where it changes none: all that take part, or it
            cannot be built; empty where it speaks of none.
        parse: what the parser said of the absolute part; `None` where there was none.
        words: the sentence's own words for objects; empty where it names none.
    """

    spec: StructureSpec
    status: str
    kind: str
    message: str = ""
    changed: tuple[str, ...] = ()
    question: Question | None = None
    objects_text: str | None = None
    objects_how: str = ""
    objects_out_text: str = ""
    objects_about: str = ""
    parse: Parse | None = None
    words: tuple[str, ...] = ()

    def with_objects_of(self, other: Revision | None) -> Revision:
        """Take over what another revision says of objects, or nothing where there is none."""
        if other is None:
            return replace(self, objects_text=None, objects_how="", objects_out_text="", objects_about="")
        return replace(
            self,
            objects_text=other.objects_text,
            objects_how=other.objects_how,
            objects_out_text=other.objects_out_text,
            objects_about=other.objects_about,
        )


def revise(
    last: StructureSpec,
    text: str,
    parser: Parser,
    viewpoint: str = "robot",
    stands: StructureSpec | None = None,
) -> Revision:
    """Interpret the next sentence of a conversation.

    Args:
        last: what was asked for before, as spoken.
        text: any string.
        parser: reads new instructions and the absolute parts of corrections.
        viewpoint: one of `grounding.viewpoint.VIEWPOINTS`: whose left and right `last` is, and the result. What
            is said of the robot ("closer to you") is turned into the words of somebody who sits across.
        stands: what the arrangement that was shown realises, in the frame of `last`: "bigger" and "turn it" start
            from it where nobody asked for a size or a heading. `None` where nothing was shown.
    """

    def read(said: str) -> Parse:
        parse = parser.parse(said)
        # `turned` leaves alone what is said of the robot, so turning it back turns just that.
        return replace(parse, spec=turned(parse).turned()) if viewpoint == "opposite" else parse

    words = mentioned(text)
    return replace(_revised(last, text, read, words, viewpoint, stands), words=words)


def _revised(
    last: StructureSpec, text: str, read: Read, named: tuple[str, ...], viewpoint: str, stands: StructureSpec | None
) -> Revision:
    """Revise as `revise` does, with the parser in the speaker's frame and the sentence's words for objects."""
    sentence = normalized(text[: _LONGEST_CORRECTION + 1])
    if len(text) > _LONGEST_CORRECTION or not sentence:
        return _new(last, text, read(text))
    edits, rest = relative_edits(sentence)
    if viewpoint == "opposite":
        edits = [edit.seen_from_across() for edit in edits]
    change = object_change(text, bool(edits), last.shape)
    if change is not None and change.how in IMPOSSIBLE:
        whole = change.how != "places" and _BUILDING.search(sentence) and read(text).spec.shape is not None
        if not whole and not (change.how == "which" and last.shape is None):
            return Revision(last, "refused", "edit", IMPOSSIBLE[change.how].format(shortened(text)))
        change = None
    corrects = change is not None and (change.how != "replace" or not _BUILDING.search(sentence))
    if not edits and not _MARKERS.search(sentence) and (named or change or _BUILDING.search(sentence)):
        parse = read(text)
        if parse.spec.shape is not None or last.shape is None or not (corrects or parse.status == "ok"):
            return _new(last, text, parse)
        if named and not corrects:
            return _new(last, text, parse)
    elif named and not _STRONG_MARKERS.search(sentence) and not _PRONOUNS.search(sentence):
        parse = read(text)
        whole = parse.spec.shape is not None and not _speaks_of(sentence)
        if whole or (not edits and parse.status == "ok" and _BUILDING.search(sentence) and not corrects):
            return _new(last, text, parse)
    return _Correction(last, text, edits, rest, change, stands).revision(read)


def _speaks_of(sentence: str) -> bool:
    """Return whether the sentence mentions the present structure: "make the circle of cups bigger"."""
    return re.search(rf"\bthe (?:\w+ )?{_SHAPE_WORDS}\b", sentence) is not None


def _new(last: StructureSpec, text: str, parse: Parse) -> Revision:
    if parse.status == "refused":
        return Revision(last, "refused", "new", parse.message, parse=parse)
    changed = changed_slots(last, parse.spec)
    return Revision(
        parse.spec, parse.status, "new", parse.message, changed, parse.question, text, "replace", parse=parse
    )


@dataclass
class _Correction:
    """A sentence that changes the last goal.

    Attributes:
        last: the goal that it changes.
        text: the sentence.
        edits: its relative changes.
        rest: the normalized sentence without their words.
        change: what it does to the objects.
        stands: what the arrangement that was shown realises.
    """

    last: StructureSpec
    text: str
    edits: list[Edit]
    rest: str
    change: ObjectChange | None
    stands: StructureSpec | None

    def revision(self, read: Read) -> Revision:
        """Apply the sentence to the goal."""
        last, edits, sentence = self.last, self.edits, normalized(self.text)
        about = ""
        if self.change is not None and self.change.how == "replace" and self._speaks_of_objects(sentence):
            about, self.change = self.change.text or "", None
        change = self.change
        how = change.how if change else ""
        if change is not None:  # what the exchange was said with ("for", "by") is not for the parser
            self.rest = relative_edits(normalized(change.rest))[1]
        parse = self._absolute(read)
        if unread := unread_words(self.text, edits, parse, _FILLERS, _ABSOLUTE):
            said = " and ".join(map(repr, unread))
            return Revision(last, "refused", "edit", NOT_UNDERSTOOD.format(said), parse=parse)
        if parse is not None and parse.status == "refused":
            if not (edits or how) or REFUSALS["idle"] not in parse.message:
                return Revision(last, "refused", "edit" if edits else "new", parse.message, parse=parse)
            parse = None
        editing = Editing(last, self.stands)
        if parse is not None:
            editing.absolute(parse)
        editing.relative(edits)
        editing.keep_ends(bool(how))
        doubt = parse.question if parse is not None and not (edits or how) else None
        question = editing.question or doubt
        changed = changed_slots(last, editing.spec)
        again = _AGAIN.search(self.rest) is not None
        if question is None and not (edits or how or parse is not None or again):
            parse = read(self.text)
            if parse.status == "refused":
                return Revision(last, "refused", "new", parse.message, parse=parse)
            question = parse.question or WHICH_SHAPE
            return Revision(last, "ask", "edit", question.text, (), question, parse=parse)
        done = changed or how or (again and not editing.notes)
        status = "ask" if question else "ok" if done else "unchanged"
        message = question.text if question else "; ".join(editing.notes)
        return Revision(
            editing.spec,
            status,
            "edit",
            message or ("" if status == "ok" else f"that is already so: {last}"),
            changed,
            question,
            change.text if change else None,
            how,
            change.out_text if change else "",
            about,
            parse,
        )

    def _speaks_of_objects(self, sentence: str) -> bool:
        """Return whether objects are named only as the subject of the change: "move the cups a bit to the left"."""
        if _STRONG_MARKERS.search(sentence) and not PLACING.search(sentence) or _OTHER_OBJECTS.search(sentence):
            return False
        if self.change is not None and (self.change.text or "").startswith(EVERYTHING):
            return False
        return bool(self.edits) or PLACING.search(sentence) is not None

    def _absolute(self, read: Read) -> Parse | None:
        """Return the parser's reading of what the relative parts leave over; `None` if nothing is left."""
        rest, edits, how = self.rest.strip(" ,"), self.edits, self.change.how if self.change else ""
        telling = _ABSOLUTE.search(rest) is not None
        if edits or how or _AGAIN.search(rest):
            telling = (telling and not _FILLERS.issuperset(rest.split())) or _FRAGMENT.search(rest) is not None
        if not telling:
            return None
        apart = edits or (self.change is not None and (how != "replace" or self.change.text == EVERYTHING))
        parse = read(rest if apart else self.text)
        retried = ("idle",) if self.change else ("idle", "relation")
        if parse.status == "ask" or any(REFUSALS[reason] in parse.message for reason in retried):
            # "facing me" alone is too little for a parser, and "it" may be one object to it.
            whole = read(f"put them {_PREAMBLE.sub('', rest)}")
            parse = whole if whole.status == "ok" else parse
        return parse

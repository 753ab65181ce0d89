"""Revise a goal of several parts by the next sentence of a conversation: change, add, drop or choose parts.

A goal of one structure with nothing but its five slots is revised as before (`grounding.dialogue.revise`), as long as the
sentence asks for nothing that only a goal of several parts can hold. Everything is as spoken: left is the speaker's left.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from grounding.dialogue.goal_changes import added, listed, numbered, objects_of, renumbered, with_part, without_parts
from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.part_drops import dropped
from grounding.dialogue.part_lengths import AlreadySoError, CannotApplyError
from grounding.dialogue.part_swaps import swapped
from grounding.dialogue.relation_edits import relation_change
from grounding.dialogue.relative_edits import normalized, relative_edits
from grounding.dialogue.revise import REVISION_STATUSES, Revision
from grounding.dialogue.scene_reader import GoalReader, SpokenReading
from grounding.dialogue.structure_edits import structure_change
from grounding.goal_reading.goal_words import VERBS
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, PartReference, RelationPart, StructurePart
from grounding.parse_result import OBJECT, OPEN, Question, shortened
from grounding.references.attributes import SceneObject
from grounding.spec import SLOTS, SpecError, StructureSpec

PART = "part"  # what a question about which part is meant asks for, in place of a slot
_LONGEST_CORRECTION = 400  # characters; what is longer is an instruction of its own
_ADDING = re.compile(
    r"^(?:(?:ok|okay|good|great|nice|fine|now|so|well|please|thanks|yes)[ ,]+)*"
    r"(?:and(?: then| also| after that| now)?|then(?: also)?|also|additionally|next|after (?:that|this)|afterwards?|plus|besides"
    r"(?: that)?|furthermore|moreover|on top of that|in addition|as well as that|when (?:that|this) is done|now also)[ ,]+"
)
_ADDED = re.compile(r"[ ,]+(?:too|as well|also|in addition|on top of that|afterwards|after that)$")
_REPLACING = re.compile(r"\b(?:instead|rather|i meant?|i said)\b|^(?:no|nope|not|actually|sorry|wait|hmm?|but)\b[ ,]")
_ALONE_INSTEAD = re.compile(
    r"[ ,]*\b(?:instead|rather)\b[ ,]*|^(?:(?:no|nope|actually|sorry|wait|hmm?|but|i meant?|i said)\b[ ,]+)+"
)
_OF_WHAT_IS_THERE = re.compile(
    r"\b(?:it|its|them|they|their|that|this one|that one|other side|other way|opposite|swap sides|back)\b"
)
_OTHER = re.compile(r"\b(?:other|opposite) (?:side|end|way|direction)\b")
_THEM = re.compile(r"\b(?:them|these|those)\b", re.IGNORECASE)
_ALL_THERE = re.compile(r"\b(?:everything|all|rest|others?|remaining|objects|things|items)\b", re.IGNORECASE)
_PRONOUN = re.compile(r"\b(?:it|them|they|that)\b")
_DROP_IT = re.compile(
    r"(?:(?:no|ok|okay|actually|please|just|now|then)[ ,]+)*(?:drop|remove|delete|lose|ditch|skip|scrap|leave out)"
    r"(?: (?:it|that|this|that one|this one|one(?: of (?:them|these|those))?))?"
)
_QUOTED = re.compile(r"'(?P<phrase>[^']+)' can be each of")


@dataclass(frozen=True)
class GoalRevision:
    """The effect of a sentence on the last goal in a conversation.

    Attributes:
        goal: what is wanted now: the last goal where nothing changes or all is refused, or where there is a question.
        status: "ok", "ask" (`question` says what), "refused" or "unchanged" (`message` says why).
        kind: "edit" for a correction, "add" where parts were added, "new" for an instruction of its own.
        message: what has to be said: why not, the question, which part was meant; may be empty.
        changed: the numbers of the parts of `goal` that are new or other than before.
        dropped: the numbers of the parts of the last goal that are gone.
        question: only with "ask"; its slot is `PART`, `OBJECT` or a slot of a structure.
        choices: for each option of the question the goal that it leads to, or the text to say in place of the sentence.
        plain: the revision of one structure, where that says it all; the goal is then the last one.
        read: the interpretation of a new instruction, or of the parts that were added; `None` for a correction.
    """

    goal: Goal
    status: str
    kind: str = "edit"
    message: str = ""
    changed: tuple[int, ...] = ()
    dropped: tuple[int, ...] = ()
    question: Question | None = None
    choices: tuple[Goal | str, ...] = field(default=())
    plain: Revision | None = None
    read: SpokenReading | None = None

    def __post_init__(self) -> None:
        if self.status not in REVISION_STATUSES:
            raise ValueError(f"status cannot be {self.status!r}; legal values: {', '.join(REVISION_STATUSES)}")


def revise_goal(
    last: Goal,
    text: str,
    reader: GoalReader,
    objects: Sequence[SceneObject | str | None],
    *,
    encoder: object = None,
    stands: Sequence[StructureSpec | None] = (),
    built: bool = False,
) -> GoalRevision:
    """Interpret the next sentence of a conversation about a goal.

    Args:
        last: what was asked for before, as spoken; empty before the first instruction. Its objects are indices.
        text: any string.
        reader: reads new instructions, and the absolute parts of corrections.
        objects: of the scene, as `grounding.references.selection.select_objects` takes them.
        encoder: finds what unknown nouns mean.
        stands: for each part what the arrangement that was shown realises of it; may be shorter than the parts.
        built: whether the last goal stands on the table: a move then goes on from where it ended.
    """
    said = GoalText(text[: _LONGEST_CORRECTION + 1], last, objects, encoder)  # type: ignore[arg-type]
    spec = last.plain_spec if last.parts else StructureSpec()
    if spec is not None:
        return _of_plain(last, spec, text, said, reader, stands, built)
    if len(text) > _LONGEST_CORRECTION:
        return _new(last, reader.read(text))
    return _Correction(last, text, said, reader, stands, built).revision()


def _of_plain(
    last: Goal, spec: StructureSpec, text: str, said: GoalText, reader: GoalReader,
    stands: Sequence[StructureSpec | None], built: bool,
) -> GoalRevision:  # fmt: skip
    """Revise a goal of one plain structure, or none: as before, unless the sentence asks for more than that can hold."""
    plain = reader.revise(spec, text, stands[0] if stands else None)
    whole = GoalRevision(last, plain.status, plain.kind, plain.message, plain=plain)
    if len(text) <= _LONGEST_CORRECTION and last.parts:
        extended = _Correction(last, text, said, reader, stands, built).of_plain(plain)
        if extended is not None:
            return extended
    correction = _Correction(last, text, said, reader, stands, built)
    read = correction.read(text)
    if read.goal.parts and read.goal.plain_spec is None:
        return correction.anew(read)
    # What the reader of goals says of it is in none of the words of the parser of five slots.
    own_words = plain.status == "refused" and read.message != read.parse.message
    whole_sentence = plain.kind == "new" or not last.parts
    counts = (whole_sentence and (read.beyond or own_words)) or (own_words and read.status == "ask")
    if read.status != "ok" and counts:
        return _new(last, read, text)
    return whole


def _new(last: Goal, read: SpokenReading, text: str = "") -> GoalRevision:
    """Return the revision that an instruction of its own is."""
    if read.status == "ok" and read.goal.parts:
        return GoalRevision(read.goal, "ok", "new", read.message, tuple(range(len(read.goal.parts))), read=read)
    if read.status == "ask" and read.question is not None:
        return GoalRevision(
            last,
            "ask",
            "new",
            read.question.text,
            question=read.question,
            choices=_texts(read.question, text),
            read=read,
        )
    return GoalRevision(last, "refused", "new", read.message, read=read)


def _texts(question: Question, text: str) -> tuple[str, ...]:
    """Return what to say in place of the sentence for each answer to a question about an object; else nothing."""
    found = _QUOTED.search(question.text)
    if question.slot != OBJECT or found is None or found["phrase"].lower() not in text.lower():
        return ()
    pattern = re.compile(rf"(?:\b(?:an?|the|one) )?{re.escape(found['phrase'])}", re.IGNORECASE)
    return tuple(pattern.sub(lambda _, name=option: f"the {name}", text, count=1) for option in question.options)


class _Correction:
    """A sentence that may change a goal; as `revise_goal`."""

    def __init__(
        self,
        last: Goal,
        text: str,
        said: GoalText,
        reader: GoalReader,
        stands: Sequence[StructureSpec | None],
        built: bool,
    ) -> None:
        self.last, self.text, self.said, self.reader = last, text, said, reader
        self.stands, self.built = stands, built

    def of_plain(self, plain: Revision) -> GoalRevision | None:
        """Return what a sentence adds to one plain structure, or changes in it beyond its slots; `None` for nothing."""
        if self._adds():
            sum_ = self._addition()
            if sum_ is not None and sum_.status == "ok" and sum_.goal.plain_spec is None:
                return sum_
        if plain.status == "refused" and not self._is_new():
            edit = self._edited()
            if edit is not None and edit.status in ("ok", "ask"):
                return edit
        return None

    def read(self, text: str) -> SpokenReading:
        """Read a whole instruction, in which "them" are the objects that were spoken of last, not everything."""
        read = self.reader.read(text)
        them = _THEM.search(text)
        everything = any(part.objects is None for part in read.goal.structures)
        if them is None or not everything or not self.last.parts or _ALL_THERE.search(text):
            return read
        spoken = next(iter(reversed(self.last.structures)), self.last.parts[-1])
        names = [f"the {self.said.names[index]}" for index in objects_of(self.last, spoken.objects)]
        if not names:
            return read
        listing = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        return self.reader.read(f"{text[: them.start()]}{listing}{text[them.end() :]}")

    def _is_new(self) -> bool:
        """Return whether the sentence is an instruction of its own: it names its objects, and speaks of nothing else."""
        return not self._corrects() and bool(self.said.mentions)

    def revision(self) -> GoalRevision:
        """Return the effect on a goal of several parts."""
        if _DROP_IT.fullmatch(self.said.said):
            return self._which_is_dropped() if len(self.last.parts) > 1 else self._nothing_left()
        try:
            if (less := dropped(self.said)) is not None:
                return self._dropped(*less)
        except CannotApplyError as error:
            return GoalRevision(self.last, "refused", message=str(error))
        except GoalError as error:
            return GoalRevision(self.last, "refused", message=f"that cannot be dropped: {error}")
        if self._adds():
            more = self._addition()
            answerable = more is not None and (more.status == "ok" or (more.status == "ask" and bool(more.choices)))
            if more is not None and (answerable or (more.read is not None and more.read.status == "ok")):
                return more
            edit = self._edited()
            return edit if edit is not None and edit.status != "refused" else more or edit or self._refused(None)
        corrects = self._corrects()
        edit = self._edited() if corrects else None
        if edit is not None and edit.status != "refused":
            return edit
        read = self.read(self._without_marker())
        if read.status == "ok" and read.goal.parts and (not corrects or self._whole(read)):
            replaced = self._merged(read.goal) or self._replaced(read)
            if replaced is not None:
                return replaced
            return self._which_is_replaced(read) if _REPLACING.search(self.said.said) else self.anew(read)
        if read.status == "ask" and read.question is not None and not corrects:
            return _new(self.last, read, self.text)
        edit = edit or self._edited()
        if edit is not None and (edit.status != "refused" or corrects):
            return edit
        return self._refused(read)

    # What kind of sentence it is

    def _adds(self) -> bool:
        return _ADDING.match(self.said.said) is not None or _ADDED.search(self.said.said) is not None

    def _corrects(self) -> bool:
        """Return whether the sentence speaks of what was asked for before."""
        said = self.said
        edits = relative_edits(normalized(said.said))[0]
        return bool(
            said.parts or edits or _OF_WHAT_IS_THERE.search(said.said) or _REPLACING.search(said.said)
            or re.match(r"(?:swap|switch|reverse|make|with|without|bigger|smaller|gaps?|space)\b", said.said)
            or not (said.mentions or self._orders())
        )  # fmt: skip

    def _whole(self, read: SpokenReading) -> bool:
        """Return whether a sentence that sounds like a correction is an instruction of its own after all."""
        said = self.said
        if said.parts or _OTHER.search(said.said) or relative_edits(normalized(said.said))[0]:
            return False
        if read.goal.plain_spec is None:
            return bool(read.goal.named_objects())
        return any(one.indices for one in said.mentions) and self._orders()

    def _orders(self) -> bool:
        """Return whether the sentence has a verb that asks for something."""
        return any(VERBS.get(word, "leave") != "leave" for word in self.said.said.split())

    def _without_marker(self) -> str:
        return _ALONE_INSTEAD.sub(" ", self.said.said).strip(" ,") if _REPLACING.search(self.said.said) else self.text

    def _refused(self, read: SpokenReading | None) -> GoalRevision:
        message = read.message if read is not None else ""
        said = f"{shortened(self.text)!r} was not understood as a correction"
        if not message or message == said:
            message = f"{said}; the goal is: {listed(self.last, self.said.names)}"
        return GoalRevision(self.last, "refused", message=message, read=read)

    # Dropping and adding

    def _nothing_left(self) -> GoalRevision:
        return GoalRevision(self.last, "refused", message="nothing would be left of the goal; “clear” drops it")

    def _which_is_dropped(self) -> GoalRevision:
        options, choices = [], []
        for number in range(len(self.last.parts)):
            fewer, _ = without_parts(self.last, [number])
            if fewer.parts:
                options.append(numbered(self.last, number, self.said.names))
                choices.append(fewer)
        question = Question(PART, f"which part should be dropped: {'; '.join(options)}?", tuple(options))
        return GoalRevision(self.last, "ask", "edit", question.text, question=question, choices=tuple(choices))

    def _dropped(self, goal: Goal, gone: frozenset[int]) -> GoalRevision:
        if len(gone) == len(goal.parts):
            return self._nothing_left()
        fewer, all_gone = without_parts(goal, gone)
        names, notes = self.said.names, []
        if also := [number for number in all_gone if number not in gone]:
            notes.append(f"{', '.join(numbered(self.last, n, names) for n in also)} spoke of it, and is dropped too")
        if not fewer.parts:
            return self._nothing_left()
        changed = tuple(n for n, part in enumerate(fewer.parts) if part not in self.last.parts)
        changed = tuple(n for n in changed if not all_gone or self._other(fewer, n))
        return GoalRevision(fewer, "ok", "edit", "; ".join(notes), changed, tuple(all_gone))

    def _other(self, goal: Goal, number: int) -> bool:
        """Return whether a part differs from all of the last goal in more than the numbers of the parts it speaks of."""
        part = goal.parts[number]
        return all(
            objects_of(goal, part.objects) != objects_of(self.last, other.objects) or type(part) is not type(other)
            for other in self.last.parts
        )

    def _addition(self) -> GoalRevision | None:
        """Return the goal with the parts that a sentence such as "then put the apple on the plate" adds."""
        rest = _ADDED.sub("", _ADDING.sub("", self.said.said)).strip(" ,")
        parts_said = GoalText(rest, self.last, self.said.objects, self.said.encoder).parts
        if parts_said or _PRONOUN.search(rest):
            goal = self._read_after(rest)
            if goal is None:
                return None
            return GoalRevision(goal, "ok", "add", "", tuple(range(len(self.last.parts), len(goal.parts))))
        read = self.reader.read(rest)
        if read.status != "ok" or not read.goal.parts:
            found = _new(self.last, read, rest)
            return replace(found, kind="add", choices=tuple(f"also {text}" for text in found.choices))
        new = read.goal
        if any(part.objects is None for part in new.structures) and not _ALL_THERE.search(rest):
            return None  # "and a bit to the left" is said of a part that is there
        merged = self._merged(new)
        if merged is not None:
            return merged
        try:
            goal = added(self.last, new)
        except GoalError as error:
            message = f"that cannot be added: {error}; say “instead” to replace a part"
            return GoalRevision(self.last, "refused", "add", message, read=read)
        if twice := self._placed_twice(new):
            where = numbered(self.last, twice[1], self.said.names)
            message = f"{self.said.names[twice[0]]} has a place already, in {where}; say “instead” to replace that"
            return GoalRevision(self.last, "refused", "add", message, read=read)
        numbers = tuple(range(len(self.last.parts), len(goal.parts)))
        return GoalRevision(goal, "ok", "add", read.message, numbers, read=read)

    def _merged(self, new: Goal) -> GoalRevision | None:
        """Return the goal with slots for a structure that is there already: "and put the cups on the right"."""
        part = new.parts[0]
        if len(new.parts) != 1 or not isinstance(part, StructurePart) or part.shape is not None or part.objects is None:
            return None
        for number, other in enumerate(self.last.parts):
            if isinstance(other, StructurePart) and set(objects_of(self.last, other.objects)) == set(part.objects):
                values = {slot: value for slot in SLOTS if (value := getattr(part, slot)) is not None}
                try:
                    return GoalRevision(with_part(self.last, number, replace(other, **values)), "ok", changed=(number,))
                except SpecError as error:
                    return GoalRevision(self.last, "refused", message=str(error))
        return None

    def _placed_twice(self, new: Goal) -> tuple[int, int] | None:
        """Return an object that both goals carry somewhere, and the part that does so already."""
        carrying = ("on", "in", "at", "moved", "swapped")
        for part in new.parts:
            if not isinstance(part, RelationPart) or part.relation not in carrying:
                continue
            for number, other in enumerate(self.last.parts):
                shared = set(objects_of(new, part.objects)) & set(objects_of(self.last, other.objects))
                if shared and isinstance(other, RelationPart) and other.relation in carrying:
                    return min(shared), number
        return None

    def _read_after(self, rest: str) -> Goal | None:
        """Read a sentence whose "it" or "the circle" is a part of the last goal: behind a sentence that asks for that part.

        Returns:
            The last goal with the parts that the sentence adds; `None` where it cannot be read so.
        """
        for number in self._antecedents(rest):
            said = _sentence(self.last, number, self.said.names)
            if said is None:
                continue
            read = self.reader.read(f"{said}, then {rest}")
            if read.status != "ok" or len(read.goal.parts) < 2 or not self._same(read.goal, number):
                continue
            place = {0: number} | {n: len(self.last.parts) - 1 + n for n in range(1, len(read.goal.parts))}
            try:
                return Goal((*self.last.parts, *(renumbered(part, place) for part in read.goal.parts[1:])))
            except GoalError:
                continue
        return None

    def _antecedents(self, rest: str) -> list[int]:
        """Return the parts that "it" may be, the likeliest first: the one that is named, otherwise the last ones."""
        named = [n for one in GoalText(rest, self.last, self.said.objects).parts for n in one.numbers]
        return named or list(reversed(range(len(self.last.parts))))

    def _same(self, goal: Goal, number: int) -> bool:
        """Return whether the first part of a goal has the kind and the objects of a part of the last goal."""
        mine, read = self.last.parts[number], goal.parts[0]
        return type(read) is type(mine) and set(objects_of(goal, read.objects)) == set(
            objects_of(self.last, mine.objects)
        )

    def anew(self, read: SpokenReading) -> GoalRevision:
        """Return an instruction that takes the place of the whole goal, and say so."""
        new = _new(self.last, read, self.text)
        if self.built or new.status != "ok" or not self.last.parts:
            return new
        note = f"this takes the place of {listed(self.last, self.said.names)}; “also …” adds to it"
        return replace(new, message="; ".join(filter(None, (new.message, note))))

    def _replaced(self, read: SpokenReading) -> GoalRevision | None:
        """Put parts in the place of those that move the same objects: "put the apple in the bowl instead".

        Returns:
            The goal; `None` where a part moves others.
        """
        goal, changed = self.last, []
        for part in read.goal.parts:
            own = set(objects_of(read.goal, part.objects))
            same = [n for n, other in enumerate(self.last.parts) if set(objects_of(self.last, other.objects)) == own]
            if len(same) != 1 or any(isinstance(each, PartReference) for each in _ends(part)):
                return None
            goal = with_part(goal, same[0], part)
            changed.append(same[0])
        if len(goal.parts) == 1:
            return None
        return GoalRevision(goal, "ok", "edit", read.message, tuple(changed), read=read)

    def _which_is_replaced(self, read: SpokenReading) -> GoalRevision:
        """Ask which part an instruction with "instead" replaces; there is nothing to ask where there is one part."""
        if len(self.last.parts) == 1:
            return _new(self.last, read, self.text)
        options, choices = [], list[Goal | str]()
        for number in range(len(self.last.parts)):
            fewer, gone = without_parts(self.last, [number])
            try:
                choices.append(added(fewer, read.goal))
            except GoalError:
                continue
            options.append(numbered(self.last, number, self.said.names))
        options, choices = [*options, "all of it"], [*choices, read.goal]
        question = Question(PART, f"which part should it replace: {'; '.join(options)}?", tuple(options))
        return GoalRevision(self.last, "ask", "edit", question.text, question=question, choices=tuple(choices))

    # Changing parts

    def _edited(self) -> GoalRevision | None:
        """Return the goal with the change of the part that the sentence speaks of; `None` where it changes none."""
        pieces = self._pieces()
        if len(pieces) < 2:
            return self._edited_by(self.said)
        goal, changed, notes = self.last, list[int](), list[str]()
        for piece in pieces:
            step = _Correction(goal, piece, GoalText(piece, goal, self.said.objects, self.said.encoder), self.reader,
                               self.stands, self.built)._edited_by_text()  # fmt: skip
            if step is None or step.status != "ok":
                return self._edited_by(self.said)
            goal, notes = step.goal, [*notes, step.message]
            changed += step.changed
        return GoalRevision(goal, "ok", "edit", "; ".join(filter(None, notes)), tuple(dict.fromkeys(changed)))

    def _edited_by_text(self) -> GoalRevision | None:
        return self._edited_by(self.said)

    def _pieces(self) -> list[str]:
        """Divide a sentence that says something of several parts: "circle on the left, tower on the right"."""
        pieces = [piece for piece in re.split(r" *[,;] *(?:and |but )?| (?:and|but) ", self.said.said) if piece]
        about = [GoalText(piece, self.last, self.said.objects, self.said.encoder).targets() for piece in pieces]
        distinct = len(pieces) > 1 and all(about) and len({targets for targets in about}) == len(pieces)
        return pieces if distinct and all(len(piece.split()) > 2 for piece in pieces) else [self.said.said]

    def _edited_by(self, said: GoalText) -> GoalRevision | None:
        try:
            exchange = swapped(said)
        except CannotApplyError as error:
            return GoalRevision(self.last, "refused", message=str(error))
        if exchange is not None:
            changed = tuple(n for n, part in enumerate(exchange.parts) if part != self.last.parts[n])
            return GoalRevision(exchange, "ok", "edit", "", changed)
        if missing := [one for one in said.parts if not one.numbers]:
            words = re.sub(r"^(?:the|that|this) ", "", missing[0].words)
            return GoalRevision(
                self.last, "refused", message=f"the goal has no {words!r}; it is: {listed(self.last, said.names)}"
            )
        targets = said.targets()
        numbers = targets if targets is not None else tuple(range(len(self.last.parts)))
        applied, asked, reasons, failed, already = [], [], [], [], []
        for number in numbers:
            try:
                change = self._change_of(number, said)
            except (CannotApplyError, SpecError) as error:
                reasons.append(f"{numbered(self.last, number, said.names)}: {error}")
                failed.append(number)
                already += [number] if isinstance(error, AlreadySoError) else []
                continue
            if change is None:
                failed.append(number)
            else:
                (asked if change[2] is not None else applied).append((number, *change))
        every = targets is not None and any(len(one.numbers) > 1 and re.match(r"part|both|all|each|every", one.words)
                                            for one in said.parts)  # fmt: skip
        if every and len(applied) == len(numbers):
            return self._all_of(applied)
        if len(applied) + len(asked) > 1 or (applied and already):
            return self._which(applied, [number for number, *_ in asked], already)
        if every and failed:
            applied, asked = [], []
        if asked:
            return self._ask_slot(*asked[0][:2], asked[0][2], asked[0][3])
        if applied:
            number, goal, note, _ = applied[0]
            return GoalRevision(goal, "ok", "edit", note, (number,))
        if reasons:
            return GoalRevision(self.last, "refused", message="; ".join(reasons))
        return None

    def _change_of(self, number: int, said: GoalText) -> tuple[Goal, str, Question | None] | None:
        """Return the goal with a change of one part, what must be said, and what must be asked."""
        part = self.last.parts[number]
        if isinstance(part, RelationPart):
            changed = relation_change(part, number, said, self.built)
            return None if changed is None else (with_part(self.last, number, changed), "", None)
        stands = self.stands[number] if number < len(self.stands) else None
        change = structure_change(number, said, self.reader, stands)
        if change is None:
            return None
        return with_part(self.last, number, change.part), change.notes, change.question

    def _all_of(self, applied: Sequence[tuple[int, Goal, str, Question | None]]) -> GoalRevision:
        goal = self.last
        for number, changed, _, _ in applied:
            goal = with_part(goal, number, changed.parts[number])
        notes = "; ".join(filter(None, (note for _, _, note, _ in applied)))
        return GoalRevision(goal, "ok", "edit", notes, tuple(number for number, *_ in applied))

    def _which(
        self, applied: Sequence[tuple[int, Goal, str, Question | None]], asked: Sequence[int], already: Sequence[int]
    ) -> GoalRevision:
        """Ask which part a change is meant for; an answer leads to the goal, or to the sentence with the part named."""
        options = [numbered(self.last, number, self.said.names) for number, *_ in applied]
        choices: list[Goal | str] = [goal for _, goal, _, _ in applied]
        for number in asked:
            options.append(numbered(self.last, number, self.said.names))
            choices.append(f"{self.said.said} (part {number + 1})")
        for number in already:
            options.append(f"{numbered(self.last, number, self.said.names)}, where it changes nothing")
            choices.append(self.last)
        if not asked and len(applied) > 1:
            with suppress(GoalError):  # one object cannot join both
                choices.append(self._all_of(applied).goal)
                options.append("both" if len(applied) == 2 else "all of them")
        question = Question(PART, f"which part is meant: {'; '.join(options)}?", tuple(options))
        return GoalRevision(self.last, "ask", "edit", question.text, question=question, choices=tuple(choices))

    def _ask_slot(self, number: int, goal: Goal, note: str, question: Question | None) -> GoalRevision:
        assert question is not None  # the caller has looked
        part = goal.parts[number]
        choices: list[Goal | str] = []
        for option in question.options:
            try:
                value = None if option == OPEN else option
                choices.append(with_part(self.last, number, replace(part, **{question.slot: value})))
            except (SpecError, TypeError):
                return GoalRevision(self.last, "refused", message=question.text)
        named = Question(
            question.slot, f"{numbered(self.last, number, self.said.names)}: {question.text}", question.options
        )
        return GoalRevision(self.last, "ask", "edit", named.text, question=named, choices=tuple(choices))


def _ends(part: StructurePart | RelationPart) -> tuple[object, ...]:
    return (part.objects, part.reference) if isinstance(part, RelationPart) else (part.objects,)


def _sentence(goal: Goal, number: int, names: Sequence[str]) -> str | None:
    """Return an instruction that asks for a part, as far as "it" needs to know; `None` where it cannot be said so."""
    part = goal.parts[number]

    def said(indices: Sequence[int]) -> str:
        listed_names = [f"the {names[index]}" for index in indices]
        return " and ".join(filter(None, (", ".join(listed_names[:-1]), listed_names[-1])))

    own = objects_of(goal, part.objects)
    if not own:
        return None
    if isinstance(part, StructurePart):
        return None if part.shape is None else f"put {said(own)} in a {part.shape}"
    reference = objects_of(goal, part.reference)
    return f"put {said(own)} {part.relation} {said(reference)}" if reference else None

"""Change a structure among the parts of a goal: its slots, its objects, its lengths and its order."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields, replace

from grounding.dialogue.edge_edits import along_another_edge
from grounding.dialogue.goal_changes import objects_of
from grounding.dialogue.goal_mentions import SHAPE_OF_NOUN, GoalText, Span
from grounding.dialogue.order_edits import extreme_at_an_end
from grounding.dialogue.part_lengths import AlreadySoError, CannotApplyError, has_metric_size, length_change
from grounding.dialogue.relation_edits import FILLERS
from grounding.dialogue.revise import Revision
from grounding.dialogue.scene_reader import GoalReader
from grounding.dialogue.slot_edits import loses_direction
from grounding.goals.parts import KEYS, OPPOSITE_ENDS, SHAPES_OF_KEY, Order, StructurePart
from grounding.parse_result import Question
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import FIRST_SHAPES, SLOTS, SLOTS_OF_SHAPE, StructureSpec

_RELATED = re.compile(
    r"\b(?:(?:to the |on the )?(?:left|right) of|next to|beside|behind|in front of|on top of|between"
    r"|inside)\b(?! the table)"
)
# Of shapes that the parser of slots does not read in corrections.
_OTHER_NOUNS = sorted(
    (noun for noun, shape in SHAPE_OF_NOUN.items() if shape not in FIRST_SHAPES), key=len, reverse=True
)
_SIZES = {"small": "small", "tight": "small", "medium": "medium", "large": "large", "big": "large", "wide": "large"}
_AS_SHAPE = re.compile(
    r"(?:(?:no|now|ok|okay|actually|please|then|but|and|so|rather|i want|i'd like|make|turn|change|put|arrange|form|do"
    r"|have|build|as"
    r"|it|them|that|this|into|to|in|from)[ ,]+)*an? (?:(?P<size>small|tight|medium|large|big|wide) )?"
    rf"(?P<noun>{'|'.join(map(re.escape, _OTHER_NOUNS))})(?: (?:shape|formation))?"
    r"(?:[ ,]+(?:instead|please|now|then|rather|of (?:it|them)|out of (?:it|them)))*"
)
# A number that is no angle, no count of rows and no degree of more.
_NUMBER = re.compile(
    r"(?<![\w.])\d[\d.]*+(?! ?(?:degrees?|deg|°|by|x|rows?|columns?|times|quarters?|more|fewer|less"
    r"|objects?)\b)(?: \w+)?"
)
_REVERSED = re.compile(
    r"\b(?:(?:reverse|flip|invert|turn (?:a)?round)(?: (?:the|its|their))? order"
    r"|(?:in )?(?:the )?(?:reverse[d]?|opposite|other) order"
    r"|(?:the )?other way (?:a)?round|reverse (?:it|them|that)|^reversed?(?= please$|$))\b"
)
_BACKWARDS = {"ascending": "descending", "descending": "ascending"}


@dataclass(frozen=True)
class StructureChange:
    """What a correction makes of a structure.

    Attributes:
        part: the structure as it is wanted now.
        notes: what has to be said.
        question: what has to be known before, with a slot of the structure.
    """

    part: StructurePart
    notes: str = ""
    question: Question | None = None


def structure_change(
    number: int, text: GoalText, reader: GoalReader, stands: StructureSpec | None = None
) -> StructureChange | None:
    """Apply a correction to a structure of a goal.

    Args:
        number: of the structure.
        text: the correction, about the whole goal.
        reader: reads the absolute parts of it.
        stands: what the arrangement that was shown realises of the structure; `None` where that is not known.

    Returns:
        The change, or `None` where the text says nothing that the structure can take.

    Raises:
        CannotApplyError: where it says what this structure cannot take.
        GoalError: where the result is not legal.
    """
    part = text.goal.parts[number]
    assert isinstance(part, StructurePart)  # the caller has looked
    spans: list[Span] = [one.span for one in text.parts if number in one.numbers]
    own = set(objects_of(text.goal, part.objects))
    subjects = [said.span for said in text.mentions if said.indices and set(said.indices) <= own]
    if part.order is not None and (match := _REVERSED.search(text.said)):
        if left := text.left_over([*spans, *subjects, match.span()], FILLERS):
            raise CannotApplyError(f"{' '.join(left)!r} was not understood")
        return StructureChange(replace(part, order=_reversed(part.order)))
    if (ordered := extreme_at_an_end(part, text.said)) is not None:
        return StructureChange(ordered)
    if (moved := along_another_edge(part, text, [*spans, *subjects])) is not None:
        return StructureChange(moved)
    trouble: CannotApplyError | None = None
    try:
        by_length = length_change(part, text, spans)
    except CannotApplyError as error:
        by_length, trouble = None, error
    if by_length is not None and not text.left_over([*spans, *subjects], FILLERS):
        return _sized_by_length(by_length)  # type: ignore[arg-type]
    said = _about_it(text, number)
    if _RELATED.search(said):
        return None
    known = [*spans, *(one.span for one in (*text.parts, *text.mentions))]
    for match in _NUMBER.finditer(text.said):
        if not any(first <= match.start() < end for first, end in known):
            raise CannotApplyError(f"{match.group()!r} was not understood")
    if (shaped := _with_another_shape(part, said)) is not None:
        return shaped
    revision = reader.revise(part.spec, said, stands)
    if revision.kind == "edit" and revision.status in ("ok", "ask"):
        return _revised(part, revision, text, own)
    if revision.status == "unchanged" and trouble is None:
        raise (AlreadySoError if "already" in revision.message else CannotApplyError)(revision.message)
    if composed := _composed(part, said, text, reader):
        return StructureChange(composed)
    if trouble is not None:
        raise trouble
    if by_length is not None:
        raise CannotApplyError(f"{' '.join(text.left_over([*spans, *subjects], FILLERS))!r} was not understood")
    return None


def _with_another_shape(part: StructurePart, said: str) -> StructureChange | None:
    """Return the structure in a shape that the parser of slots was not taught: "now a triangle", "make it a square"."""
    match = _AS_SHAPE.fullmatch(said)
    if match is None or (shape := SHAPE_OF_NOUN[match["noun"]]) == part.shape:
        return None
    values = {"size": _SIZES[match["size"]]} if match["size"] else {}
    lost = [slot for slot in SLOTS[1:] if getattr(part, slot) is not None and slot not in SLOTS_OF_SHAPE[shape]]
    lost += [key for key in part.keys if shape not in SHAPES_OF_KEY[key]]
    if part.rotation is not None and loses_direction(part.shape, shape) and "rotation" not in lost:
        lost.append("rotation")
    notes = f"a {shape} has no {' and no '.join(lost)}: dropped" if lost else ""
    return StructureChange(replace(part, **(dict.fromkeys(lost) | {"shape": shape} | values)), notes)


def _sized_by_length(part: StructurePart) -> StructureChange:
    """Return a structure with a new length, which says how large it is in place of its size."""
    if part.size is None:
        return StructureChange(part)
    note = f"its {has_metric_size(part)} says how large it is now, in place of the size {part.size}"
    return StructureChange(replace(part, size=None), note)


def _about_it(text: GoalText, number: int) -> str:
    """Return the sentence with "it" in the place of the words for the part, so that it speaks of one structure."""
    said = text.said
    for one in reversed(text.parts):
        if number in one.numbers:
            said = f"{said[: one.span[0]]}it{said[one.span[1] :]}"
    return " ".join(said.split())


def _reversed(order: Order) -> Order:
    if order.direction is not None:
        return replace(order, direction=_BACKWARDS[order.direction])
    return replace(order, start=OPPOSITE_ENDS[order.start] if order.start else "right")


def _revised(part: StructurePart, revision: Revision, text: GoalText, own: set[int]) -> StructureChange | None:
    """Return the structure with the slots and the objects of a revision of one structure."""
    spec, notes = revision.spec, [revision.message]
    metric = has_metric_size(part)
    if metric and spec.size != part.size and spec.size is not None:
        raise CannotApplyError(f"its {metric} is {100 * getattr(part, metric):.4g} cm: say the new one in centimetres")
    lost = [key for key in part.keys if spec.shape not in SHAPES_OF_KEY[key]]
    if lost:
        notes.append(f"a {spec.shape or 'structure without a shape'} has no {' and no '.join(lost)}: dropped")
    values = {slot: getattr(spec, slot) for slot in SLOTS} | dict.fromkeys(lost)
    objects = _objects_then(part, revision, text, own)
    if revision.objects_about and not own <= set(_selected(text, revision.objects_about)):
        raise CannotApplyError(
            f"{revision.objects_about!r} are not all of its objects, and only the whole structure can be changed"
        )
    question = revision.question if revision.status == "ask" else None
    changed = replace(part, **values, objects=objects)
    if changed == part and question is None:
        return None
    return StructureChange(changed, "; ".join(filter(None, notes)) if question is None else "", question)


def revised_structure(part: StructurePart, revision: Revision, text: GoalText) -> StructurePart | None:
    """Return a structure after a revision of it; `None` if it stays the same.

    Raises:
        CannotApplyError: if the structure cannot be changed in this way.
    """
    own = set(range(len(text.objects)) if part.objects is None else objects_of(text.goal, part.objects))
    change = _revised(replace(part, objects=tuple(sorted(own))), revision, text, own)
    return None if change is None else change.part


def _objects_then(part: StructurePart, revision: Revision, text: GoalText, own: set[int]) -> tuple[int, ...] | None:
    """Return the objects of the structure after a revision that may add, remove or exchange some."""
    before = objects_of(text.goal, part.objects)
    how = revision.objects_how
    if not how:
        return part.objects  # type: ignore[return-value]
    if part.objects is None and how in ("add", "remove", "exchange", "swap"):
        raise CannotApplyError("it takes all objects that no other part names; say which ones it should take")
    comes = (
        [] if how == "remove" else _selected(text, revision.objects_text or "", outside=own if how == "add" else None)
    )
    if how == "others":
        raise CannotApplyError("say which objects it should take")
    if how == "replace":
        return tuple(comes)
    gone = _selected(text, revision.objects_text or "", inside=own) if how == "remove" else []
    if how in ("exchange", "swap"):
        gone = _selected(text, revision.objects_out_text, inside=own)
    if how == "add" and set(comes) <= own:
        raise CannotApplyError(f"{', '.join(text.names[index] for index in comes)}: in it already")
    place = next((place for place, index in enumerate(before) if index in gone), len(before))  # what comes stands there
    place = place if how in ("exchange", "swap") else len(before)
    kept = [index for index in before[:place] if index not in gone], [index for index in before[place:] if index not in gone]
    return tuple(dict.fromkeys((*kept[0], *comes, *kept[1])))


def _selected(text: GoalText, words: str, inside: set[int] | None = None, outside: set[int] | None = None) -> list[int]:
    """Return the objects that some words choose, among all, those of the structure, or first those that are in none."""
    pools = [sorted(inside)] if inside is not None else [list(range(len(text.names)))]
    if outside:
        pools.insert(0, [index for index in range(len(text.names)) if index not in outside])
    for last, pool in zip((*[False] * (len(pools) - 1), True), pools, strict=True):
        try:
            found = select_objects(f"put {words}", [text.objects[index] for index in pool], text.encoder)
            return [pool[index] for index in found.indices]
        except SelectionError as error:
            if last:
                raise CannotApplyError(str(error)) from error
    return []


def _composed(part: StructurePart, said: str, text: GoalText, reader: GoalReader) -> StructurePart | None:
    """Read a fragment such as "tallest on the left" behind a sentence that asks for the structure; `None` in vain."""
    if part.shape is None or part.objects is None:
        return None
    names = [text.names[index] for index in objects_of(text.goal, part.objects)]
    base = f"put the {', the '.join(names[:-1])} and the {names[-1]} in a {part.shape}"
    fragment = re.sub(
        r"^(?:(?:please|now|but|and|no|actually|instead|make (?:it|them|that)|put (?:it|them)|with it|it)[ ,]+)+",
        "",
        said,
    )
    fragment = re.sub(r"[ ,]+(?:instead|please|now)$", "", fragment)
    for sentence in (f"{base}, {fragment}", f"{base} {fragment}", f"{base}, with {fragment}"):
        goal = reader.read(sentence, strictly=True).goal
        if len(goal.parts) != 1 or not isinstance(goal.parts[0], StructurePart):
            continue
        read = goal.parts[0]
        if read.shape != part.shape or set(objects_of(goal, read.objects)) != set(objects_of(text.goal, part.objects)):
            continue
        keys = {each.name: getattr(read, each.name) for each in fields(read) if each.name in (*SLOTS, *KEYS)}
        given = {key: value for key, value in keys.items() if value is not None}
        if set(given) - {"shape"}:
            objects = read.objects if read.order is not None and read.order.by == "listed" else part.objects
            return replace(part, **given, objects=objects)
    return None

"""Revise a goal of several parts by the next sentence of a conversation: change, add, drop or choose parts.

A goal of one structure with nothing but its five slots is revised as before (`grounding.dialogue.revise`), as long as
the sentence asks for nothing that only a goal of several parts can hold. Everything is as spoken: left is the
speaker's left.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.dialogue.full_sentences import in_full, without_waived
from grounding.dialogue.goal_changes import listed, objects_of
from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.goal_revision import GoalRevision, Turn, anew, new_goal
from grounding.dialogue.interjections import without_interjections
from grounding.dialogue.line_ends import placed_at_an_end
from grounding.dialogue.listed_orders import ordered_as_listed
from grounding.dialogue.object_exchanges import objects_exchanged
from grounding.dialogue.opposite_sides import on_the_opposite_side
from grounding.dialogue.part_additions import ALL_THERE, addition, adds, merged, said_besides
from grounding.dialogue.part_changes import edited
from grounding.dialogue.part_drops import dropped, fewer_parts, nothing_left, taken_off, which_is_dropped
from grounding.dialogue.part_lengths import CannotApplyError
from grounding.dialogue.part_relations import parts_related
from grounding.dialogue.part_replacements import (
    others_kept,
    replaced,
    which_is_replaced,
    which_object_goes,
    which_objects_stay,
)
from grounding.dialogue.revise import Revision
from grounding.dialogue.revision_checks import unsupported
from grounding.dialogue.scene_reader import GoalReader, SpokenReading
from grounding.dialogue.second_opinion import goal_after, second_opinion
from grounding.dialogue.sentence_kind import REPLACING, corrects, is_new, is_whole, orders, without_marker
from grounding.dialogue.suggestions import suggested
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.parse_result import shortened
from grounding.references.attributes import SceneObject
from grounding.references.object_names import as_named
from grounding.references.phrases import ANY
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import StructureSpec

_LONGEST_CORRECTION = 400  # characters; what is longer is an instruction of its own
_BESIDE_IT = re.compile(
    r"\b(?:behind|in front of|(?:left|right) of|next to|beside|near|on|on top of|in|inside|around|between) "
    r"(?:it|them|that|these|those|the (?:line|row|circle|ring|tower|stack|pile|table setting|setting))\b(?! with\b)"
)
_THEM = re.compile(r"\b(?:them|these|those)\b", re.IGNORECASE)
_START_AFRESH = re.compile(
    r"(?:(?:no|nope|ok|okay|actually|hmm?|oh|wait|please|right|well|sorry|let's)[ ,.!]+)*"
    r"(?:(?:scrap|forget|scratch|bin|ditch|cancel|never ?mind)(?: about)?"
    r" (?:all (?:of )?)?(?:that|this|it|everything|all|the (?:lot|whole (?:thing|lot|plan)))"
    r"|start(?:ing)? (?:again|over|afresh|from scratch)|new (?:plan|idea))\b[ ,.;:!-]+(?:and |then |just |instead )*"
    r"(?P<rest>.*\w.*?)(?:[ ,.;]+(?:and )?(?:(?:nothing|nowt) else|that's (?:it|all)))?[ .!]*",
    re.IGNORECASE | re.DOTALL,
)
_DROP_IT = re.compile(
    r"(?:(?:no|ok|okay|actually|please|just|now|then)[ ,]+)*(?:drop|remove|delete|lose|ditch|skip|scrap|leave out)"
    r"(?: (?:it|that|this|that one|this one|one(?: of (?:them|these|those))?))?"
)


def revise_goal(
    last: Goal,
    text: str,
    reader: GoalReader,
    objects: Sequence[SceneObject | str | None],
    *,
    encoder: object = None,
    stands: Sequence[StructureSpec | None] = (),
    built: bool = False,
    declined: bool = False,
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
        declined: whether it was proposed and is no longer wanted. An instruction about other objects takes the place
            of a goal that was built or declined, and adds to one that is still to be built.
    """
    text = as_named(text, [each.name if isinstance(each, SceneObject) else each for each in objects])
    text = in_full(without_interjections(text), last) if last.parts else text
    said = GoalText(text[: _LONGEST_CORRECTION + 1], last, objects, encoder)  # type: ignore[arg-type]
    turn = without_waived(Turn(last, text, said, reader, stands, built, not built and not declined))
    if last.parts and (read := _wholly_read(turn)) is not None:
        return read
    return suggested(turn, second_opinion(turn, _supported(turn, _by_rules(turn))))


def _wholly_read(turn: Turn) -> GoalRevision | None:
    """Return the effect of a sentence of which a single pattern has every word, so that nothing needs to be checked."""
    return placed_at_an_end(turn) or ordered_as_listed(turn) or on_the_opposite_side(turn)


def _supported(turn: Turn, found: GoalRevision) -> GoalRevision:
    """Return what the rules found, or a refusal where the sentence has no words for it."""
    goal = goal_after(turn, found) if found.status == "ok" else None
    if goal is not None and found.kind == "new" and (question := which_objects_stay(turn, goal)) is not None:
        return question
    # What is said once more changes nothing, and needs no words for a change.
    reason = "" if goal is None or goal == turn.last else unsupported(turn, goal, found.kind)
    if not reason:
        return found
    message = f"{shortened(turn.text)!r} was not understood as a correction: {reason}"
    return GoalRevision(turn.last, "refused", message=message)


def _by_rules(turn: Turn) -> GoalRevision:
    """Return the effect of a sentence as the rules read it."""
    last, text = turn.last, turn.text
    if last.parts and (afresh := _START_AFRESH.fullmatch(text.strip())) is not None:
        return anew(turn, turn.reader.read(afresh["rest"]), afresh["rest"])
    if last.parts and len(text) <= _LONGEST_CORRECTION:
        if (other := objects_exchanged(turn) or parts_related(turn) or taken_off(turn)) is not None:
            return other
    spec = last.plain_spec if last.parts else StructureSpec()
    if spec is not None:
        return _of_plain(turn, spec)
    if len(text) > _LONGEST_CORRECTION:
        return new_goal(last, turn.reader.read(text))
    return _revision(turn)


def _of_plain(turn: Turn, spec: StructureSpec) -> GoalRevision:
    """Revise a goal of one plain structure, or none: as before, unless the sentence asks for more than it can hold."""
    last, text = turn.last, turn.text
    plain = turn.reader.revise(spec, text, turn.stands[0] if turn.stands else None)
    if len(text) <= _LONGEST_CORRECTION and last.parts:
        extended = _added_to_plain(turn, plain)
        if extended is not None:
            return extended
    absent = [
        turn.said.said[slice(*one.span)]
        for one in turn.said.mentions if not one.indices and one.mention.noun != ANY
    ]  # fmt: skip
    if absent and (plain.kind, plain.status) == ("edit", "ok"):
        return GoalRevision(last, "refused", message=f"there is no {absent[0]!r} here; nothing was changed")
    read = _read_whole(turn, text)
    named = any(one.indices for one in turn.said.mentions)
    if not last.parts and named and read.status == "refused" and (plain.kind, plain.status) == ("edit", "ok"):
        return new_goal(last, read, text)  # nothing is there that "phone next to the nearer mug" could correct
    if read.goal.parts and read.goal.plain_spec is None:
        return _of_its_own_objects(turn, read) or said_besides(turn, read) or anew(turn, read)
    if plain.kind == "new" and (more := said_besides(turn, read)) is not None:
        return more
    closed = bool(last.parts) and not turn.open and plain.status == "refused" and orders(turn)  # nothing is left to correct
    whole_sentence = plain.kind == "new" or not last.parts or (closed and bool(turn.said.mentions))
    instructs = whole_sentence and bool(turn.said.mentions or orders(turn))
    if instructs and read.status == "ok" and read.goal.parts and not _same_plain(turn, plain, read):
        return anew(turn, read)
    # What the reader of goals says of it is in none of the words of the parser of five slots.
    own_words = plain.status == "refused" and read.message != read.parse.message
    counts = (whole_sentence and (read.beyond or own_words)) or (own_words and read.status == "ask")
    if read.status != "ok" and counts:
        return new_goal(last, read, text)
    return GoalRevision(last, plain.status, plain.kind, plain.message, plain=plain, read=read)


def _of_its_own_objects(turn: Turn, read: SpokenReading) -> GoalRevision | None:
    """Return what a phrase without a verb says of the structure that is there: "around the plate", "the milk on the left".

    Returns:
        The changed goal, or a refusal where it says something of single objects of the structure; `None` where it
        names objects of its own.
    """
    if not turn.last.parts or orders(turn) or ALL_THERE.search(turn.text):
        return None
    everything = any(part.objects is None for part in read.goal.structures)
    if everything or not is_new(turn):  # "around the plate", "the biggest in the middle"
        edit = edited(turn)
        return edit if edit is not None and edit.status in ("ok", "ask") else _refused(turn, None)
    own = turn.last.parts[0].objects
    named = {one for part in read.goal.parts for one in objects_of(read.goal, part.objects)}
    own = set(range(len(turn.said.objects)) if own is None else objects_of(turn.last, own))
    if named and named < own:
        return _refused(turn, None)  # to take them out of the structure is another wish than to place them in it
    return None


def _same_plain(turn: Turn, plain: Revision, read: SpokenReading) -> bool:
    """Return whether the parser of five slots and the reader of goals found the same structure of the same objects."""
    part = read.goal.structures[0]
    if plain.status != "ok" or part.spec != plain.spec:
        return False
    try:
        chosen = select_objects(turn.text, turn.said.objects, turn.said.encoder).indices  # type: ignore[arg-type]
    except SelectionError:
        return False
    return set(chosen) == set(range(len(turn.said.objects)) if part.objects is None else part.objects)


def _added_to_plain(turn: Turn, plain: Revision) -> GoalRevision | None:
    """Return what a sentence adds to one plain structure, or changes in it beyond its slots; `None` for nothing."""
    if adds(turn):
        sum_ = addition(turn)
        if sum_ is not None and sum_.status == "ok" and sum_.goal.plain_spec is None:
            return sum_
    if _BESIDE_IT.search(turn.said.said) and any(one.indices for one in turn.said.mentions):
        goal = turn.reader.continued(turn.last, without_marker(turn), 0)
        if goal is not None and len(goal.parts) > 1 and goal.parts[0] == turn.last.parts[0]:
            return GoalRevision(goal, "ok", "add", "", tuple(range(1, len(goal.parts))))
        if plain.kind == "edit" and plain.objects_how == "replace":
            return _refused(turn, None)  # "put the cup behind it" takes no other objects for the structure
    if plain.status == "refused" and not is_new(turn):
        edit = edited(turn)
        if edit is not None and edit.status in ("ok", "ask"):
            return edit
    return None


def _read_whole(turn: Turn, text: str) -> SpokenReading:
    """Read a whole instruction, in which "them" are the objects that were spoken of last, not everything."""
    read = turn.reader.read(text)
    them = _THEM.search(text)
    everything = any(part.objects is None for part in read.goal.structures)
    if them is None or not everything or not turn.last.parts or ALL_THERE.search(text):
        return read
    spoken = next(iter(reversed(turn.last.structures)), turn.last.parts[-1])
    names = [f"the {turn.said.names[index]}" for index in objects_of(turn.last, spoken.objects)]
    if not names:
        return read
    listing = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    return turn.reader.read(f"{text[: them.start()]}{listing}{text[them.end() :]}")


def _revision(turn: Turn) -> GoalRevision:
    """Return the effect on a goal of several parts."""
    if _DROP_IT.fullmatch(turn.said.said):
        return which_is_dropped(turn) if len(turn.last.parts) > 1 else nothing_left(turn)
    try:
        if (less := dropped(turn.said)) is not None:
            return fewer_parts(turn, *less)
    except CannotApplyError as error:
        return GoalRevision(turn.last, "refused", message=str(error))
    except GoalError as error:
        return GoalRevision(turn.last, "refused", message=f"that cannot be dropped: {error}")
    if adds(turn):
        more = addition(turn)
        answerable = more is not None and (more.status == "ok" or (more.status == "ask" and bool(more.choices)))
        if more is not None and (answerable or (more.read is not None and more.read.status == "ok")):
            return more
        edit = edited(turn)
        return edit if edit is not None and edit.status != "refused" else more or edit or _refused(turn, None)
    if (beside := _beside_it(turn)) is not None:
        return beside
    correcting = corrects(turn)
    edit = edited(turn) if correcting else None
    if edit is not None and edit.status != "refused":
        return edit
    read = _read_whole(turn, without_marker(turn))
    if read.status == "ok" and read.goal.parts and (not correcting or is_whole(turn, read)):
        instead = merged(turn, read.goal) or replaced(turn, read)
        if instead is not None:
            return instead
        if REPLACING.search(turn.said.said):
            return which_is_replaced(turn, read)
        unnamed = turn.said.mentions and all(one.mention.noun == ANY for one in turn.said.mentions)
        if unnamed and not orders(turn) and not any(part.objects for part in read.goal.structures):
            return edit or _refused(turn, None)  # "with the tallest on the right" is no goal of its own
        return said_besides(turn, read) or others_kept(turn, read) or anew(turn, read)
    if read.status == "ask" and read.question is not None and not correcting:
        return new_goal(turn.last, read, turn.text)
    edit = edit or edited(turn)
    if REPLACING.search(turn.said.said) and (which := which_object_goes(turn)) is not None:
        return which
    if edit is not None and (edit.status != "refused" or correcting):
        return edit
    return _refused(turn, read)


def _beside_it(turn: Turn) -> GoalRevision | None:
    """Return the goal with an object beside what was spoken of last: "cup next to it"."""
    named = {index for one in turn.said.mentions for index in one.indices}
    if not named or named & set(turn.last.named_objects()) or not _BESIDE_IT.search(turn.said.said):
        return None
    more = addition(turn)
    return more if more is not None and more.status == "ok" else None


def _refused(turn: Turn, read: SpokenReading | None) -> GoalRevision:
    message = read.message if read is not None else ""
    said = f"{shortened(turn.text)!r} was not understood as a correction"
    if not message or message == said:
        message = f"{said}; the goal is: {listed(turn.last, turn.said.names)}"
    return GoalRevision(turn.last, "refused", message=message, read=read)

"""Drop parts of a goal, or objects from them: "drop the circle", "only the tower", "leave the cups where they are"."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

from grounding.dialogue.goal_changes import listed, numbered, objects_of, without_parts
from grounding.dialogue.goal_mentions import GoalText, Span
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn
from grounding.dialogue.object_exchanges import sentence_template
from grounding.dialogue.part_lengths import CannotApplyError
from grounding.dialogue.relation_edits import FILLERS
from grounding.goals.goal import Goal
from grounding.goals.parts import Part, RelationPart, StructurePart
from grounding.parse_result import Question

_POLITE = (
    r"(?:(?:please|now|ok|okay|so|then|just|actually|no|yes|well|sorry|wait|and|but|let's|can you|could you"
    r"|i want to)[ ,]+)*"
)
_DROP = re.compile(
    rf"^{_POLITE}(?:drop|remove|delete|forget(?: about)?|lose|ditch|cancel|skip|scrap|scratch|nix|undo|without|never ?mind|not"
    rf"|no(?: more)?"
    r"|omit|leave (?:out|off)|get rid of|take (?:away|out|off)|i (?:do not|don't) (?:want|need)"
    r"|we (?:do not|don't) need)\b"
)
_DROPPED = re.compile(
    r"\b(?:can go|has to go|must go|is not needed|are not needed|isn't needed|away|out)"
    r"(?: (?:again|now|then|please|of (?:it|there|them)))*$"
)
_LEFT = re.compile(
    rf"^{_POLITE}(?:leave|keep|let)\b(?=.* (?:where (?:it|they|that) (?:is|are|was|were)"
    rf"|(?:as|like) (?:it|they) (?:is|are)|alone"
    r"|in peace|be|out(?: of it)?|there|in place)$)"
)
_UNTOUCHED = re.compile(rf"^{_POLITE}(?:do not|don't|never) (?:touch|move|use|take|build|make|do)\b")
_KEEP = re.compile(rf"^{_POLITE}(?:(?P<only>only|just|nothing but)|(?:but )?(?:keep|leave)(?P<also> only| just)?)\b")
_ONLY_BEHIND = re.compile(r"\b(?:only|alone|nothing else)$")
_LEFT_BY_OBJECTS = re.compile(r"\b(?:from|out of|off|in|of) $")  # before the words for a part
_RELATED = re.compile(r"\b(?:on|in|into|onto|inside|behind|front|left|right|next|beside|between|not)\b")
_MORE_THAN_DROPS = re.compile(r"\b(?:with|instead|add|plus|but)\b")
_FILLERS = FILLERS | frozenset(
    "drop remove delete forget about lose ditch cancel skip scrap scratch nix undo without never mind nevermind no more "
    "omit leave out off get rid take away don't do not want need we keep only just nothing alone where was "
    "were as like touch use build else peace needed isn't go can completely entirely altogether again after "
    "all too either anymore any more nor neither".split()
)
_TAKEN_OFF = re.compile(
    rf"{_POLITE}(?:take|get|remove|lift|pull) (?:the )?<0> (?:(?:back )?(?:off|out)(?: of)?|from) (?:the )?<1>"
    r"(?:[ ,]+(?:again|please|now|then|after all))*"
)
# Between two clauses that each drop or keep something.
_CLAUSE = re.compile(
    r"[,;.]+ *(?:and |but )?|\b(?:and"
    r"|but)\b (?=(?:keep|leave|drop|remove|forget|only|just|skip|delete|cancel|without|don't|do not)\b)"
)


def dropped(text: GoalText) -> tuple[Goal, frozenset[int]] | None:
    """Find what a sentence drops from a goal.

    Returns:
        The goal with fewer objects in its parts, and the numbers of the parts that go; `None` where the sentence is
        none that drops or keeps.

    Raises:
        CannotApplyError: where it drops what the goal does not have, or what a part cannot be without.
    """
    clauses = [clause.strip() for clause in _CLAUSE.split(text.said) if clause and clause.strip()]
    if not all(_drops(clause) or _KEEP.match(clause) for clause in clauses):
        return None
    goal, gone, any_drop = text.goal, set[int](), False
    kept: set[int] = set()
    for clause in clauses:
        piece = GoalText(clause, goal, text.objects, text.encoder)
        keep = _KEEP.match(clause)
        untouched = _LEFT.match(clause) or _UNTOUCHED.match(clause)
        if _drops(clause):
            if not piece.parts and not any(said.indices for said in piece.mentions):
                return None
            goal, numbers = _without(piece, gone, untouched is not None)
            gone |= numbers
            any_drop = True
        elif keep is not None:
            targets = piece.targets()
            related = len(piece.mentions) > 1 and _RELATED.search(clause)  # "only the red cup on the plate"
            if not targets or related or piece.left_over(_spans(piece), _FILLERS):
                return None
            kept |= set(targets)
            if piece.parts and any(said.indices for said in piece.mentions) and (within := _parts_left(piece)):
                goal, any_drop = _restricted(piece, goal, within), True  # "only the red cups in the line"
                continue
            if keep["only"] or keep["also"]:
                goal = _restricted(piece, goal, targets)
            if keep["only"] or keep["also"] or _ONLY_BEHIND.search(clause):
                gone |= set(range(len(goal.parts))) - kept
                any_drop = True
    if kept and not any_drop:
        raise CannotApplyError(
            f"nothing is dropped; say “only …” to drop all others. The goal is: {listed(text.goal, text.names)}"
        )
    return (goal, frozenset(gone - kept)) if any_drop else None


def taken_off(turn: Turn) -> GoalRevision | None:
    """Return the goal in which objects go on or into no other any more: "take the banana out of the bowl".

    Returns:
        `None` where no part of the goal puts them there, or where it was built: they then need another place.
    """
    template, named = sentence_template(turn)
    if turn.built or len(named) != 2 or _TAKEN_OFF.fullmatch(template) is None:
        return None
    for number, part in enumerate(turn.last.parts):
        if not isinstance(part, RelationPart) or part.relation not in ("on", "in"):
            continue
        own = set(objects_of(turn.last, part.objects))
        taken = named[0].of(own)
        if not taken or not named[1].of(set(objects_of(turn.last, part.reference))):
            continue
        left = tuple(one for one in objects_of(turn.last, part.objects) if one not in taken)
        if not left:
            return fewer_parts(turn, turn.last, frozenset({number}))
        goal = Goal((*turn.last.parts[:number], replace(part, objects=left), *turn.last.parts[number + 1 :]))
        return GoalRevision(goal, "ok", "edit", "", (number,))
    return None


def _restricted(text: GoalText, goal: Goal, targets: Collection[int]) -> Goal:
    """Return a goal in which parts have only those of their objects that a sentence names: "only the red one"."""
    meant = {index for said in text.mentions for index in said.indices}
    for number in targets if meant and (not text.parts or _parts_left(text)) else ():
        own = objects_of(goal, goal.parts[number].objects)
        some = tuple(index for index in own if index in meant)
        if some and len(some) < len(own):
            goal = Goal((*goal.parts[:number], _with(goal.parts[number], some), *goal.parts[number + 1 :]))
    return goal


def _drops(clause: str) -> bool:
    if _MORE_THAN_DROPS.search(clause):
        return False
    return any(pattern.search(clause) for pattern in (_LEFT, _UNTOUCHED, _DROP, _DROPPED))


def _spans(text: GoalText) -> list[Span]:
    return [one.span for one in (*text.parts, *(said for said in text.mentions if said.indices))]


def _without(text: GoalText, gone: Collection[int], untouched: bool) -> tuple[Goal, set[int]]:
    if left := text.left_over(_spans(text), _FILLERS):
        raise CannotApplyError(f"{' '.join(left)!r} was not understood")
    meant = {index for said in text.mentions for index in said.indices}
    within = _parts_left(text) if meant else ()
    if text.parts and not within:
        if missing := [one.words for one in text.parts if not one.numbers]:
            raise CannotApplyError(
                f"the goal has no {missing[0].removeprefix('the ')!r}; it is: {listed(text.goal, text.names)}"
            )
        several = [
            one for one in text.parts if len(one.numbers) > 1 and not re.match(r"part|both|all|each|every", one.words)
        ]
        targets = text.targets()
        if several and targets is not None and len(targets) > 1:
            raise CannotApplyError(f"{several[0].words!r} can be each of: {listed(text.goal, text.names)}")
        return text.goal, set(targets or ())
    goal, numbers = text.goal, set[int]()
    for number, part in enumerate(goal.parts):
        if within and number not in within:
            continue
        if isinstance(part, StructurePart) and part.around is not None and set(part.around) <= meant:
            goal = Goal((*goal.parts[:number], replace(part, around=None), *goal.parts[number + 1 :]))
            continue
        own = objects_of(goal, part.objects)
        if part.objects is None:  # everything that no other part names
            elsewhere = {one for one in goal.named_objects() if isinstance(one, int)}
            own = tuple(index for index in range(len(text.objects)) if index not in elsewhere)
            part = replace(part, objects=own)
        if number in gone or not meant & set(own):
            continue
        if set(own) <= meant:
            numbers.add(number)
        elif isinstance(part.objects, tuple):
            rest = tuple(index for index in part.objects if index not in meant)
            goal = Goal((*goal.parts[:number], _with(part, rest), *goal.parts[number + 1 :]))
    if goal == text.goal and not numbers:
        what = ", ".join(text.names[index] for index in sorted(meant))
        raise CannotApplyError(
            f"no part of the goal moves {what}" if untouched else f"no part of the goal has {what} to drop"
        )
    return goal, numbers


def _parts_left(text: GoalText) -> tuple[int, ...]:
    """Return the parts that objects leave, "the cup from the circle"; none where a part is dropped as a whole."""
    if not all(_LEFT_BY_OBJECTS.search(text.said[: one.span[0]]) for one in text.parts):
        return ()
    return tuple(number for one in text.parts for number in one.numbers)


def _with(part: Part, objects: tuple[int | str, ...]) -> Part:
    return replace(part, objects=objects)  # type: ignore[arg-type]


def nothing_left(turn: Turn) -> GoalRevision:
    """Refuse to drop all of a goal."""
    return GoalRevision(turn.last, "refused", message="nothing would be left of the goal; “clear” drops it")


def which_is_dropped(turn: Turn) -> GoalRevision:
    """Ask which part a sentence such as "drop it" means."""
    options, choices = [], []
    for number in range(len(turn.last.parts)):
        fewer, _ = without_parts(turn.last, [number])
        if fewer.parts:
            options.append(numbered(turn.last, number, turn.said.names))
            choices.append(fewer)
    question = Question(PART, f"which part should be dropped: {'; '.join(options)}?", tuple(options))
    return GoalRevision(turn.last, "ask", "edit", question.text, question=question, choices=tuple(choices))


def fewer_parts(turn: Turn, goal: Goal, gone: frozenset[int]) -> GoalRevision:
    """Return a goal without some parts, and say which others go with them."""
    if len(gone) == len(goal.parts):
        return nothing_left(turn)
    fewer, all_gone = without_parts(goal, gone)
    names, notes = turn.said.names, []
    if also := [number for number in all_gone if number not in gone]:
        notes.append(f"{', '.join(numbered(turn.last, n, names) for n in also)} spoke of it, and is dropped too")
    if not fewer.parts:
        return nothing_left(turn)
    if fewer == turn.last:
        message = f"nothing else was asked for; the goal is: {listed(turn.last, names)}"
        return GoalRevision(turn.last, "unchanged", message=message)
    changed = tuple(n for n, part in enumerate(fewer.parts) if part not in turn.last.parts)
    changed = tuple(n for n in changed if not all_gone or _other(turn, fewer, n))
    return GoalRevision(fewer, "ok", "edit", "; ".join(notes), changed, tuple(all_gone))


def _other(turn: Turn, goal: Goal, number: int) -> bool:
    """Return whether a part differs from all of the last goal in more than the numbers of the parts it speaks of."""
    part = goal.parts[number]
    return all(
        objects_of(goal, part.objects) != objects_of(turn.last, other.objects) or type(part) is not type(other)
        for other in turn.last.parts
    )

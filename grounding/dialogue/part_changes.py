"""Change the part of a goal that a sentence speaks of: "make the circle bigger", "put the bowl on the other side"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from grounding.dialogue.goal_changes import listed, numbered, with_part
from grounding.dialogue.goal_mentions import SHAPE_OF_NOUN, GoalText
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn
from grounding.dialogue.part_lengths import AlreadySoError, CannotApplyError
from grounding.dialogue.part_swaps import swapped
from grounding.dialogue.relation_edits import relation_change
from grounding.dialogue.revision_words import LEAVING
from grounding.dialogue.structure_edits import structure_change
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, RelationPart, StructurePart
from grounding.parse_result import OPEN, Question
from grounding.spec import SpecError

# What stands around a correction and says nothing of a part.
_MARKERS = re.compile(
    r"^(?:(?:please|now|but|and|no|nope|actually|instead|sorry|wait|then|ok|okay|rather|make it|make that|i meant?"
    r"|i said)\b[ ,]*)+"
    r"|[ ,]+(?:instead|please|now|rather|then|after all)$"
)
_SHAPES = re.compile(rf"(?<!\d )\b(?P<noun>{'|'.join(sorted(SHAPE_OF_NOUN, key=len, reverse=True))})s\b")


def edited(turn: Turn) -> GoalRevision | None:
    """Return the goal with the change of the part that the sentence speaks of; `None` where it changes none."""
    pieces = _pieces(turn)
    if len(pieces) < 2:
        return _edited_by(turn, turn.said)
    goal, changed, notes = turn.last, list[int](), list[str]()
    for piece in pieces:
        step_turn = turn.after(goal, piece)
        step = _edited_by(step_turn, step_turn.said)
        if step is None or step.status != "ok":
            return _edited_by(turn, turn.said)
        goal, notes = step.goal, [*notes, step.message]
        changed += step.changed
    return GoalRevision(goal, "ok", "edit", "; ".join(filter(None, notes)), tuple(dict.fromkeys(changed)))


def _pieces(turn: Turn) -> list[str]:
    """Divide a sentence that says something of several parts: "circle on the left, tower on the right"."""
    pieces = [piece for piece in re.split(r" *[,;] *(?:and |but )?| (?:and|but) ", turn.said.said) if piece]
    about = [GoalText(piece, turn.last, turn.said.objects, turn.said.encoder).targets() for piece in pieces]
    distinct = len(pieces) > 1 and all(about) and len({targets for targets in about}) == len(pieces)
    return pieces if distinct and all(len(piece.split()) > 1 for piece in pieces) else [turn.said.said]


def _edited_by(turn: Turn, said: GoalText) -> GoalRevision | None:
    try:
        exchange = swapped(said)
    except CannotApplyError as error:
        return GoalRevision(turn.last, "refused", message=str(error))
    if exchange is not None:
        changed = tuple(n for n, part in enumerate(exchange.parts) if part != turn.last.parts[n])
        return GoalRevision(exchange, "ok", "edit", "", changed)
    if missing := [one for one in said.parts if not one.numbers]:
        words = re.sub(r"^(?:the|that|this) ", "", missing[0].words)
        return GoalRevision(
            turn.last, "refused", message=f"the goal has no {words!r}; it is: {listed(turn.last, said.names)}"
        )
    targets = said.targets()
    several = _of_shapes_in_plural(said) if targets is None else ()
    numbers = several or (targets if targets is not None else tuple(range(len(turn.last.parts))))
    named = {index for one in said.mentions for index in one.indices}
    # "The box at the back" of a box that the goal has not got is no place for what it has.
    elsewhere = targets is None and bool(named) and all(part.objects is not None for part in turn.last.structures)
    applied, asked, reasons, failed, already = [], [], [], [], []
    for number in numbers:
        try:
            change = _change_of(turn, number, said)
        except (CannotApplyError, SpecError) as error:
            reasons.append(f"{numbered(turn.last, number, said.names)}: {error}")
            failed.append(number)
            already += [number] if isinstance(error, AlreadySoError) else []
            continue
        if change is None or (elsewhere and not _takes_objects(turn.last, change[0], said)):
            failed.append(number)
        else:
            (asked if change[2] is not None else applied).append((number, *change))
    every = targets is not None and any(len(one.numbers) > 1 and re.match(r"part|both|all|each|every|the (?:whole|lot)", one.words)
                                        for one in said.parts)  # fmt: skip
    if (every or several) and len(applied) == len(numbers):
        return _all_of(turn, applied)
    if len(applied) + len(asked) > 1 or (applied and already):
        return _which(turn, applied, [number for number, *_ in asked], already)
    if every and failed:
        applied, asked = [], []
    if asked:
        return _ask_slot(turn, *asked[0][:2], asked[0][2], asked[0][3])
    if applied:
        number, goal, note, _ = applied[0]
        return GoalRevision(goal, "ok", "edit", note, (number,))
    if reasons:
        return GoalRevision(turn.last, "refused", message="; ".join(reasons))
    return None


def _takes_objects(last: Goal, goal: Goal, said: GoalText) -> bool:
    """Return whether objects join a part, or take the place of others that a sentence says leave."""
    before, after = set(last.named_objects()), set(goal.named_objects())
    return after > before or (after != before and LEAVING.search(said.said) is not None)


def _of_shapes_in_plural(said: GoalText) -> tuple[int, ...]:
    """Return the structures that all take another shape: "lines instead of circles"; none where that is not said."""
    named = {SHAPE_OF_NOUN[noun] for noun in _SHAPES.findall(said.said)}
    shapes = [part.shape if isinstance(part, StructurePart) else None for part in said.goal.parts]
    if len(named - set(shapes)) != 1:
        return ()
    old = named & set(shapes) or set(shapes) - {None}
    numbers = tuple(number for number, shape in enumerate(shapes) if shape in old)
    return numbers if len(numbers) > 1 or named & set(shapes) else ()


def _change_of(turn: Turn, number: int, said: GoalText) -> tuple[Goal, str, Question | None] | None:
    """Return the goal with a change of one part, what must be said, and what must be asked."""
    if (some := _some_of(turn, number, said)) is not None:
        return _change_of(turn.after(some, said.said), len(some.parts) - 1, said.about(some))
    try:
        change = _by_rules(turn, number, said)
    except (CannotApplyError, SpecError):
        if (goal := _continued(turn, number, said)) is not None:
            return goal, "", None
        raise
    if change is None or change[2] is not None:
        goal = _continued(turn, number, said)
        return change if goal is None else (goal, "", None)
    return change


def _some_of(turn: Turn, number: int, said: GoalText) -> Goal | None:
    """Return the goal in which a relation of several objects is two, where a sentence speaks of some of them only.

    "The red pen in the other mug": the blue pen stays where it was asked to go.
    """
    part = turn.last.parts[number]
    if not isinstance(part, RelationPart) or not isinstance(part.objects, tuple) or part.relation == "swapped":
        return None
    named = {index for one in said.mentions for index in one.indices}
    some = tuple(index for index in part.objects if index in named)
    if said.parts or not some or len(some) == len(part.objects):
        return None
    others = tuple(index for index in part.objects if index not in some)
    goal = with_part(turn.last, number, replace(part, objects=others))
    return Goal((*goal.parts, replace(part, objects=some)))


def _continued(turn: Turn, number: int, said: GoalText) -> Goal | None:
    """Read what a sentence says of one part as if it went on from the goal; `None` where it says nothing of it."""
    words = _MARKERS.sub("", said.said)
    goal = turn.reader.continued(turn.last, words, number) if words else None
    if goal is None or len(goal.parts) != len(turn.last.parts):
        return None
    changed = [n for n, part in enumerate(goal.parts) if part != turn.last.parts[n]]
    return goal if changed == [number] else None


def _by_rules(turn: Turn, number: int, said: GoalText) -> tuple[Goal, str, Question | None] | None:
    part = turn.last.parts[number]
    if isinstance(part, RelationPart):
        changed = relation_change(part, number, said, turn.built)
        return None if changed is None else (with_part(turn.last, number, changed), "", None)
    stands = turn.stands[number] if number < len(turn.stands) else None
    change = structure_change(number, said, turn.reader, stands)
    if change is None:
        return None
    return with_part(turn.last, number, change.part), change.notes, change.question


def _all_of(turn: Turn, applied: Sequence[tuple[int, Goal, str, Question | None]]) -> GoalRevision:
    goal = turn.last
    for number, changed, _, _ in applied:
        goal = with_part(goal, number, changed.parts[number])
    notes = "; ".join(filter(None, (note for _, _, note, _ in applied)))
    return GoalRevision(goal, "ok", "edit", notes, tuple(number for number, *_ in applied))


def _which(
    turn: Turn, applied: Sequence[tuple[int, Goal, str, Question | None]], asked: Sequence[int], already: Sequence[int]
) -> GoalRevision:
    """Ask which part a change is meant for; an answer leads to the goal, or to the sentence with the part named."""
    options = [numbered(turn.last, number, turn.said.names) for number, *_ in applied]
    choices: list[Goal | str] = [goal for _, goal, _, _ in applied]
    for number in asked:
        options.append(numbered(turn.last, number, turn.said.names))
        choices.append(f"{turn.said.said} (part {number + 1})")
    for number in already:
        options.append(f"{numbered(turn.last, number, turn.said.names)}, where it changes nothing")
        choices.append(turn.last)
    if not asked and len(applied) > 1:
        with suppress(GoalError):  # one object cannot join both
            choices.append(_all_of(turn, applied).goal)
            options.append("both" if len(applied) == 2 else "all of them")
    question = Question(PART, f"which part is meant: {'; '.join(options)}?", tuple(options))
    return GoalRevision(turn.last, "ask", "edit", question.text, question=question, choices=tuple(choices))


def _ask_slot(turn: Turn, number: int, goal: Goal, note: str, question: Question | None) -> GoalRevision:
    assert question is not None  # the caller has looked
    part = goal.parts[number]
    choices: list[Goal | str] = []
    for option in question.options:
        try:
            value = None if option == OPEN else option
            choices.append(with_part(turn.last, number, replace(part, **{question.slot: value})))
        except (SpecError, TypeError):
            return GoalRevision(turn.last, "refused", message=question.text)
    named = Question(
        question.slot, f"{numbered(turn.last, number, turn.said.names)}: {question.text}", question.options
    )
    return GoalRevision(turn.last, "ask", "edit", named.text, question=named, choices=tuple(choices))

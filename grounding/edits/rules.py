"""Change a goal by what needs arithmetic: named rules over typed tokens, each a pattern and a function."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from grounding.edits.exchanges import swapped
from grounding.edits.parts import (
    CannotEdit,
    PartEdit,
    Standing,
    as_long,
    back,
    longer,
    other_side,
    other_way,
    resized,
    scaled,
    shifted,
    stepped,
    turned,
)
from grounding.edits.tokens import Tokens, tokens_of
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, RelationPart, StructurePart
from grounding.resolve.attributes import SceneObject

_OFFERED = 2  # parts that a question offers, besides both of them


@dataclass(frozen=True)
class Edit:
    """What an edit makes of a goal.

    Attributes:
        goals: the goal; several where it is not clear which part is meant; none where it cannot be done.
        changed: for each goal the numbers of its parts that are new or other than before.
        message: why it cannot be done, and what to say instead.
        computed: whether it needed arithmetic.
    """

    goals: tuple[Goal, ...] = ()
    changed: tuple[tuple[int, ...], ...] = ()
    message: str = ""
    computed: bool = True


@dataclass(frozen=True)
class Rule:
    """A rule of edits.

    Attributes:
        name: of the rule.
        pattern: of the kinds of a sentence's tokens.
        edit: changes a part.
        computes: whether it needs arithmetic; otherwise the network was taught it, too.
    """

    name: str
    pattern: str
    edit: PartEdit
    computes: bool = True


_AMOUNT, _COMPARED = "(length|number)", "(more|less)"
RULES = (
    Rule("as long", "(move )?(key )?(bit )?(more|less)( key)? be length( key)?", as_long),
    Rule("so long", "(move )?(key )?be length( key)?", as_long, False),
    Rule(
        "longer",
        f"(move )?(key )?(be )?({_AMOUNT}( key)? {_COMPARED}|{_COMPARED}( bit)?( key)? {_AMOUNT}( more)?)( key)?",
        longer,
    ),
    Rule("raised", f"(change key|key change) {_AMOUNT}", longer),
    Rule("raised to", "(change key|key change) be length", as_long),
    Rule("scaled", "(key )?(be )?factor( key)?( more| less)?( key)?", scaled),
    Rule("back", "(move )?direction number", back),
    Rule(
        "shifted",
        f"(move )?(bit )?({_AMOUNT}( more| less)? direction|(more )?direction {_AMOUNT}|more {_AMOUNT} direction)",
        shifted,
    ),
    Rule("resized", "(move |be )?(bit )?(more|less)( bit)?", resized),
    Rule("stepped", "(move |be )?((bit )?(more|bit) direction|direction bit|more direction( bit)?)", stepped),
    Rule(
        "turned",
        "(turn|move) (angle( turn)?( rotation| direction)?|rotation( angle)?)|turn (direction|way)"
        "|angle( turn)? (rotation|direction)",
        turned,
    ),
    Rule("other side", "(move |swap )?(opposite )?side", other_side, False),
    Rule("other way", "(turn |move )?opposite way( way)?|reverse( way)?", other_way, False),
)  # fmt: skip
_SWAP = re.compile(r"swap( move| swap)?")


def edited(
    goal: Goal, text: str, objects: Sequence[SceneObject], stands: Sequence[Standing] = (), fresh: Collection[int] = ()
) -> Edit | None:
    """Change a goal by a sentence that asks for arithmetic.

    Args:
        goal: in the speaker's frame; its objects are indices.
        text: what is said about it.
        objects: of the scene.
        stands: what is known of each part; may be shorter than the parts.
        fresh: the parts of which was spoken last: they are meant where no part is named.

    Returns:
        What becomes of it; `None` where no rule holds all words of the sentence.
    """
    said = tokens_of(text, goal, objects) if goal.parts else None
    if said is None or not said.tokens:
        return None
    rule = next((rule for rule in RULES if re.fullmatch(rule.pattern, said.kinds)), None)
    # "blue and yellow the other way round"
    two_turned = rule is not None and rule.edit is other_way and len(said.named) == 2
    if _SWAP.fullmatch(said.kinds) or two_turned:
        return _exchanged(goal, said, stands)
    return None if rule is None else replace(_applied(rule, goal, said, stands, fresh), computed=rule.computes)


def _applied(rule: Rule, goal: Goal, said: Tokens, stands: Sequence[Standing], fresh: Collection[int]) -> Edit:
    """Apply a rule to the parts that are meant: those that are named, or else those that can take it."""
    numbers = range(len(goal.parts)) if said.targets is None else said.targets
    found, why = dict[int, Goal](), ""
    for number in numbers:
        known = stands[number] if number < len(stands) else Standing()
        try:
            found[number] = with_part(goal, number, rule.edit(goal.parts[number], said, known))
        except (CannotEdit, GoalError) as error:
            why = max(why, str(error), key=len)  # the part that comes nearest says most
    if not found:
        return Edit(message=why or "there is no part of the goal that this could change")
    if said.targets is None and not said.every and any(number in fresh for number in found):
        found = {number: one for number, one in found.items() if number in fresh}
    together = goal
    for number, one in found.items():
        together = _merged(together, one, number)
    every = said.every or said.targets is not None
    if len(found) == 1 or every:
        return Edit((together,), (_changed(goal, together),))
    goals = (*list(found.values())[:_OFFERED], together)
    return Edit(goals, tuple(_changed(goal, one) for one in goals))


def with_part(goal: Goal, number: int, part: StructurePart | RelationPart) -> Goal:
    """Put a part in the place of another one; a move of what stands comes in addition to it."""
    if (
        isinstance(part, RelationPart)
        and part.relation == "moved"
        and getattr(goal.parts[number], "relation", "") != "moved"
    ):
        return Goal((*goal.parts, part))
    return Goal((*goal.parts[:number], part, *goal.parts[number + 1 :]))


def _merged(goal: Goal, one: Goal, number: int) -> Goal:
    if len(one.parts) > len(goal.parts) or one.parts[number] == goal.parts[number]:
        return Goal((*goal.parts, one.parts[-1]))
    return Goal((*goal.parts[:number], one.parts[number], *goal.parts[number + 1 :]))


def _changed(goal: Goal, new: Goal) -> tuple[int, ...]:
    return tuple(n for n, part in enumerate(new.parts) if n >= len(goal.parts) or part != goal.parts[n])


def _exchanged(goal: Goal, said: Tokens, stands: Sequence[Standing]) -> Edit | None:
    stood = bool(stands) and all(one.stood for one in stands)
    try:
        new = swapped(goal, said.named, said.targets, stood)
    except (CannotEdit, GoalError) as error:
        return Edit(message=str(error), computed=False)
    return None if new is None else Edit((new,), (_changed(goal, new),), computed=False)

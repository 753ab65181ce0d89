"""Exchange objects of a goal for others, or let further ones join a structure: "drill in, hammer out"."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, replace

from grounding.dialogue.goal_changes import exchanged, objects_of, with_part
from grounding.dialogue.goal_mentions import Span
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, Objects, RelationPart, StructurePart

_POLITE = (
    r"(?:(?:please|now|ok|okay|so|then|just|actually|no|nope|yes|yeah|well|sorry|wait|and|but|oh|hm+|uh|um|also|alright"
    r"|all right|i meant?|i said|i want|i'd like|let|let's|make that|make it|the|my|plus|put|take|use|have|get)[ ,]+)*"
)
_AFTER = (
    r"(?:[ ,]+(?:please|now|then|instead|rather|after all|too|also|as well|for (?:it|that|them)|there|sorry|thanks|"
    r"in there|pls|plz|rest as (?:it )?is|the rest stays))*[ .!]*"
)
# What is said with two phrases for objects, of which one is in the goal and goes, and the other comes.
_EXCHANGES = tuple(
    re.compile(rf"{_POLITE}{pattern}{_AFTER}")
    for pattern in (
        r"<0> out[ ,]+(?:and )?(?:put )?(?:in )?(?:the )?<1>(?: in| instead)?",
        r"<0> in[ ,]+(?:and )?(?:the )?<1> out",
        r"<0>[ ,]+(?:and |but )?not (?:the )?<1>",
        r"not (?:the )?<0>[ ,]+(?:but )?(?:the )?<1>",
        r"(?:without |no )(?:the )?<0>[ ,]+(?:but )?(?:the )?<1> instead",
        r"no <0>[ ,]+but (?:the )?<1>",
        r"<0> (?:instead of|in place of|rather than|in the place of) (?:the )?<1>",
        r"(?:instead of|in place of|rather than|in the place of) (?:the )?<0>[ ,]+(?:take |use |put )?(?:the )?<1>",
        r"(?:replace|swap|exchange|switch|trade|substitute|change) (?:out )?(?:the )?<0>"
        r" (?:with|by|for|against|to|into) (?:the )?<1>",
        r"<0> for (?:the )?<1>",
    )
)
_LISTED = re.compile(r"<(?P<first>\d)> and (?:the )?<(?P<second>\d)>")
_STRUCTURE = r"(?:<part>|it|them|there|this|that|these|those|the (?:others|same (?:one|\w+)))"
_JOINS = tuple(
    re.compile(
        rf"{_POLITE}(?:add )?<0>(?: (?:should|can|may|must|could|will|wants? to|want to|is to))*"
        rf"(?: (?:go|goes|come|comes|be|put))? {pattern}{_AFTER}"
    )
    for pattern in (
        rf"(?:joins?|join in with|belongs? (?:in|to)|(?:is |be )?part of|wants? in on|in with|along with) {_STRUCTURE}",
        rf"(?:in|into|to|onto|on|with) {_STRUCTURE} (?:too|as well|also)",
        r"(?:in|into) (?:the same |that same )?<part>",
        r"joins?(?: in)?",
    )
)


def objects_exchanged(turn: Turn) -> GoalRevision | None:
    """Return the goal with other objects in place of some, or more in a structure; `None` where that is not said."""
    template, named = sentence_template(turn)
    if len(named) == 2 and any(pattern.fullmatch(template) for pattern in _EXCHANGES):
        return _with_others(turn, *named)
    if len(named) == 1 and any(pattern.fullmatch(template) for pattern in _JOINS):
        return _with_more(turn, named[0])
    return None


@dataclass(frozen=True)
class NamedObjects:
    """Objects that a phrase fits, and whether it may mean several of them."""

    indices: tuple[int, ...]
    several: bool

    def of(self, allowed: set[int]) -> tuple[int, ...]:
        """Return those of some objects that are meant; none where it is not clear which one is."""
        found = tuple(index for index in self.indices if index in allowed)
        return found if self.several or len(found) == 1 else ()


def sentence_template(turn: Turn) -> tuple[str, list[NamedObjects]]:
    """Return the sentence with "<0>" and so on for its objects and "<part>" for its parts, and what the objects are."""
    phrases = turn.said.mentions
    spans: list[tuple[Span, str]] = [(one.span, "<part>") for one in turn.said.parts]
    spans += [(one.span, f"<{number}>") for number, one in enumerate(phrases)]
    said = turn.said.said
    for (first, end), word in sorted(spans, reverse=True):
        said = f"{said[:first]}{word}{said[end:]}"
    named = [NamedObjects(one.indices, one.mention.plural) for one in phrases]
    while (both := _LISTED.search(said)) is not None:  # "the bowl and the plate" are one phrase
        first, second = int(both["first"]), int(both["second"])
        clear = all(named[k].several or len(named[k].indices) == 1 for k in (first, second))
        indices = (*named[first].indices, *named[second].indices) if clear else ()
        named[first], named[second] = NamedObjects(indices, True), NamedObjects((), True)
        said = f"{said[: both.start()]}<{first}>{said[both.end() :]}"
    kept = [number for number in range(len(named)) if f"<{number}>" in said]
    for place, number in enumerate(kept):
        said = said.replace(f"<{number}>", f"<{place}>")
    return said, [named[number] for number in kept]


def _with_others(turn: Turn, one: NamedObjects, other: NamedObjects) -> GoalRevision | None:
    known = set(turn.last.named_objects())
    everything = set(range(len(turn.said.objects)))
    inside = [bool(set(each.indices) & known) for each in (one, other)]
    if inside[0] == inside[1]:
        return None
    leaving, joining = (one, other) if inside[0] else (other, one)
    goes, comes = leaving.of(known), joining.of(everything - known)
    if not goes or not comes:
        return None
    with suppress(GoalError):
        if len(goes) == len(comes):
            instead = dict(zip(goes, comes, strict=True))
            return _changed(turn, Goal(tuple(exchanged(part, instead) for part in turn.last.parts)))
        parts = [
            replace(part, objects=_replaced(part.objects, goes, comes)) if isinstance(part, StructurePart) else part
            for part in turn.last.parts
        ]
        goal = Goal(tuple(parts))
        left = {index for part in goal.parts for index in _all_of(goal, part)}
        return None if left & set(goes) else _changed(turn, goal)
    return None


def _replaced(objects: Objects | None, goes: tuple[int, ...], comes: tuple[int, ...]) -> Objects | None:
    if not isinstance(objects, tuple) or not set(goes) <= set(objects):
        return objects
    place = objects.index(goes[0])  # type: ignore[arg-type]
    kept = [index for index in objects[place:] if index not in goes]
    return (*(index for index in objects[:place] if index not in goes), *comes, *kept)  # type: ignore[return-value]


def _all_of(goal: Goal, part: StructurePart | RelationPart) -> tuple[int, ...]:
    reference = part.reference if isinstance(part, RelationPart) else part.around
    return (*objects_of(goal, part.objects), *objects_of(goal, reference))


def _with_more(turn: Turn, joining: NamedObjects) -> GoalRevision | None:
    """Return the goal in which further objects join the structure that is spoken of, or the only one."""
    spoken = [number for one in turn.said.parts for number in one.numbers]
    numbers = spoken or [n for n, part in enumerate(turn.last.parts) if isinstance(part, StructurePart)]
    comes = joining.of(set(range(len(turn.said.objects))) - set(turn.last.named_objects()))
    if not comes or len(numbers) != 1 or (joining.several and set(comes) != set(joining.indices)):
        return None
    part = turn.last.parts[numbers[0]]
    if not isinstance(part, StructurePart) or part.objects is None or len(turn.last.parts) > 1 and not spoken:
        return None
    with suppress(GoalError):
        return _changed(turn, with_part(turn.last, numbers[0], replace(part, objects=(*part.objects, *comes))))  # type: ignore[arg-type]
    return None


def _changed(turn: Turn, goal: Goal) -> GoalRevision | None:
    changed = tuple(n for n, part in enumerate(goal.parts) if part != turn.last.parts[n])
    return GoalRevision(goal, "ok", "edit", "", changed) if changed else None

"""Let the goal network read what is said about a goal too, and decide what its reading changes.

The rules of corrections know what they read, and refuse most of what people say in other words. The network reads all
of it and says how certain it is. Where the rules found nothing, its goal is used if it is certain, knows every word and
changes nothing that the sentence has no words for; else its likeliest goals are offered as a question. Where the rules
found another goal, a certain network makes a question with both.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.dialogue.goal_revision import PART, GoalRevision, Turn
from grounding.dialogue.part_lengths import CannotApplyError
from grounding.dialogue.relative_edits import normalized, relative_edits
from grounding.dialogue.revision_checks import unsupported
from grounding.dialogue.structure_edits import revised_structure
from grounding.goal_network.network_reading import NetworkReading, brings_together
from grounding.goal_network.weighty_words import weighty
from grounding.goals.comparison import compare_goals
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, Part, RelationPart, StructurePart
from grounding.parse_result import Question, shortened

# Chosen on labelled corrections that the network was not trained on (docs/parsing.md).
CERTAIN = 0.7  # in place of a refusal
REFUSED_AT_MOST = 0.05  # that the sentence is a remark, or asks for what cannot be built, beside a goal that is used
CERTAIN_OF_CALCULATED = 0.85  # the same, where a length is said, or that something is done likewise
LIKELY = 0.04  # offered in place of a refusal
LIKELY_OF_UNKNOWN = 0.1  # the same, where the network does not know every word
MOST_OFFERED = 2
REFUSES = 0.5  # that the sentence is a remark, asks for what cannot be built, or for one of several objects: nothing is offered
DOUBTS = 0.95  # another goal than the rules read, or none
LONG = 10  # words: the rules read shorter corrections as well as the network does
AS_IT_IS = "leave the goal as it is"
_ONLY_A_REMARK = "nothing"
_VAGUE = "not understood"  # in a refusal without a reason of its own
_LONGEST = 400  # characters of a correction
_NO_WISHES = ("nothing", "impossible")
_CALCULATED = re.compile(  # lengths, and what is to be done likewise
    r"\d|\bsame\b|\b(?:cm|mm|centi\w+|milli\w+|met(?:er|re)s?|inch\w*|f(?:oo|ee)t|fingers?|hands?|closer|nearer|further|farther|longer"
    r"|shorter|wider|narrower|apart)\b",
    re.IGNORECASE,
)
_PROPOSES = re.compile(r"\b(?:what|how) about\b", re.IGNORECASE)  # in the form of a question, and no remark
_THE_SAME = re.compile(r"\bthe same\b", re.IGNORECASE)  # "the same with the boxes": the network would add the boxes


def second_opinion(turn: Turn, found: GoalRevision) -> GoalRevision:
    """Return the effect of a sentence on a goal after the network has read it too.

    Args:
        turn: the sentence and the goal.
        found: what the rules made of it.
    """
    if not _asks_for_it(turn, found):
        return found
    computed = bool(relative_edits(normalized(turn.text))[0]) or any(letter.isdecimal() for letter in turn.text)
    if found.status == "ok" and computed:
        return found  # the network cannot calculate
    second = turn.reader.corrected(turn.last, turn.text)
    if second is None:
        return found
    if found.status == "ok":
        return _doubted(turn, found, second) if _usable(second) else found
    if _usable(second) and _certain(turn, second):
        return _network_goal(turn, found, second)
    offered = _offered(turn, second, LIKELY_OF_UNKNOWN if second.unknown else LIKELY)
    if not offered:
        return found
    which = "is this the goal that is meant?" if len(offered) == 1 else "is one of these the goal that is meant?"
    question = f"{shortened(turn.text)!r} was not understood for certain: {which}"
    return _question(turn, found, question, [*offered, turn.last])


def _usable(second: NetworkReading) -> bool:
    """Return whether a reading holds all that is said, as far as can be told."""
    return second.question is None and not weighty(second.uncopied) and not brings_together(second)


def _certain(turn: Turn, second: NetworkReading) -> bool:
    """Return whether the network's likeliest goal is used."""
    if second.goal is None or second.unknown or _same(turn, second.goal, turn.last):
        return False
    if _no_wish(second) > REFUSED_AT_MOST:
        return False
    enough = CERTAIN_OF_CALCULATED if _CALCULATED.search(turn.text) else CERTAIN
    return second.certainty >= enough and not unsupported(turn, second.goal, _kind(turn, second.goal))


def _offered(turn: Turn, second: NetworkReading, least: float) -> list[Goal]:
    """Return the network's goals that a sentence may mean, first those that it has words for.

    Args:
        turn: the sentence and the goal.
        second: the network's readings.
        least: certainty of a goal that is offered.
    """
    readings = (second, *second.others)
    if _no_wish(second) > REFUSES or sum(each.certainty for each in readings if each.question is not None) > REFUSES:
        return []
    goals = [
        each.goal for each in readings
        if each.goal is not None and each.certainty >= least and _usable(each) and not _same(turn, each.goal, turn.last)
    ]  # fmt: skip
    return sorted(goals, key=lambda goal: bool(unsupported(turn, goal, _kind(turn, goal))))[:MOST_OFFERED]


def _no_wish(second: NetworkReading) -> float:
    """Return how certain the network is that the sentence is a remark, or asks for what cannot be built."""
    return sum(each.certainty for each in (second, *second.others) if each.answer in _NO_WISHES)


def _kind(turn: Turn, goal: Goal) -> str:
    """Return the kind of revision that leads to a goal: "new" where it has nothing of the last one."""
    goes_on = any(part in turn.last.parts or _like_one_of(part, turn.last) for part in goal.parts)
    return "edit" if goes_on else "new"


def _asks_for_it(turn: Turn, found: GoalRevision) -> bool:
    """Return whether the network is asked: not about the first instruction, nor a goal that stands in part."""
    moved = any(isinstance(part, RelationPart) and part.relation == "moved" for part in turn.last.parts)
    answerable = found.status == "ask" and bool(found.choices)
    reasoned = answerable or found.status == "unchanged" or (
        (found.status, found.kind) == ("refused", "new") and _VAGUE not in found.message
    )
    the_same = found.plain is not None and found.plain.objects_how == "replace" and _THE_SAME.search(turn.text)
    missing = found.status == "refused" and any(not one.numbers for one in turn.said.parts)  # "drop the line" of two circles
    settled = reasoned or the_same or missing or (turn.built and moved) or _drops_named_part(turn, found)
    return bool(turn.last.parts) and not settled and len(turn.text) <= _LONGEST


def _drops_named_part(turn: Turn, found: GoalRevision) -> bool:
    """Return whether a part goes that is named: "forget the circle" leaves nothing to doubt."""
    fewer = found.status == "ok" and found.plain is None and len(found.goal.parts) < len(turn.last.parts)
    return fewer and any(one.numbers for one in turn.said.parts) and not turn.said.mentions


def _doubted(turn: Turn, found: GoalRevision, second: NetworkReading) -> GoalRevision:
    """Return what the rules found, or a question where the network is certain of something else, or reads a long sentence
    in no way like them.
    """
    first = goal_after(turn, found)
    if first is None:
        return found
    certain = second.certainty >= DOUBTS
    if certain and second.goal is not None and not _same(turn, first, second.goal) and not _same(turn, second.goal, turn.last):
        question = f"{shortened(turn.text)!r} can be read in two ways: which goal is meant?"
        return _question(turn, found, question, [first, second.goal])
    remark = _no_wish(second) > REFUSES and not _PROPOSES.search(turn.text)
    if (remark or certain and second.answer in _NO_WISHES) and found.kind == "edit" and not _same(turn, first, turn.last):
        doubt = "is perhaps a remark" if second.answer == _ONLY_A_REMARK else "was not understood for certain"
        return _question(turn, found, f"{shortened(turn.text)!r} {doubt}: what is the goal now?", [first, turn.last])
    if len(turn.text.split()) >= LONG and not _same(turn, first, turn.last) and _support(turn, first, second) < LIKELY:
        others = [goal for goal in _offered(turn, second, LIKELY) if not _same(turn, goal, first)]
        question = f"{shortened(turn.text)!r} was not understood for certain: what is the goal now?"
        return _question(turn, found, question, [*others[:MOST_OFFERED], first, turn.last])
    return found


def _support(turn: Turn, goal: Goal, second: NetworkReading) -> float:
    """Return how certain the network is of a goal."""
    readings = (second, *second.others)
    return sum(each.certainty for each in readings if each.goal is not None and _same(turn, each.goal, goal))


def goal_after(turn: Turn, found: GoalRevision) -> Goal | None:
    """Return the goal after a revision that is "ok", also where it is one of a single structure's slots.

    Returns:
        The goal; `None` where only the table decides which objects take part.
    """
    plain = found.plain
    if plain is None or not turn.last.parts:
        return found.goal if plain is None else None
    if plain.kind == "new":
        read = turn.reader.read(turn.text)
        return read.goal if read.status == "ok" and read.goal.parts else None
    part = turn.last.parts[0]
    assert isinstance(part, StructurePart)  # a plain goal is one structure
    try:
        changed = revised_structure(part, plain, turn.said)
        return turn.last if changed is None else Goal((changed,))
    except (CannotApplyError, GoalError):
        return None


def _like_one_of(part: Part, last: Goal) -> bool:
    """Return whether a goal has a part of some of the same objects, of the same type."""
    pairs = [(part.objects, other.objects) for other in last.parts if type(part) is type(other)]
    return any(
        None in pair or (isinstance(pair[0], tuple) and isinstance(pair[1], tuple) and not {*pair[0]}.isdisjoint(pair[1]))
        for pair in pairs
    )


def _network_goal(turn: Turn, found: GoalRevision, second: NetworkReading) -> GoalRevision:
    goal = second.goal
    assert goal is not None
    last = turn.last.parts
    changed = tuple(n for n, part in enumerate(goal.parts) if n >= len(last) or part != last[n])
    gone = tuple(n for n, part in enumerate(last) if part not in goal.parts and n >= len(goal.parts))
    return GoalRevision(goal, "ok", "edit", "; ".join(second.notes), changed, gone)


def _question(turn: Turn, found: GoalRevision, text: str, goals: Sequence[Goal]) -> GoalRevision:
    names = turn.said.names
    options = tuple(
        AS_IT_IS if goal == turn.last else describe_parts(goal.parts, names)
        for goal in goals
    )
    return GoalRevision(
        turn.last, "ask", found.kind, text, question=Question(PART, text, options), choices=tuple(goals)
    )


def _same(turn: Turn, one: Goal, other: Goal) -> bool:
    return compare_goals(one, other, len(turn.said.objects)).exact

"""Hold the state of a conversation about a table: the goal so far, the open question, the refused wish, the history.

All goals are in the world's frame, about the objects of one scene by their indices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from grounding.edits.rules import Standing
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import Part, StructurePart
from grounding.interpretation import Interpretation
from grounding.parse_result import Question

STATUSES = ("ok", "ask", "refused", "nothing", "unchanged")


@dataclass(frozen=True)
class Dialogue:
    """The state of a conversation.

    Attributes:
        goal: what was asked for so far.
        standing: the numbers of its parts that are built.
        question: the open question, if any.
        choices: the goal behind each option of the question.
        wish: a goal that was understood but cannot be had; a next sentence may mend it.
        refused: the words of what was refused last, until something else is asked for.
        history: the goals before, each with the parts of it that were built, the latest last.
    """

    goal: Goal = Goal()
    standing: frozenset[int] = frozenset()
    question: Question | None = None
    choices: tuple[Goal, ...] = ()
    wish: Goal = Goal()
    refused: str = ""
    history: tuple[tuple[Goal, frozenset[int]], ...] = ()

    def with_goal(self, goal: Goal, changed: Sequence[int] = ()) -> Dialogue:
        """Return the state in which another goal is wanted; a part that stands and is the same still stands.

        Args:
            goal: the goal.
            changed: the numbers of parts that do not stand though they are spelled as before: a move that is repeated.
        """
        stood = [self.goal.parts[number] for number in self.standing]
        standing = frozenset(n for n, part in enumerate(goal.parts) if part in stood and n not in changed)
        return Dialogue(goal, standing, history=(*self.history, (self.goal, self.standing)))

    def asking(self, question: Question, choices: Sequence[Goal], wish: Goal = Goal()) -> Dialogue:
        """Return the state with an open question."""
        return replace(self, question=question, choices=tuple(choices), wish=wish, refused="")


@dataclass(frozen=True)
class Outcome:
    """What came of a sentence.

    Attributes:
        status: one of `STATUSES`: "ok" where another goal is wanted; "ask" where a question is open; "nothing" for a
            remark or a question about the scene; "unchanged" where it is so already.
        goal: what is wanted now: with any other status than "ok", the goal so far.
        message: why not, the question, or what has to be said of the change; may be empty.
        question: that is open.
        changed: the numbers of the parts of the goal that are new or other than before.
        dropped: the parts of the goal so far that are gone.
        reading: how the sentence was read, where it was.
    """

    status: str
    goal: Goal = Goal()
    message: str = ""
    question: Question | None = None
    changed: tuple[int, ...] = ()
    dropped: tuple[Part, ...] = ()
    reading: Interpretation | None = None


def accepted(
    state: Dialogue,
    goal: Goal,
    names: Sequence[str],
    message: str = "",
    reading: Interpretation | None = None,
    changed: Sequence[int] = (),
    spoken: bool = True,
) -> tuple[Dialogue, Outcome]:
    """Return the state in which a goal is wanted, and say what it adds and what it takes the place of.

    Args:
        state: before.
        goal: the goal.
        names: of the scene's objects.
        message: what else has to be said.
        reading: how the sentence was read.
        changed: parts that are wanted anew though they are spelled as before.
        spoken: whether the speaker's directions are the world's.
    """
    if goal.canonical() == state.goal.canonical() and not changed:
        return state, Outcome("unchanged", state.goal, "that is already so", reading=reading)
    new = state.with_goal(goal, changed)
    others = tuple(n for n, part in enumerate(goal.parts) if part not in state.goal.parts or n in changed)
    dropped = _dropped(state, goal)
    said = _replaced(state, goal, dropped, names, spoken)
    outcome = Outcome("ok", goal, "; ".join(filter(None, (message, said))), None, others, dropped, reading)
    return new, outcome


def decline(state: Dialogue) -> Dialogue:
    """Return the state without its question; the goal stays."""
    return replace(state, question=None, choices=(), wish=Goal())


def forget(state: Dialogue) -> Dialogue:
    """Return the state in which nothing is wanted; what was wanted is history."""
    return Dialogue(history=(*state.history, (state.goal, state.standing)))


def back(state: Dialogue) -> tuple[Dialogue, Outcome]:
    """Return the state before the last goal: "forget that"; an open question, or a refused wish, is dropped alone."""
    if state.question is not None:
        return decline(state), Outcome("unchanged", state.goal, "the question is dropped, and the goal stays as it was")
    if state.wish.parts or state.refused:
        said = "the refused instruction is dropped, and the goal stays as it was"
        return replace(state, wish=Goal(), refused=""), Outcome("unchanged", state.goal, said)
    if not state.history:
        return state, Outcome("refused", state.goal, "there is nothing to undo; say what to build")
    goal, standing = state.history[-1]
    before = Dialogue(goal, standing, history=state.history[:-1])
    dropped = tuple(part for part in state.goal.parts if part not in goal.parts)
    changed = tuple(n for n, part in enumerate(goal.parts) if part not in state.goal.parts)
    return before, Outcome("ok", goal, "as it was before", changed=changed, dropped=dropped)


def built(state: Dialogue) -> Dialogue:
    """Return the state in which all that was asked for stands."""
    return replace(state, standing=frozenset(range(len(state.goal.parts))))


def standing_parts(state: Dialogue, stands: Sequence[Standing]) -> list[Standing]:
    """Return what is known of each part: the slots that were shown, and whether it stands."""
    shown = [stands[n] if n < len(stands) else Standing() for n in range(len(state.goal.parts))]
    return [replace(one, stood=n in state.standing) for n, one in enumerate(shown)]


def _dropped(state: Dialogue, goal: Goal) -> tuple[Part, ...]:
    """Return the parts that are still to be built of the goal so far and have no successor in another goal."""
    left = [part for part in goal.parts if part not in state.goal.parts]
    gone = list[Part]()
    for number, part in enumerate(state.goal.parts):
        if part in goal.parts or number in state.standing:
            continue
        heir = next((one for one in left if _follows(one, part)), None)
        if heir is None:
            gone.append(part)
        else:
            left.remove(heir)
    return tuple(gone)


def _follows(one: Part, part: Part) -> bool:
    """Return whether a part is another form of one: of the same kind, with the same name or objects."""
    if type(one) is not type(part):
        return False
    name = "shape" if isinstance(one, StructurePart) else "relation"
    return one.objects == part.objects or getattr(one, name) == getattr(part, name)


def _replaced(state: Dialogue, goal: Goal, dropped: Sequence[Part], names: Sequence[str], spoken: bool) -> str:
    """Say which parts of the goal so far are gone."""
    if not dropped:
        return ""
    if not spoken:
        dropped = _turned(state, dropped)
    listed = "; ".join(describe_part(part, names) for part in dropped)
    if not any(part in state.goal.parts for part in goal.parts):
        return f"this replaces {listed}; say “also …” to keep both"
    return f"no longer wanted: {listed}"


def _turned(state: Dialogue, parts: Sequence[Part]) -> list[Part]:
    turned = state.goal.turned().parts
    return [turned[state.goal.parts.index(part)] for part in parts]

"""Take a sentence of a conversation: an answer, a way back, what needs arithmetic, an instruction or a correction."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from grounding.dialogue.answers import NO, bare_words, chosen_options
from grounding.dialogue.state import Dialogue, Outcome, accepted, back, decline, standing_parts
from grounding.edits.rules import Edit, Standing, edited
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import renumbered
from grounding.goals.parts import GoalError, StructurePart
from grounding.goals.taken_objects import without_placed
from grounding.interpretation import Interpretation
from grounding.parse_result import Question, shortened
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.resolve.attributes import SceneObject
from grounding.verify.contradictions import contradiction
from grounding.verify.feasibility import infeasible
from grounding.viewpoint import spoken_across

GOAL = "goal"  # what a question asks for whose options are goals
_BACK = re.compile(
    r"(?:(?:no|ok|okay|oh|hmm|actually|please|well|sorry|wait|on second thoughts?)[ ,]+)*(?:undo(?: that| it)?"
    r"|(?:forget|scrap|ignore|cancel) (?:that|it|this|the last one)|never ?mind(?: that)?|as it was(?: before)?"
    r"|(?:put|make) it (?:back )?(?:as|how) it was(?: before)?|take that "
    r"back|leave it (?:as it was|out after all))(?:[ ,]+(?:please|again|then))*[ .!]*",
    re.IGNORECASE,
)
_DENIAL = re.compile(r"(?:no|nope|nah|neither|not that)\b", re.IGNORECASE)


class Reader(Protocol):
    """What reads sentences: `grounding.interpreter.Interpreter`."""

    viewpoint: str
    encoder: SentenceEncoder

    def interpret(self, text: str, objects: Sequence[SceneObject], before: Goal = Goal()) -> Interpretation:
        """Interpret an instruction, or what is said about a goal."""


def say(
    state: Dialogue, text: str, reader: Reader, objects: Sequence[SceneObject], stands: Sequence[Standing] = ()
) -> tuple[Dialogue, Outcome]:
    """Take a sentence.

    Args:
        state: of the conversation.
        text: what is said.
        reader: reads it, and knows whose left and right it speaks of.
        objects: of the scene.
        stands: what the arrangement that was shown realises of each part of the goal, in the world's frame.

    Returns:
        The state afterwards, and what came of it. Where nothing came of it, an open question stays open.
    """
    names = [one.name for one in objects]
    if _BACK.fullmatch(text.strip()):
        return back(state)
    if state.question is not None:
        if bare_words(text) in NO:
            return decline(state), Outcome("unchanged", state.goal, "the goal stays as it was")
        options = chosen_options(text, state.question, state.choices, objects, reader.encoder)
        if len(options) == 1:
            return answer(state, options[0], names, reader.viewpoint)
        if options:
            return _narrowed(state, options)
    edit = _edit(state, text, reader, objects, stands)
    if edit is not None and edit.goals and (edit.computed or len(edit.goals) == 1):
        return _edited(state, text, edit, reader, names)
    found = _read(state, text, reader, objects)
    if found.status == "ok":
        message = "; ".join(dict.fromkeys(filter(None, (found.message, *found.notes))))
        # With a question open, to say the goal so far again is to stay with it.
        again = range(len(state.goal.parts)) if state.question is not None and found.goal == state.goal else ()
        return accepted(state, found.goal, names, message, found, tuple(again), reader.viewpoint == "robot")
    if edit is not None and (edit.goals or found.status == "refused"):
        return _edited(state, text, edit, reader, names)
    return _not_taken(state, text, found, reader, objects)


def answer(state: Dialogue, option: int, names: Sequence[str], viewpoint: str = "robot") -> tuple[Dialogue, Outcome]:
    """Answer the open question by the number of an option, from 0.

    Raises:
        IndexError: for an option that the question does not have.
        ValueError: if no question is open.
    """
    if state.question is None:
        raise ValueError("there is no question to answer")
    if not 0 <= option < len(state.choices):
        raise IndexError(f"there is no option {option + 1}; legal: 1 to {len(state.choices)}")
    return accepted(state, state.choices[option], names, spoken=viewpoint == "robot")


def _narrowed(state: Dialogue, options: Sequence[int]) -> tuple[Dialogue, Outcome]:
    """Ask the open question again, with those options alone that an answer leaves."""
    assert state.question is not None  # the caller has looked
    left = tuple(state.question.options[number] for number in options)
    question = replace(state.question, text=f"which of these is meant: {'; or: '.join(left)}?", options=left)
    new = state.asking(question, [state.choices[number] for number in options], state.wish)
    return new, Outcome("ask", state.goal, question.text, question)


def _edit(
    state: Dialogue, text: str, reader: Reader, objects: Sequence[SceneObject], stands: Sequence[Standing]
) -> Edit | None:
    """Return what becomes of the goal that the sentence speaks of by arithmetic, in the world's frame."""
    opposite = reader.viewpoint == "opposite"
    known = standing_parts(state, stands)
    goal, fresh = state.goal, list[int]()
    if state.question is not None and len(state.choices) == 1:
        goal, known = state.choices[0], []
        fresh = [number for number, part in enumerate(goal.parts) if part not in state.goal.parts]
    if opposite:
        text = spoken_across(text)
        goal, known = goal.turned(), [replace(one, slots=one.slots.turned()) for one in known]
    edit = edited(goal, text, objects, known, fresh)
    return replace(edit, goals=tuple(one.turned() for one in edit.goals)) if edit is not None and opposite else edit


def _edited(state: Dialogue, text: str, edit: Edit, reader: Reader, names: Sequence[str]) -> tuple[Dialogue, Outcome]:
    spoken = reader.viewpoint == "robot"
    both = zip(edit.goals, edit.changed, strict=True)
    possible = [(one, changed) for one, changed in both if not _impossible(one, names)]
    if not possible:
        why = edit.message or (_impossible(edit.goals[0], names) if edit.goals else "")
        return _still_open(state, Outcome("refused", state.goal, f"{shortened(text)!r} cannot be done: {why}"))
    if len(possible) == 1:
        goal, changed = possible[0]
        return accepted(state, goal, names, changed=changed, spoken=spoken)
    return _asked(state, f"what does {shortened(text)!r} mean", [one for one, _ in possible], names, spoken)


def _asked(
    state: Dialogue, which: str, goals: Sequence[Goal], names: Sequence[str], spoken: bool
) -> tuple[Dialogue, Outcome]:
    """Ask which of some whole goals is meant."""
    options = tuple(describe_parts((one if spoken else one.turned()).parts, names) for one in goals)
    question = Question(GOAL, f"{which}: {'; or: '.join(options)}?", options)
    return state.asking(question, goals), Outcome("ask", state.goal, question.text, question)


def _impossible(goal: Goal, names: Sequence[str]) -> str:
    """Say why a goal cannot be had with the objects that are there; "" where it can."""
    if clash := contradiction(goal, names):
        return f"{clash} cannot both hold"
    return infeasible(goal, names)


def _read(state: Dialogue, text: str, reader: Reader, objects: Sequence[SceneObject]) -> Interpretation:
    """Read a sentence after each goal that it may speak of: one that was read back, a refused wish, the goal so far."""
    opened = state.choices if state.question is not None and state.question.slot == GOAL else ()
    befores = [*opened, *((state.wish,) if state.wish.parts else ()), state.goal]
    if _DENIAL.match(text.strip()):
        befores.reverse()  # "no, ..." is not about what was offered
    found = [reader.interpret(text, objects, before) for before in dict.fromkeys(befores)]
    sure = [one for one in found if one.status == "ok"]
    if sure:
        return max(sure, key=lambda one: one.probability)
    if state.refused:
        joined = reader.interpret(f"{state.refused.rstrip(' .!')}. {text}", objects, state.goal)
        if joined.status == "ok":
            return joined
    return max(found, key=lambda one: (one.status == "ask" and bool(one.choices), one.status == "ask", one.probability))


def _not_taken(
    state: Dialogue, text: str, found: Interpretation, reader: Reader, objects: Sequence[SceneObject]
) -> tuple[Dialogue, Outcome]:
    """Ask or refuse; a whole instruction that fits no goal so far may take its place, or come in addition to it."""
    names, spoken = [one.name for one in objects], reader.viewpoint == "robot"
    if state.goal.parts:
        alone = reader.interpret(text, objects)
        repeated = found.unchanged or all(part in state.goal.parts for part in alone.goal.parts)
        if alone.status == "ok" and repeated:  # a wish that is repeated is proposed anew
            again = [number for number, part in enumerate(state.goal.parts) if part in alone.goal.parts]
            if alone.goal != state.goal:
                again = [number for number in again if number not in state.standing]
            return accepted(state, state.goal, names, alone.message, alone, again, spoken)
        if alone.status == "ok" and not found.choices:
            if len(state.standing) == len(state.goal.parts):
                return accepted(state, alone.goal, names, alone.message, alone, (), spoken)
            goals = [alone.goal, *((both,) if (both := _added(state.goal, alone.goal, names)) is not None else ())]
            return _asked(state, "should this be built instead, or as well", goals, names, spoken)
    if found.status == "ask" and found.question is not None and found.choices:
        open_shape = _open_goal(found) if found.question.slot == "shape" else Goal()
        new = state.asking(found.question, found.choices, open_shape)
        return new, Outcome("ask", state.goal, found.message, found.question, reading=found)
    if found.nothing:
        return _still_open(state, Outcome("nothing", state.goal, found.message, reading=found))
    if found.unchanged:
        return state, Outcome("unchanged", state.goal, found.message, reading=found)
    new = replace(state, wish=found.wish if found.wish.parts else state.wish, refused=text)
    return _still_open(new, Outcome("refused", state.goal, found.message, reading=found))


def _still_open(state: Dialogue, outcome: Outcome) -> tuple[Dialogue, Outcome]:
    """Return an outcome that says which question is still open."""
    if state.question is None:
        return state, outcome
    message = "; ".join(filter(None, (outcome.message, f"still open: {state.question.sentence}")))
    return state, replace(outcome, message=message, question=state.question)


def _open_goal(found: Interpretation) -> Goal:
    """Return the goal whose shape is asked for, without one."""
    part = found.choices[0].parts[0]
    assert isinstance(part, StructurePart)
    return Goal((replace(part, shape=None),))


def _added(goal: Goal, new: Goal, names: Sequence[str]) -> Goal | None:
    """Return a goal with the parts of another one in addition; `None` where both cannot be had.

    Where they contradict each other, what was said last counts for its objects.
    """
    moved = {one for part in new.parts if isinstance(part.objects, tuple) for one in part.objects}
    for stays in (goal, without_placed(goal, moved)):
        place = {number: number + len(stays.parts) for number in range(len(new.parts))}
        try:
            both = Goal((*stays.parts, *(renumbered(part, place) for part in new.parts)))
        except GoalError:
            continue
        if not _impossible(both, names):
            return both
    return None

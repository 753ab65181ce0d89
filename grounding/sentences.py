"""Say why a text is refused, what is asked about it, and what was perhaps lost: sentences that a user can act on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.decide import BUILD, LEAST_ASKED, OFFER, Decision
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.parse_result import Question, shortened
from grounding.propose.proposal import Proposal
from grounding.resolve.tokens import words_of
from grounding.spec import SHAPES
from grounding.verify.feasibility import infeasible
from grounding.verify.wording import listed, worded_goal, worded_objects

GOAL = "goal"  # what a question asks for whose options are goals


def shape_question(goal: Goal, names: Sequence[str] | None) -> tuple[Question, tuple[Goal, ...]] | None:
    """Return the question which shape is meant, of a goal that says nothing but its objects; else `None`.

    Args:
        goal: the goal.
        names: of the scene's objects; `None` where no scene is known.

    Returns:
        The question, and the goal behind each of its options, those alone for which there are enough objects.
    """
    if not goal.is_open:
        return None
    goals = {shape: Goal((replace(goal.structures[0], shape=shape),)) for shape in SHAPES}
    if names is not None:
        goals = {shape: one for shape, one in goals.items() if not infeasible(one, names)}
    options = tuple(goals)
    return Question("shape", f"which shape should it be: {', '.join(options)}?", options), tuple(goals.values())


def goal_question(text: str, decision: Decision, names: Sequence[str] | None) -> Question:
    """Return the question of a decision to ask: which objects, or which goal, is meant."""
    if not decision.offered:
        assert decision.chosen is not None and decision.chosen.proposal.question is not None
        return decision.chosen.proposal.question
    options = tuple(describe_parts(goal.parts, names) for goal in decision.offered)
    if decision.probability >= BUILD and decision.chosen is not None and decision.chosen.lost:
        why = f"this may leave out {listed(list(map(repr, decision.chosen.lost)))} of {shortened(text)!r}"
    elif decision.probability < OFFER:
        why = f"{shortened(text)!r} does not say clearly which objects or which place it means"
    else:
        why = f"it is not clear what {shortened(text)!r} means"
    chosen = Proposal() if decision.chosen is None else decision.chosen.proposal
    notes = chosen.notes if len(options) == 1 else chosen.worded.unheld if chosen.worded is not None else ()
    why += f" ({'; '.join(notes)})" if notes else ""
    which = "is this meant" if len(options) == 1 else "which of these is meant"
    return Question(GOAL, f"{why}: {which}: {'; or: '.join(options)}?", options)


def reason(text: str, decision: Decision, proposals: Sequence[Proposal], names: Sequence[str] | None) -> str:
    """Return why a text is refused, with a sentence that would work instead."""
    said, likeliest = shortened(text), max(proposals, key=lambda each: each.certainty, default=Proposal())
    chosen = decision.chosen
    instead = f"say {worded_goal(decision.offered[0], names)!r}" if decision.offered else _help(names)
    if problem := _problem(likeliest, proposals):
        return f"{said!r} cannot be built: {problem}"
    nothing = (
        f"{said!r} does not ask for an arrangement of objects that can be built ({', '.join(SHAPES)}, a figure "
        "such as a heart or a letter T, or a place)"
    )
    if likeliest.answer == "nothing":
        return f"{nothing}; {_help(names)}"
    if likeliest.answer == "unclear":
        return f"{said!r} does not say clearly which objects or which place it means; name them, or {instead}"
    if chosen is not None and chosen.proposal.goal is not None and _is_part(chosen.lost, text):
        rest = worded_goal(chosen.proposal.goal, names)
        return f"{listed(list(map(repr, chosen.lost)))} in {said!r} cannot be built; leave it out: say {rest!r}"
    if likeliest.answer:
        return f"{nothing}; {instead}"
    return f"it is not clear what {said!r} means; {instead}"


def _is_part(lost: Sequence[str], text: str) -> bool:
    """Return whether some words are lost, and not the whole text."""
    return bool(lost) and not {word for word in words_of(text) if word[0].isalnum()} <= set(words_of(" ".join(lost)))


def _problem(likeliest: Proposal, proposals: Sequence[Proposal]) -> str:
    """Return why the likeliest goal cannot be had, or "".

    Where no goal is likely, that of an unlikely one would be no reason, unless it is that nothing here is what was
    said.
    """
    first = next((each for each in proposals if not each.answer), likeliest)
    doubted = likeliest.answer == "unclear" and first.certainty >= LEAST_ASKED
    likely = first.certainty >= OFFER or first.absent or doubted or not likeliest.answer
    return first.problem if likely and likeliest.answer != "nothing" else ""


def _help(names: Sequence[str] | None) -> str:
    """Return an example of what can be said here."""
    here = list(range(len(names or ())))
    if names is None or not all(names):
        return "say what should go where, for example 'stack the cans on the left'"
    if len(here) < 2:
        return (
            f"say where it should stand, for example {f'put {worded_objects(here, names)} on the left'!r}"
            if here
            else "there is nothing here"
        )
    return (
        "say what should go where, for example "
        f"{f'put {worded_objects(here[:1], names)} next to {worded_objects(here[-1:], names)}'!r}"
    )


def doubts(lost: Sequence[str]) -> tuple[str, ...]:
    """Return a note on the words of which a goal that is built may hold nothing."""
    return (f"this may ignore {listed(list(map(repr, lost)))}; say it another way if it matters",) if lost else ()

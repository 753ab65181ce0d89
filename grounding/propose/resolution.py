"""Find the objects of a scene that a goal in words speaks of, and what is in the way of having it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

from grounding.goals.goal import Goal
from grounding.goals.taken_objects import without_taken
from grounding.propose.proposal import Proposal, WordedGoal
from grounding.resolve.attributes import SceneObject
from grounding.resolve.errors import AbsentError, ResolveError, UnclearObjectsError
from grounding.resolve.goal import resolve_goal
from grounding.resolve.referents import Referents
from grounding.verify.contradictions import contradiction
from grounding.verify.feasibility import infeasible
from grounding.verify.said_groups import unknown_group

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

MOST_ANSWERS = 12  # to a question; whoever speaks of more objects than that has to name them


def resolved(
    worded: WordedGoal,
    text: str,
    objects: Sequence[SceneObject] | None,
    encoder: SentenceEncoder | None,
    catalogue: bool = False,
    opposite: bool = False,
) -> Proposal:
    """Return a goal in words as a goal about the objects of a scene.

    Args:
        worded: the goal.
        text: whose words it has.
        objects: that are there; `None` where no scene is known: then the words stand for them.
        encoder: finds what unknown nouns mean.
        catalogue: whether they are a library that a scene can be drawn from.
        opposite: whether the speaker sits across the table.
    """
    if worded.answer or worded.problem:
        return Proposal(certainty=worded.certainty, answer=worded.answer, problem=worded.problem)
    there = Referents(objects, encoder, catalogue, opposite)
    try:
        heard = f"{worded.about} {text}".strip()
        found = resolve_goal(worded.parts, there, heard, worded.kept, worded.known, worded.before)
    except UnclearObjectsError as doubt:
        phrase = doubt.phrase
        if phrase in worded.known:  # which one was said, and it is still in doubt
            return Proposal(certainty=worded.certainty, question=doubt.question)
        asked = _asked(worded, doubt, there.names, lambda known: resolved(
            replace(worded, known={**worded.known, phrase: known}), text, objects, encoder, catalogue, opposite
        ))  # fmt: skip
        return replace(asked, absent=doubt.absent)
    except ResolveError as error:
        return Proposal(certainty=worded.certainty, problem=str(error), absent=isinstance(error.__cause__, AbsentError))
    goal = without_taken(found.goal, worded.before)
    names = None if objects is None or catalogue else there.names
    problem = f"{clash} cannot both hold" if (clash := contradiction(goal, names)) else ""
    if group := unknown_group(text, worded.phrases, (goal, worded.before)):
        problem = f"it is not clear which objects {group!r} means"
    if names is not None and not problem:
        problem = infeasible(goal, names)
    return Proposal(
        goal, worded.certainty, problem=problem, nouns=found.nouns, described=found.described,
        notes=(*found.notes, *worded.unheld),
        singly=found.singly, worded=worded,
    )  # fmt: skip


def _asked(
    worded: WordedGoal, doubt: UnclearObjectsError, names: Sequence[str], chosen: Callable[[tuple[int, ...]], Proposal]
) -> Proposal:
    """Return a proposal that asks which object is meant, with those answers alone that can be had here.

    Args:
        worded: the goal in words.
        doubt: words that several objects fit.
        names: of the scene's objects.
        chosen: resolves the goal with these words standing for some objects.
    """
    said = [text for part in worded.parts for key in ("objects", "reference", "around") for text in part.get(key) or ()]
    question, kept = doubt.question, dict[str, Goal]()
    possible = (
        combinations(doubt.indices, doubt.count) if math.comb(len(doubt.indices), doubt.count) <= MOST_ANSWERS else ()
    )
    for indices in possible if doubt.phrase in said else ():
        one, name = chosen(indices), ", ".join(names[index] for index in indices)
        if one.goal is not None and not one.problem:
            kept[name] = one.goal
        elif one.question is not None and one.choices:  # other words can be each of several, too
            kept |= {f"{name}, {other}": goal for other, goal in zip(one.question.options, one.choices, strict=True)}
            question = replace(
                question, text=f"{doubt.question.text.removesuffix('; which one?')}; and {one.question.text}"
            )
    if not 0 < len(kept) <= MOST_ANSWERS:
        return Proposal(certainty=worded.certainty, question=doubt.question)
    question = replace(question, options=tuple(kept))
    return Proposal(certainty=worded.certainty, question=question, choices=tuple(kept.values()))

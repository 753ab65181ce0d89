"""Read a language model's reply to an instruction, and check that its goal can be had."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grounding.figures.drawings import DRAWING, drawing_shape, without_drawings
from grounding.figures.figure import FigureError
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.language_model.goal_schema import ASK, BUILD, DECISIONS, REFUSE
from grounding.parse_result import shortened
from grounding.parsers.llm_json import json_object, shares_secret
from grounding.parsers.llm_reply import readable
from grounding.resolve.figure_names import checked_name
from grounding.structure_words import is_shape
from grounding.verify.contradictions import contradiction
from grounding.verify.feasibility import infeasible

MOST_OPTIONS = 4  # more are no question that a person reads
MOST_CHARACTERS = 400  # of a question or a reason


@dataclass(frozen=True)
class ModelReply:
    """What a language model makes of an instruction.

    Attributes:
        decision: "build", "ask", "refuse" or "none"; the last for a remark, or a question about the scene.
        goal: the whole goal after the instruction, in the speaker's frame, with indices of the scene's objects, or
            words where no scene is known; `None` unless the decision is "build". It is legal and feasible.
        question: one sentence; empty unless the decision is "ask".
        options: the answers that are offered: goals like `goal`, or words.
        reason: why it is refused, or what is to be said of a remark; may be empty.
    """

    decision: str
    goal: Goal | None = None
    question: str = ""
    options: tuple[Goal | str, ...] = ()
    reason: str = ""


def read_reply(
    content: str, names: Sequence[str] | None, secrets: Collection[str] = (), drawn: Mapping[str, str] = {}
) -> ModelReply:
    """Read a reply: one JSON object, whatever is around it.

    Args:
        content: what the model said.
        names: of the scene's objects, by index; `None` where no scene is known.
        secrets: what no message may hold, in any spelling.
        drawn: noun -> shape of what the model drew before.

    Raises:
        ValueError: for a reply that is not legal, or whose goal cannot be had; the message is a sentence for the model.
    """
    said = json_object(content)
    decision = said.get("decision")
    if decision not in DECISIONS:
        raise ValueError(f"its decision is none of {', '.join(DECISIONS)}")
    question, reason = (_sentence(said.get(key), secrets) for key in ("question", "reason"))
    if decision == BUILD:
        return ModelReply(decision, _goal(said.get("goal"), names, secrets, drawn), reason=reason)
    if decision == ASK:
        if not question:
            raise ValueError("its decision is ask, but it has no question")
        return ModelReply(decision, question=question, options=_options(said.get("options"), names, secrets, drawn))
    if decision == REFUSE and not reason:
        raise ValueError("its decision is refuse, but it has no reason")
    return ModelReply(decision, reason=reason)


def new_drawings(goal: Goal, drawn: Mapping[str, str]) -> tuple[str, ...]:
    """Return the shapes of a goal that are drawings, and none of before.

    Args:
        goal: the goal.
        drawn: noun -> shape of what was drawn before.
    """
    shapes = dict.fromkeys(part.shape for part in goal.structures if part.shape is not None)
    return tuple(one for one in shapes if one.startswith(DRAWING) and one not in drawn.values())


def problem_of(goal: Goal, names: Sequence[str] | None) -> str:
    """Say why a goal cannot be had; empty where it can.

    Args:
        goal: the goal, with indices; with words where `names` is `None`.
        names: of the scene's objects, by index.
    """
    wanted, called = (str, "words of the instruction, because no objects are known") if names is None else (
        int, f"indices from 0 to {len(names) - 1}"
    )  # fmt: skip
    for one in goal.named_objects():
        if not isinstance(one, wanted) or (names is not None and isinstance(one, int) and one >= len(names)):
            return f"objects are {called}, not {one!r:.40}"
    if names is not None:
        try:
            goal.resolved(len(names))
        except GoalError as error:
            return str(error)
        if problem := infeasible(goal, names):
            return problem
    both = contradiction(goal, names)
    return f"{both} cannot hold together" if both else ""


def _goal(values: Any, names: Sequence[str] | None, secrets: Collection[str], drawn: Mapping[str, str]) -> Goal:
    try:
        goal = Goal.from_dict(_without_nulls(values, drawn))
        problem = problem_of(goal, names) if goal.parts else "its decision is build, but its goal has no parts"
        problem = problem or _secret_name(goal, secrets)
    except (GoalError, FigureError) as error:
        problem = str(error)
    if problem:
        message = shortened(without_drawings(problem), MOST_CHARACTERS)
        hidden = any(shares_secret(message, each) for each in secrets)
        raise ValueError("this goal cannot be built" if hidden else message) from None
    return goal


def _without_nulls(values: Any, drawn: Mapping[str, str]) -> Any:
    """Leave out keys that say nothing: models give a relation the keys of a structure, all null."""
    if not isinstance(values, dict):
        raise GoalError("its decision is build, but it has no goal")
    if not isinstance(values.get("parts"), list):
        return values
    parts = [_said_keys(part) if isinstance(part, dict) else part for part in values["parts"]]
    return values | {"parts": [_with_drawing(part, drawn) if isinstance(part, dict) else part for part in parts]}


def _said_keys(part: dict[str, Any]) -> dict[str, Any]:
    needed = {"relation": None, "objects": None} if part.get("kind") == "relation" else {}  # missing ones are named
    return needed | {key: value for key, value in part.items() if value is not None}


def _with_drawing(part: dict[str, Any], drawn: Mapping[str, str]) -> dict[str, Any]:
    """Return a part with the shape of its drawing; without one, its name may be that of a drawing of before.

    Raises:
        FigureError: for a drawing that is not legal, or whose name something else has.
    """
    name = part.get("shape")
    if part.get("kind") != "structure" or "drawing" not in part:
        if isinstance(name, str) and name.lower() in drawn and not is_shape(name):
            return part | {"shape": drawn[name.lower()]}
        return part
    if not isinstance(name, str):
        raise FigureError(f"a drawing needs its name as the shape, not {name!r:.60}; legal: one to four words")
    try:
        noun = checked_name(name, also_taught=True)
    except FigureError as error:
        raise FigureError(f"{error}, or leave out the drawing") from error
    kept = {key: value for key, value in part.items() if key != "drawing"}
    return kept | {"shape": drawing_shape(noun, part["drawing"])}


def _secret_name(goal: Goal, secrets: Collection[str]) -> str:
    """Say that the noun of a drawing is not legal, where it repeats a secret; "" for any other."""
    nouns = [without_drawings(part.shape) for part in goal.structures if part.shape is not None]
    return "its name is not legal" if any(shares_secret(noun, each) for noun in nouns for each in secrets) else ""


def _options(
    values: Any, names: Sequence[str] | None, secrets: Collection[str], drawn: Mapping[str, str]
) -> tuple[Goal | str, ...]:
    """Return the options that can be had: a question is worth asking without the others.

    A new drawing is none: it is shown and asked about by itself.
    """
    found: list[Goal | str] = []
    for value in values if isinstance(values, list) else ():
        try:
            one = _sentence(value, secrets) if isinstance(value, str) else _goal(value, names, secrets, drawn)
        except ValueError:
            continue
        if one and one not in found and not (isinstance(one, Goal) and new_drawings(one, drawn)):
            found.append(one)
    return tuple(found[:MOST_OPTIONS])


def _sentence(value: Any, secrets: Collection[str]) -> str:
    """Return a text of the model on one line; nothing of one that repeats a secret."""
    text = shortened(readable(value), MOST_CHARACTERS) if isinstance(value, str) else ""
    return "" if any(len(each) > 3 and each.lower() in text.lower() for each in secrets) else text

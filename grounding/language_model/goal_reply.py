"""Read a language model's reply to an instruction, and check that its goal can be had."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.language_model.goal_schema import ASK, BUILD, DECISIONS, REFUSE
from grounding.parse_result import shortened
from grounding.parsers.llm_json import json_object, shares_secret
from grounding.parsers.llm_reply import readable
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


def read_reply(content: str, names: Sequence[str] | None, secrets: Collection[str] = ()) -> ModelReply:
    """Read a reply: one JSON object, whatever is around it.

    Args:
        content: what the model said.
        names: of the scene's objects, by index; `None` where no scene is known.
        secrets: what no message may hold, in any spelling.

    Raises:
        ValueError: for a reply that is not legal, or whose goal cannot be had; the message is a sentence for the model.
    """
    said = json_object(content)
    decision = said.get("decision")
    if decision not in DECISIONS:
        raise ValueError(f"its decision is none of {', '.join(DECISIONS)}")
    question, reason = (_sentence(said.get(key), secrets) for key in ("question", "reason"))
    if decision == BUILD:
        return ModelReply(decision, _goal(said.get("goal"), names, secrets), reason=reason)
    if decision == ASK:
        if not question:
            raise ValueError("its decision is ask, and it has no question")
        return ModelReply(decision, question=question, options=_options(said.get("options"), names, secrets))
    if decision == REFUSE and not reason:
        raise ValueError("its decision is refuse, and it has no reason")
    return ModelReply(decision, reason=reason)


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


def _goal(values: Any, names: Sequence[str] | None, secrets: Collection[str]) -> Goal:
    try:
        goal = Goal.from_dict(_without_nulls(values))
        problem = problem_of(goal, names) if goal.parts else "its decision is build, and its goal has no parts"
    except GoalError as error:
        problem = str(error)
    if problem:
        message = shortened(problem, MOST_CHARACTERS)
        hidden = any(shares_secret(message, each) for each in secrets)
        raise ValueError("it is not a goal that can be had" if hidden else message) from None
    return goal


def _without_nulls(values: Any) -> Any:
    """Leave out keys that say nothing: models give a relation the keys of a structure, all null."""
    if not isinstance(values, dict):
        raise GoalError("its decision is build, and it has no goal")
    if not isinstance(values.get("parts"), list):
        return values
    return values | {"parts": [_said_keys(part) if isinstance(part, dict) else part for part in values["parts"]]}


def _said_keys(part: dict[str, Any]) -> dict[str, Any]:
    needed = {"relation": None, "objects": None} if part.get("kind") == "relation" else {}  # missing ones are named
    return needed | {key: value for key, value in part.items() if value is not None}


def _options(values: Any, names: Sequence[str] | None, secrets: Collection[str]) -> tuple[Goal | str, ...]:
    """Return the options that can be had: a question is worth asking without the others."""
    found: list[Goal | str] = []
    for value in values if isinstance(values, list) else ():
        try:
            one = _sentence(value, secrets) if isinstance(value, str) else _goal(value, names, secrets)
        except ValueError:
            continue
        if one and one not in found:
            found.append(one)
    return tuple(found[:MOST_OPTIONS])


def _sentence(value: Any, secrets: Collection[str]) -> str:
    """Return a text of the model on one line; nothing of one that repeats a secret."""
    text = shortened(readable(value), MOST_CHARACTERS) if isinstance(value, str) else ""
    return "" if any(len(each) > 3 and each.lower() in text.lower() for each in secrets) else text

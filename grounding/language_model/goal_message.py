"""Put an instruction, the scene and the conversation so far into the message that a language model is sent."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, TypeAlias

from grounding.figures.drawings import without_drawings
from grounding.figures.names import figure_nouns
from grounding.goals.goal import Goal
from grounding.parsers.llm_reply import readable
from grounding.resolve.attributes import SceneObject
from grounding.resolve.object_names import UNKNOWN_CATEGORY, read_name

MOST_TURNS = 8  # the last ones; what was said before them is in the goal so far
Table: TypeAlias = tuple[tuple[float, float], tuple[float, float]]  # from and to in x and in y, metres, world frame


@dataclass(frozen=True)
class Turn:
    """A turn of the conversation.

    Attributes:
        said: by the person.
        answer: of the program, in a few words.
    """

    said: str
    answer: str


@dataclass(frozen=True)
class OpenQuestion:
    """A question that the person has not answered yet.

    Attributes:
        text: the question.
        options: the answers that were offered: goals in the speaker's frame, or words.
    """

    text: str
    options: tuple[Goal | str, ...] = ()


@dataclass(frozen=True)
class GoalMessage:
    """What a language model is told about an instruction.

    Attributes:
        text: the instruction.
        objects: of the scene; `None` where no scene is known.
        goal: so far, in the speaker's frame.
        question: that is open.
        turns: of the conversation, the oldest first.
        viewpoint: "robot" or "opposite".
        table: its extent; `None` where it is not known.
        drawn: nouns of the figures that the model drew before.
    """

    text: str
    objects: tuple[SceneObject, ...] | None
    goal: Goal = Goal()
    question: OpenQuestion | None = None
    turns: tuple[Turn, ...] = ()
    viewpoint: str = "robot"
    table: Table | None = None
    drawn: tuple[str, ...] = ()

    def to_json(self, problem: str = "") -> str:
        """Return the message; a problem of the model's first reply stands in it as "problem"."""
        asked = self.question
        values: dict[str, Any] = {
            "viewpoint": self.viewpoint,
            "table_cm": None if self.table is None else {
                axis: [_cm(value) for value in ends] for axis, ends in zip("xy", self.table, strict=True)
            },
            "objects": None if self.objects is None else list(map(_described, range(len(self.objects)), self.objects)),
            "goal": _spoken(self.goal),
            "question": None if asked is None else {
                "text": readable(asked.text),
                "options": [_spoken(one) if isinstance(one, Goal) else readable(one) for one in asked.options],
            },
            "turns": [
                {"said": readable(turn.said), "answer": readable(turn.answer)} for turn in self.turns[-MOST_TURNS:]
            ],
            "instruction": readable(self.text),
        }  # fmt: skip
        shipped = figure_nouns(taught=False)
        figures = [readable(name) for name in figure_nouns() if name not in shipped]
        further = {"figures": [*figures, *(one for one in self.drawn if one not in figures)], "problem": problem}
        return json.dumps(values | {key: value for key, value in further.items() if value}, ensure_ascii=False)


def _spoken(goal: Goal) -> dict[str, Any]:
    """Return a goal as JSON values, with the nouns of what was drawn in place of the drawings."""
    values = goal.to_dict()
    for part in values["parts"]:
        if part.get("shape"):
            part["shape"] = without_drawings(part["shape"])
    return values


def _described(index: int, one: SceneObject) -> dict[str, Any]:
    known, kind = one.attributes, read_name(one.name).head
    return {
        "index": index,
        "name": readable(one.name) or None,
        "kind": kind if kind and kind != UNKNOWN_CATEGORY else None,
        "color": known.colors[0] if known and known.colors else None,
        "size_cm": [_cm(value) for value in known.size] if known and known.size else None,
        "position_cm": [_cm(value) for value in known.position] if known and known.position else None,
        "on": None,  # what an object stands on is not known here
    }


def _cm(metres: float) -> float:
    value = round(100 * metres, 1)
    return int(value) if value == int(value) else value

"""Read instructions about the objects of one scene, in the words of the speaker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from grounding.dialogue.revise import Revision
from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_reading.reader import GoalReading
from grounding.goals.goal import Goal
from grounding.parse_result import Parse, Question
from grounding.references.attributes import SceneObject
from grounding.spec import StructureSpec


class _Interpreter(Protocol):
    """What is needed of `grounding.interpreter.Interpreter`."""

    viewpoint: str

    def interpret(
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, strictly: bool = False
    ) -> Any: ...

    def revise(self, last: StructureSpec, text: str, stands: StructureSpec | None = None) -> Revision: ...

    def continued(
        self, goal: Goal, text: str, objects: Sequence[SceneObject | str | None], about: int | None = None
    ) -> GoalReading: ...

    def corrected(
        self, goal: Goal, text: str, objects: Sequence[SceneObject | str | None]
    ) -> NetworkReading | None: ...


@dataclass(frozen=True)
class SpokenReading:
    """An interpretation whose goal is in the speaker's frame.

    Attributes:
        goal: as spoken; empty where it is refused or asked about.
        status, message, question, parse: of the interpretation.
        beyond: whether it asks for more than one structure of five slots, as far as it was understood.
        suggest: finds the goals that it may mean, as spoken, where it is refused.
    """

    goal: Goal
    status: str
    message: str
    question: Question | None
    parse: Parse
    beyond: bool
    suggest: Callable[[], tuple[Goal, ...]] = tuple


class GoalReader(Protocol):
    """Reads what the corrections of a goal are made of."""

    def read(self, text: str, strictly: bool = False) -> SpokenReading:
        """Read a whole instruction about the objects of the scene.

        Args:
            text: the instruction.
            strictly: refuse it where the grammar does not know every word; for sentences that were put together.
        """

    def revise(self, last: StructureSpec, text: str, stands: StructureSpec | None = None) -> Revision:
        """Revise one structure; see `grounding.dialogue.revise.revise`."""

    def continued(self, goal: Goal, text: str, about: int | None = None) -> Goal | None:
        """Read a sentence that adds to a goal, or says something else of its parts; `None` if it is not understood."""

    def corrected(self, goal: Goal, text: str) -> NetworkReading | None:
        """Read what is said about a goal with the network; `None` where there is no network."""


class SceneReader:
    """Reads instructions about the objects of one scene.

    Args:
        interpreter: of texts.
        objects: of the scene.
    """

    def __init__(self, interpreter: _Interpreter, objects: Sequence[SceneObject | str | None]) -> None:
        self._interpreter, self._objects = interpreter, objects

    def read(self, text: str, strictly: bool = False) -> SpokenReading:
        """Read a whole instruction; see `GoalReader.read`."""
        found = self._interpreter.interpret(text, self._objects, strictly)
        opposite = self._interpreter.viewpoint == "opposite"
        goal = found.goal.turned() if opposite else found.goal
        # Where the slots were read and are not what counts, the instruction holds more than they can.
        unused = any(found.parse.spec.to_dict().values()) and not any(found.spec.to_dict().values())
        beyond = goal.plain_spec is None if goal.parts else unused and found.status != "ok"

        def suggest() -> tuple[Goal, ...]:
            return tuple(each.turned() if opposite else each for each in found.suggestions)

        return SpokenReading(goal, found.status, found.message, found.question, found.parse, beyond, suggest)

    def revise(self, last: StructureSpec, text: str, stands: StructureSpec | None = None) -> Revision:
        """Revise one structure; see `grounding.dialogue.revise.revise`."""
        return self._interpreter.revise(last, text, stands)

    def continued(self, goal: Goal, text: str, about: int | None = None) -> Goal | None:
        """Read a sentence that adds to a goal, or says something else of its parts; `None` if it is not understood."""
        read = self._interpreter.continued(goal, text, self._objects, about)
        return read.goal if read.complete else None

    def corrected(self, goal: Goal, text: str) -> NetworkReading | None:
        """Read what is said about a goal with the network; `None` where there is no network."""
        return self._interpreter.corrected(goal, text, self._objects)

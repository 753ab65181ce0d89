"""Let the goal network propose goals in the words of a text, for an instruction or for what is said about a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.parts import UnreadLengthError, parts_of
from grounding.goal_network.writer import NetworkWriter, WrittenGoal
from grounding.goals.goal import Goal
from grounding.propose.proposal import WordedGoal
from grounding.propose.stand_ins import StandIns
from grounding.resolve.attributes import SceneObject

LIKELIEST = 5  # proposals of a text: where the first is wrong, one of the others is right for half of the texts


class NetworkProposer:
    """A proposer with the goal network, which is loaded at its first use.

    Args:
        make: makes the network.
    """

    def __init__(self, make: Callable[[], NetworkWriter]) -> None:
        self._make = make

    @cached_property
    def network(self) -> NetworkWriter:
        """Return the network."""
        return self._make()

    def propose(
        self, text: str, objects: Sequence[SceneObject] | None = None, before: Goal = Goal(), answers: bool = True
    ) -> tuple[WordedGoal, ...]:
        """Propose the likeliest goals of a text, the most certain first; none for a text that is too long.

        Args:
            text: any string.
            objects: of the scene; `None` where it is not known.
            before: the goal so far; without parts for an instruction.
            answers: whether an answer may be proposed in place of a goal.

        Raises:
            GoalNetworkError: for weights that cannot be used.
        """
        stand_ins = StandIns.of(text, before)
        spoken_of = before
        text, before = stand_ins.text(text), stand_ins.goal(before)
        if not before.parts:
            written = self.network.likeliest(text, LIKELIEST, objects, answers)
        else:
            rendition = rendition_of(before, objects or ())
            written = [
                AfterGoal(one.words, one.actions, one.certainty, rendition)
                for one in self.network.likeliest(f"{rendition.text} {text}", LIKELIEST, objects, answers)
            ]
        return tuple(_worded(one, text, stand_ins, spoken_of) for one in written)


def _worded(written: WrittenGoal, text: str, stand_ins: StandIns, before: Goal) -> WordedGoal:
    """Return a goal that the network wrote in words."""
    follows = isinstance(written, AfterGoal)
    try:
        found = parts_of(written, " ".join(written.words) if follows else text)
    except UnreadLengthError as error:
        return WordedGoal(written.certainty, problem=f"the instruction {error}")
    known, about = (written.rendition.known, written.rendition.text) if follows else ({}, "")
    parts = stand_ins.parts(found.parts)
    return WordedGoal(written.certainty, parts, found.kept, found.answer, known=known, before=before, about=about)

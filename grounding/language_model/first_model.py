"""Ask a language model before the default reader, as long as it can be used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from grounding.goals.goal import Goal
from grounding.language_model.goal_message import OpenQuestion, Turn
from grounding.parse_result import Parser
from grounding.resolve.attributes import SceneObject

if TYPE_CHECKING:
    from grounding.language_model.goal_model import GoalModel
    from grounding.language_model.goal_reply import ModelReply


@dataclass(frozen=True)
class Context:
    """What a language model is told beside a text.

    Attributes:
        before: the goal so far, in the speaker's frame.
        question: that is open.
        turns: of the conversation, the oldest first.
        drawn: noun -> shape of what it drew, and was accepted or shown, before.
    """

    before: Goal = Goal()
    question: OpenQuestion | None = None
    turns: tuple[Turn, ...] = ()
    drawn: Mapping[str, str] = field(default_factory=dict)


class FirstModel:
    """A language model that is asked first, also about what is said of a goal.

    Args:
        model: makes it; `None` asks none.
        instead: makes the parser that reads the five slots where it cannot be used; `None` raises its errors.
    """

    def __init__(self, model: Callable[[], GoalModel] | None = None, instead: Callable[[], Parser] | None = None):
        self._make, self._instead = model, instead
        self._unusable = ""  # why it is asked no more

    @property
    def is_asked(self) -> bool:
        """Return whether there is one, which can be used as far as is known."""
        return self._make is not None and not self._unusable

    @cached_property
    def _model(self) -> GoalModel | None:
        return None if self._make is None else self._make()

    def parser(self, make: Callable[[], Parser]) -> Parser:
        """Make the parser of the five slots, or that which reads instead.

        Raises:
            LLMError: for a language model that cannot be used, where nothing reads instead.
        """
        from grounding.parsers.llm_reply import LLMError

        try:
            return make()
        except LLMError as error:
            if self._instead is None:
                raise
            self._unusable = _without(error)
            return self._instead()

    def read(
        self, text: str, objects: Sequence[SceneObject] | None, context: Context, viewpoint: str
    ) -> tuple[ModelReply | None, str]:
        """Return what it makes of a text, and why the default reader reads the text instead, or "".

        Raises:
            LLMError: for a language model that cannot be used, where nothing reads instead.
        """
        from grounding.parsers.llm_reply import IllegalReplyError, LLMError

        try:
            if self._model is None:
                return None, self._unusable
            reply = self._model.read(
                text, objects, context.before, context.question, context.turns, viewpoint, drawn=context.drawn
            )
        except LLMError as error:
            if self._instead is None:
                raise
            reason = _without(error)
            if not isinstance(error, IllegalReplyError):  # it will not answer to the next text either
                self.__dict__["_model"], self._unusable = None, reason
            return None, reason
        return reply, ""


def _without(error: Exception) -> str:
    return f"the language model cannot be used ({error}); the default parser read this instead"

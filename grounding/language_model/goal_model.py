"""Read instructions and corrections with a language model behind an OpenAI-compatible address."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from grounding.goals.goal import Goal
from grounding.language_model.goal_message import GoalMessage, OpenQuestion, Table, Turn
from grounding.language_model.goal_reply import ModelReply, read_reply
from grounding.language_model.goal_schema import reply_schema
from grounding.parsers.llm_endpoint import EndpointLLM
from grounding.parsers.llm_reply import IllegalReplyError
from grounding.resolve.attributes import SceneObject, scene_objects
from prompts import load_prompt

PROMPT = "read_goal"
MAX_ANSWER_TOKENS = 4000  # twelve parts with every key, and two options of a question
MAX_TEXT = 4000  # characters of an instruction


class GoalModel:
    """A chat model that is asked what an instruction means.

    Args:
        endpoint: the model.
    """

    def __init__(self, endpoint: EndpointLLM) -> None:
        self.endpoint = endpoint
        self.identity = endpoint.identity
        self._prompt = load_prompt(PROMPT).strip()

    @property
    def takes_schema(self) -> bool:
        """Return whether the server is asked with a schema: it is until it refuses one."""
        return "response_format" in self.endpoint.dialect.keys

    def read(
        self,
        text: str,
        objects: Sequence[SceneObject | str | None] | None,
        goal: Goal = Goal(),
        question: OpenQuestion | None = None,
        turns: Sequence[Turn] = (),
        viewpoint: str = "robot",
        table: Table | None = None,
        drawn: Mapping[str, str] = {},
    ) -> ModelReply:
        """Read what is said; a reply that is not legal, or whose goal cannot be had, is told to the model once.

        Args:
            text: an instruction, a correction, or an answer to the question, in any language.
            objects: what is there; `None` where no scene is known.
            goal: so far, in the speaker's frame, with indices of the objects.
            question: that is open.
            turns: of the conversation, the oldest first.
            viewpoint: one of `grounding.viewpoint.VIEWPOINTS`.
            table: its extent.
            drawn: noun -> shape of what it drew before.

        Raises:
            LLMError: for a server that cannot be used; an `IllegalReplyError` where that concerns this text alone.
        """
        if len(text) > MAX_TEXT:
            raise IllegalReplyError(
                f"the language model was not asked, because the instruction has more than {MAX_TEXT} characters"
            )
        there = scene_objects(objects)
        message = GoalMessage(text, there, goal, question, tuple(turns), viewpoint, table, tuple(drawn))
        names = None if there is None else [one.name for one in there]
        return self.endpoint.ask_json(
            [{"role": "system", "content": self._prompt}, {"role": "user", "content": message.to_json()}],
            ("reply", reply_schema(None if there is None else len(there))),
            MAX_ANSWER_TOKENS,
            lambda content: read_reply(content, names, self.endpoint.secrets, drawn),
            message.to_json,
        )

"""A language model that draws: a real server on this machine that answers sentences as a script says."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from tests.grounding.language_model.oracle import MODEL

NOTHING = {"decision": "none", "goal": None, "question": None, "options": [], "reason": None}
SAILBOAT = {"strokes": [[[0, 1], [1, 0], [3, 0], [4, 1], [0, 1]], [[2, 1], [2, 4], [3.5, 2]]], "least": 7}
HOOK = {"strokes": [[[0, 3], [0, 0], [2, 0], [2, 1]]], "least": 4}


def drawn(name: str, drawing: Any, **more: Any) -> dict[str, Any]:
    """The part of a goal that has a drawing."""
    return {"kind": "structure", "shape": name, "objects": None, "drawing": drawing} | more


def build(*parts: dict[str, Any]) -> dict[str, Any]:
    """The reply that builds some parts."""
    return NOTHING | {"decision": "build", "goal": {"parts": list(parts)}}


class Artist:
    """A server's answers, for `serving_oracle`.

    Attributes:
        script: sentence -> its reply, or what makes it of the message; other sentences are remarks.
        messages: that it was sent, in their order.
    """

    def __init__(self, script: Mapping[str, dict | Callable[[Mapping], dict]]) -> None:
        self.script, self.messages, self.url = script, list[dict](), ""

    def answer(self, body: Mapping, headers: Mapping) -> tuple[int, dict]:
        """The status and the JSON of an answer to a request."""
        message = json.loads(body["messages"][-1]["content"])
        self.messages.append(message)
        reply = self.script.get(message["instruction"], NOTHING)
        said = json.dumps(reply(message) if callable(reply) else reply)
        return 200, {"model": MODEL, "choices": [{"message": {"content": said}, "finish_reason": "stop"}]}

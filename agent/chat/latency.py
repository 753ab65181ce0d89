"""Measure how soon the chat reacts to a line and proposes, for `structagent evaluate chat`.

The lines are an instruction and corrections of it, after one line that warms up. "reaction" is the time from Enter
until words are shown, "proposal" the time until the ranked arrangements are shown. The time that a terminal needs to
draw is not included.
"""

from __future__ import annotations

import io
import re
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from agent.event_base import Event

_CORRECTIONS = ("bigger", "now as a line", "on the right", "smaller", "now as a circle", "on the left")
_CONTROL, _WORD = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]"), re.compile(r"[^\W\d_]{3,}")

Result = dict[str, Any]


class _Watched(io.StringIO):
    """A terminal that records when words were first written to it."""

    first: float | None = None

    def write(self, text: str) -> int:
        if self.first is None and _WORD.search(_CONTROL.sub("", text)):
            self.first = time.perf_counter()
        return super().write(text)

    def isatty(self) -> bool:
        return True


def measure(runs: int, scene: str = "simulated", model: str = "diffusion") -> Result:
    """Measure the median seconds to the reaction and to the proposal.

    Args:
        runs: the number of lines, not counting the one that warms up.
        scene: as for `structagent chat --scene`.
        model: as for `--model`.

    Raises: the errors of the conversation.
    """
    import torch
    from rich.console import Console

    from agent import events
    from agent.chat.conversation import Conversation
    from agent.chat.input import PlainLines
    from agent.chat.repl import Chat
    from agent.chat.view import ChatScreen
    from agent.errors import NotBuildable
    from agent.pipeline.resources import ResourceCache
    from agent.pipeline.run import RunOptions

    torch.set_num_threads(1)  # as in a chat
    screen_file = _Watched()
    screen = ChatScreen(Console(file=screen_file, force_terminal=True, width=100))
    proposed: list[float] = []

    class ProposalTimes:
        def on_event(self, event: Event) -> None:
            if isinstance(event, events.Proposed):
                proposed.append(time.perf_counter())

    reactions: list[float] = []
    proposals: list[float] = []
    options, folder = RunOptions(scene, model=model), tempfile.TemporaryDirectory()
    with folder as out, Conversation(options, ResourceCache(), [screen, ProposalTimes()]) as conversation:
        example = conversation.example()
        if example is None:
            raise NotBuildable(f"nothing can be built from the objects on the table of {scene!r}")
        lines = PlainLines(io.StringIO(), screen_file.write)
        chat = Chat(conversation, screen, lines, Path(out) / "session.jsonl")
        said = [example.text, *(_CORRECTIONS[run % len(_CORRECTIONS)] for run in range(runs))]
        for line in said:
            screen_file.first = None
            proposed.clear()
            began = time.perf_counter()
            chat.handle(line)
            if not proposed or screen_file.first is None:
                raise NotBuildable(f"{line!r} did not end in a proposal")
            reactions.append(screen_file.first - began)
            proposals.append(proposed[0] - began)
    return {
        "scene": scene,
        "model": model,
        "runs": runs,
        "reaction_seconds_median": statistics.median(reactions[1:]),
        "proposal_seconds_median": statistics.median(proposals[1:]),
        "proposal_seconds_max": max(proposals[1:]),
    }

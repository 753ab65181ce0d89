"""Conversations that are held side by side, so that the goal network reads what is said in all of them at once."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

from grounding.dialogue.state import Dialogue
from grounding.dialogue.turns import say
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.interpreter import Interpreter
from grounding.resolve.attributes import SceneObject

Found = TypeVar("Found")
# Yields what it passes to `say` next, (state, text, objects, what stands), and returns what became of it.
Conversation = Generator[tuple[Dialogue, str, Sequence[SceneObject], Sequence[Any]], None, Found]


class _Needed(Exception):
    """What has to be read first."""


class ReadBefore:
    """A reader that knows what was read, and raises `_Needed` for anything else."""

    def __init__(self, interpreter: Interpreter) -> None:
        self.viewpoint, self.encoder, self._interpreter = interpreter.viewpoint, interpreter.encoder, interpreter
        self._known: dict[tuple[str, int, Goal], Interpretation] = {}

    def interpret(self, text: str, objects: Sequence[SceneObject], before: Goal = Goal()) -> Interpretation:
        if (text, id(objects), before) not in self._known:
            raise _Needed(text, objects, before)
        return self._known[text, id(objects), before]

    def read(self, needed: Sequence[tuple[str, Sequence[SceneObject], Goal]]) -> None:
        self._interpreter.read_ahead(needed)
        for text, objects, before in needed:
            self._known[text, id(objects), before] = self._interpreter.interpret(text, objects, before)


def side_by_side(
    interpreter: Interpreter, conversations: Callable[[ReadBefore], Sequence[Conversation[Found]]]
) -> list[Found]:
    """Hold the conversations with a reader turn by turn; return what becomes of each."""
    reader, found = ReadBefore(interpreter), dict[int, Found]()
    going = dict(enumerate(conversations(reader)))
    while going:
        said = []
        for number, one in list(going.items()):
            try:
                said.append(next(one))
            except StopIteration as end:
                found[number] = end.value
                del going[number]
        while said:
            needed = []
            for state, text, objects, stands in said:
                try:
                    say(state, text, reader, objects, stands)
                except _Needed as one:
                    needed.append((one.args, (state, text, objects, stands)))
            reader.read([asked for asked, _ in needed])
            said = [each for _, each in needed]
    return [found[number] for number in sorted(found)]

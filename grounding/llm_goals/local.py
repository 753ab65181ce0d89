"""Let the local language model write the line of a goal: at every step the likeliest legal piece, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.goal_reading.chunks import Chunk
from grounding.goal_reading.measures import count_at, lengths_of
from grounding.goal_reading.tokens import split
from grounding.goals.parts import MAX_ROWS
from grounding.llm_goals.lines import Said, goal_line
from grounding.llm_goals.reader import UnusableGoalError
from grounding.parsers.llm_local import INSTRUCTION, LocalLLM
from grounding.parsers.llm_reply import quotable
from prompts import load_prompt

if TYPE_CHECKING:
    from grounding.parsers.llm_local import Continuation

GOAL_ADAPTER = Path(__file__).parents[1] / "weights" / "llm_goal_adapter.safetensors"
PROMPT = "parse_goal_lines"
MOST_PIECES = 160  # of a line; more is a model that goes round in circles


@dataclass(frozen=True)
class Written:
    """A line that a language model wrote.

    Attributes:
        line: the line.
        parts: as JSON has them, with words of the instruction for objects and lengths, or a word of `NO_GOAL`; `None`
            for a line without an end.
        certainty: product of the probabilities of all choices among the legal pieces.
    """

    line: str
    parts: list[dict[str, Any]] | str | None
    certainty: float


class LocalGoals:
    """The local language model as a writer of goals.

    Args:
        model: as `LocalLLM` takes it.
        adapter: low-rank weights trained for goals (`grounding.training.goal_adapter`); "default" for those that come with
            the default model, `None` for the bare model. Other models come without.

    Raises:
        LLMError: for a model or an adapter that cannot be loaded.
    """

    def __init__(self, model: str | None = None, adapter: str | Path | None = "default") -> None:
        if adapter == "default":
            adapter = GOAL_ADAPTER if model is None else None
        self.model = LocalLLM(model, adapter)
        self.identity = self.model.identity
        self.prompt = load_prompt(PROMPT)

    def mended(self, text: str) -> str:
        """Return a text without typing errors, as far as the model knows words."""
        return self.model.mended(text)

    def write(self, said: Said) -> Written:
        """Write the line of an instruction."""
        continuation = self.model.continuation(self.prompt, INSTRUCTION.format(text=said.text))
        steps, line, certainty = goal_line(said), "", 0.0
        legal = next(steps)
        for _ in range(MOST_PIECES):
            piece, log_share = self._choose(continuation, legal)
            line, certainty = line + piece, certainty + log_share
            try:
                legal = steps.send(piece)
            except StopIteration as end:
                return Written(line, end.value, math.exp(certainty))
        return Written(line, None, 0.0)

    def _choose(self, continuation: Continuation, legal: Sequence[str]) -> tuple[str, float]:
        """Choose a piece token by token; return it with the logarithm of its probability among the legal ones."""
        left = {piece: self.model.tokens(piece) for piece in legal}
        depth, log_share = 0, 0.0
        while True:
            done = [piece for piece, tokens in left.items() if len(tokens) == depth]
            options = sorted({tokens[depth] for tokens in left.values() if len(tokens) > depth})
            if done and not options:
                return done[0], log_share
            token = options[0]
            if len(options) > 1 or done:
                scores, likely = continuation.scores(options)
                if done and not likely:  # a piece that begins others ends where none goes on
                    return done[0], log_share
                shares = scores.double().log_softmax(dim=0)
                best = int(shares.argmax())
                token, log_share = options[best], log_share + float(shares[best])
            continuation.add(token)
            left = {piece: tokens for piece, tokens in left.items() if len(tokens) > depth and tokens[depth] == token}
            depth += 1


class LocalGoalWriter:
    """The local language model as the reader of goals asks it (`grounding.llm_goals.reader.GoalWriter`).

    Args:
        goals: the model.
    """

    knows_words = False

    def __init__(self, goals: LocalGoals) -> None:
        self.goals = goals
        self.identity = goals.identity

    def parts(self, text: str, chunks: Sequence[Chunk]) -> list[dict[str, Any]] | str:
        """Write the parts of a goal; lengths are read by the grammar of lengths.

        Raises:
            UnusableGoalError: for a line without an end, or one of which the model is too unsure.
        """
        mended = quotable(self.goals.mended(text))
        lengths, counts = said_lengths(mended), said_counts(mended)
        written = self.goals.write(Said.of(mended, tuple(lengths), counts))
        if written.parts is None:
            raise UnusableGoalError("has no end")
        if isinstance(written.parts, str):
            return written.parts
        return [_in_metres(part, lengths) for part in written.parts]


def said_lengths(text: str) -> dict[str, float]:
    """Find the lengths of a text: its own words -> metres."""
    said = split(text)
    return {
        Said.of(said.quote(first, end)).text: metres for first, (metres, end) in lengths_of(said).items() if metres >= 0
    }


def said_counts(text: str) -> tuple[int, ...]:
    """Find the whole numbers of a text, lengths aside."""
    said = split(text)
    within = {place for first, (_, end) in lengths_of(said).items() for place in range(first, end)}
    found = (count_at(said, place) for place in range(len(said.words)) if place not in within)
    return tuple(sorted({count[0] for count in found if count is not None and 1 <= count[0] <= MAX_ROWS}))


def _in_metres(part: dict[str, Any], lengths: dict[str, float]) -> dict[str, Any]:
    return part | {key: lengths[part[key]] for key in ("gap", "radius", "length", "distance") if part.get(key) is not None}

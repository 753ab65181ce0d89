"""Let the local language model write the line of a goal: at every step the most likely legal piece, and nothing else.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.measures import count_at, lengths_of
from grounding.goal_reading.tokens import split
from grounding.goal_reading.written_references import UnusableGoalError
from grounding.goals.parts import MAX_ROWS
from grounding.llm_goals.checks import mismatch
from grounding.llm_goals.limits import limited
from grounding.llm_goals.lines import Said, goal_line, parts_of
from grounding.parsers.llm_cache import AnswerCache
from grounding.parsers.llm_local import INSTRUCTION, LocalLLM
from grounding.parsers.llm_reply import quotable
from prompts import load_prompt

if TYPE_CHECKING:
    from grounding.parsers.llm_local import Continuation

GOAL_ADAPTER = Path(__file__).parents[1] / "weights" / "llm_goal_adapter.safetensors"
PROMPT = "parse_goal_lines"
MOST_PIECES = 160  # of a line; more is a model that goes round in circles
NO_MORE = ""  # in place of a line that could follow
RETRIES = 3  # other lines that are tried where the likeliest says something else than the instruction
_STOP = -1  # the decision to end a piece that begins other pieces


@dataclass(frozen=True)
class Decision:
    """A choice between tokens.

    Attributes:
        token: the one that was chosen; -1 ends the piece.
        second: the second best, or `None`.
        share: probability of the chosen one among the legal ones.
    """

    token: int
    second: int | None
    share: float


@dataclass(frozen=True)
class Written:
    """A line that a language model wrote.

    Attributes:
        line: the line.
        parts: as JSON values, with words of the instruction for objects and lengths, or a word of `NO_GOAL`; `None`
            for a line without an end.
        decisions: in their order.
    """

    line: str
    parts: list[dict[str, Any]] | str | None
    decisions: tuple[Decision, ...]

    @property
    def certainty(self) -> float:
        """Return the product of the probabilities of all choices among the legal tokens."""
        return math.prod(decision.share for decision in self.decisions)


class LocalGoals:
    """The local language model as a writer of goals.

    Args:
        model: as for `LocalLLM`.
        adapter: low-rank weights trained for goals (`grounding.training.goal_adapter`); "default" for those that come
            with the default model, `None` for the bare model. Other models come without.

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

    def write(self, said: Said, forced: Sequence[int] = ()) -> Written:
        """Write the line of an instruction.

        Args:
            said: the words of the instruction.
            forced: the first decisions if given.
        """
        continuation = self.model.continuation(self.prompt, INSTRUCTION.format(text=said.text))
        steps, line = goal_line(said), ""
        decisions: list[Decision] = []
        legal = next(steps)
        for _ in range(MOST_PIECES):
            asked = [piece for piece in legal if piece not in said.unasked] or legal
            piece = self._choose(continuation, asked, forced, decisions)
            line += piece
            try:
                legal = steps.send(piece)
            except StopIteration as end:
                return Written(line, end.value, tuple(decisions))
        return Written(line, None, tuple(decisions))

    def lines(self, said: Said) -> Iterator[Written]:
        """Write the most likely line, and then others: each takes the second best at one of the least certain
        decisions.
        """
        first = self.write(said)
        yield first
        doubtful = sorted(
            (i for i, decision in enumerate(first.decisions) if decision.second is not None),
            key=lambda i: first.decisions[i].share,
        )
        for i in doubtful[:RETRIES]:
            second = first.decisions[i].second
            assert second is not None
            yield self.write(said, [*(decision.token for decision in first.decisions[:i]), second])

    def _choose(
        self, continuation: Continuation, legal: Sequence[str], forced: Sequence[int], decisions: list[Decision]
    ) -> str:
        """Choose a piece token by token, and note the decisions."""
        left = {piece: self.model.tokens(piece) for piece in legal}
        depth = 0
        while True:
            done = [piece for piece, tokens in left.items() if len(tokens) == depth]
            options = sorted({tokens[depth] for tokens in left.values() if len(tokens) > depth})
            if done and not options:
                return done[0]
            token = options[0]
            if len(options) > 1 or done:
                if len(decisions) < len(forced):
                    decisions.append(Decision(forced[len(decisions)], None, 1.0))
                else:
                    decisions.append(self._decide(continuation, options, bool(done)))
                token = decisions[-1].token
                if token == _STOP:
                    return done[0]
            continuation.add(token)
            left = {piece: tokens for piece, tokens in left.items() if len(tokens) > depth and tokens[depth] == token}
            depth += 1

    def _decide(self, continuation: Continuation, options: Sequence[int], may_stop: bool) -> Decision:
        scores, likely = continuation.scores(options)
        shares = scores.double().softmax(dim=0)
        order = shares.argsort(descending=True).tolist()
        if may_stop and not likely:  # a piece that begins others ends where none of them goes on
            return Decision(_STOP, None, 1.0)
        second = options[order[1]] if len(order) > 1 else None
        return Decision(options[order[0]], second, float(shares[order[0]]))


class LocalGoalWriter:
    """The local language model as the reader of goals asks it (`grounding.llm_goals.reader.GoalWriter`).

    Args:
        goals: the model.
        replies: a file in which its lines are kept, and found again; `None` keeps none.

    Raises:
        LLMError: for a file that cannot be read.
    """

    knows_words = False

    def __init__(self, goals: LocalGoals, replies: str | Path | None = None) -> None:
        self.goals = goals
        self.identity = goals.identity
        self._cache = None if replies is None else LineCache(replies)
        self._prompt_sha256 = hashlib.sha256(goals.prompt.encode()).hexdigest()

    def parts(self, text: str, chunks: Sequence[Chunk]) -> list[dict[str, Any]] | str:
        """Write the parts of a goal; lengths are read by the grammar of lengths.

        Of several lines the first that leaves nothing out and adds nothing is taken, else the most likely.

        Raises:
            UnusableGoalError: for a line without an end.
        """
        mended = quotable(self.goals.mended(text))
        lengths = said_lengths(mended)
        first: list[dict[str, Any]] | str | None = None
        said = Said.of(mended, tuple(lengths), said_counts(mended))
        for parts in self._answers(limited(said, chunks)):
            if isinstance(parts, list):
                parts = [_in_metres(part, lengths) for part in parts]
                if not mismatch(chunks, parts):
                    return parts
            first = parts if first is None else first
            if isinstance(first, str):
                break
        if first is None:
            raise UnusableGoalError("has no end")
        return first

    def _answers(self, said: Said) -> Iterator[list[dict[str, Any]] | str | None]:
        """Return the parts of the most likely line and of others, as `LocalGoals.lines`; kept ones cost nothing."""
        limits = hashlib.sha256(repr((said.naming, sorted(said.unasked))).encode())
        key = self.identity, f"{self._prompt_sha256} {limits.hexdigest()}", said.text
        kept = (self._cache and self._cache.get(*key)) or []
        yield from (_parts_of(line, said) for line in kept if line != NO_MORE)
        if NO_MORE in kept:
            return
        for number, written in enumerate(self.goals.lines(said)):
            if number >= len(kept):
                kept = [*kept, written.line]
                if self._cache is not None:
                    self._cache.put(*key, kept)
                yield written.parts
        if self._cache is not None:
            self._cache.put(*key, [*kept, NO_MORE])


class LineCache(AnswerCache["list[str]"]):
    """Lines of a language model about goals: for each instruction those that it wrote, `NO_MORE` after the last one.

    Args:
        path: as for `AnswerCache`.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "lines", _are_lines)


def _are_lines(answer: object) -> bool:
    return isinstance(answer, list) and bool(answer) and all(isinstance(line, str) for line in answer)


def _parts_of(line: str, said: Said) -> list[dict[str, Any]] | str | None:
    """Read a kept line; `None` for one without an end, or of another grammar of lines."""
    try:
        return parts_of(line, said)
    except ValueError:
        return None


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
    return part | {
        key: lengths[part[key]] for key in ("gap", "radius", "length", "distance") if part.get(key) is not None
    }

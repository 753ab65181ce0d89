"""Let the local language model write the line of a goal: at every step the most likely legal piece, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.goals.goal import Goal
from grounding.goals.parts import MAX_ROWS
from grounding.language_model.goal_lines import Said, goal_line
from grounding.parsers.llm_local import INSTRUCTION, LocalLLM
from grounding.parsers.llm_reply import LLMError, quotable
from grounding.propose.network import NetworkProposer
from grounding.propose.proposal import WordedGoal
from grounding.resolve.attributes import SceneObject
from grounding.resolve.measures import count_at, lengths_of
from grounding.resolve.tokens import split
from prompts import load_prompt

if TYPE_CHECKING:
    from grounding.parsers.llm_local import Continuation

GOAL_ADAPTER = Path(__file__).parents[1] / "weights" / "llm_goal_adapter.safetensors"
PROMPT = "parse_goal_lines"
MOST_PIECES = 160  # of a line; more is a model that goes round in circles
RETRIES = 3  # other lines than the likeliest
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
            piece = self._choose(continuation, legal, forced, decisions)
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


class LocalProposer:
    """The local language model as a proposer of goals.

    Args:
        make: makes the model.
        network: proposes what is said about a goal, which the model was not taught, and everything where the model cannot be
            used.
        strict: raise the model's errors instead.

    Attributes:
        fallback: why the network proposes instead, or "".
    """

    def __init__(self, make: Callable[[], LocalGoals], network: NetworkProposer, strict: bool = False) -> None:
        self._make, self._network, self._strict = make, network, strict
        self.fallback = ""

    @cached_property
    def goals(self) -> LocalGoals:
        """Return the model."""
        return self._make()

    def propose(
        self, text: str, objects: Sequence[SceneObject] | None = None, before: Goal = Goal()
    ) -> tuple[WordedGoal, ...]:
        """Propose what a text may mean, the most likely line first; see `NetworkProposer.propose`.

        Raises:
            LLMError: for a model that cannot be used, if the proposer is strict.
        """
        if before.parts or self.fallback:
            return self._network.propose(text, objects, before)
        try:
            return self._lines(text)
        except LLMError as error:
            if self._strict:
                raise
            self.fallback = f"the language model cannot be used ({error}); the default reader read this"
            return self._network.propose(text, objects, before)

    def _lines(self, text: str) -> tuple[WordedGoal, ...]:
        mended = quotable(self.goals.mended(text))
        lengths = said_lengths(mended)
        lines = self.goals.lines(Said.of(mended, tuple(lengths), said_counts(mended)))
        return tuple(_worded(line, lengths) for line in lines if line.parts is not None)


def _worded(line: Written, lengths: Mapping[str, float]) -> WordedGoal:
    if isinstance(line.parts, str):
        return WordedGoal(line.certainty, answer=line.parts)
    return WordedGoal(line.certainty, tuple(_in_metres(part, lengths) for part in line.parts or ()))


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


def _in_metres(part: dict[str, Any], lengths: Mapping[str, float]) -> dict[str, Any]:
    return part | {
        key: lengths[part[key]] for key in ("gap", "radius", "length", "distance") if part.get(key) is not None
    }

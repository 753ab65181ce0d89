"""Let the goal network write the goal of an instruction."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from safetensors.numpy import load_file

from grounding.goal_network.decoder import POSITIONS, GoalDecoder, Writing
from grounding.goal_network.legal_actions import Legal, legal_actions
from grounding.goal_network.vocabulary import END, KEYWORD, KEYWORDS, MOST_WORDS, START, Action, keyword
from grounding.goal_network.word_presence import word_presence
from grounding.linear_algebra import one_thread
from grounding.packed_weights import unpacked
from grounding.parsers.embedding import WEIGHTS as PARSER_WEIGHTS
from grounding.resolve.attributes import SceneObject
from grounding.resolve.tokens import words_of
from grounding.untrusted_files import check_weights, read_json

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder, WordStates

WEIGHTS = Path(__file__).parents[1] / "weights" / "goal_network"
UPPER = 3  # layers of the network's own over those of the encoder
_PARSER = PARSER_WEIGHTS / "model.safetensors"  # from which the others are stored as differences
ENCODER_LAYER = 3  # of the six: the lower three stay as they are
MOST_SAID = 100  # words; of longer instructions the network reads nothing
_END = keyword("<end>")
Network = TypeVar("Network")


class GoalNetworkError(RuntimeError):
    """Weights of the goal network that cannot be used; the message is one sentence that says why."""


@dataclass(frozen=True)
class WrittenGoal:
    """A goal that the network wrote.

    Attributes:
        words: of the instruction.
        actions: what was written, without the end.
        certainty: the product of the probabilities of all choices among the legal actions.
    """

    words: tuple[str, ...]
    actions: tuple[Action, ...]
    certainty: float

    def phrase(self, place: int) -> str:
        """Return the words that the two actions at this place point at."""
        return " ".join(self.words[self.actions[place].value : self.actions[place + 1].value + 1])


class NetworkWriter:
    """The goal network with its encoder.

    Args:
        encoder: the sentence encoder.
        decoder: the network.
    """

    def __init__(self, encoder: SentenceEncoder, decoder: GoalDecoder) -> None:
        self._encoder, self.decoder = encoder, decoder

    @classmethod
    def from_pretrained(cls, encoder: SentenceEncoder, folder: Path = WEIGHTS) -> NetworkWriter:
        """Load the network of a folder with `config.json` and `model.safetensors`.

        Raises:
            GoalNetworkError: for files that are missing, or that do not fit this version or the encoder.
        """

        def made(config: Mapping[str, Any], state: dict[str, np.ndarray]) -> NetworkWriter:
            if config["keywords"] != list(KEYWORDS):
                raise GoalNetworkError(f"the goal network in {folder} was trained with other keywords")
            return cls(encoder, GoalDecoder(state))

        return load_network("goal network", folder, encoder, made)

    def likeliest(
        self, text: str, count: int, objects: Sequence[SceneObject] | None = None, answers: bool = True
    ) -> list[WrittenGoal]:
        """Write the likeliest goals of an instruction, found by a beam search, the most certain first.

        Args:
            text: the instruction.
            count: of goals at most, and the width of the beam; none for a text that is empty or longer than `MOST_SAID`
                words.
            objects: of the scene; `None` where it is not known.
            answers: whether an answer may be written in place of a goal.
        """
        words = words_of(text)
        states = self._states(words)
        if states is None:
            return []
        with one_thread():
            presence = word_presence(words, objects)
            beam = [_Unfinished(self.decoder.begin(states.hidden, states.first[0], presence))]
            found: list[WrittenGoal] = []
            for _ in range(POSITIONS):
                writings = [one.writing.copy() for one in beam]
                scores = self.decoder.scores(writings, [one.actions[-1] if one.actions else None for one in beam])
                steps = [
                    step
                    for one, writing, row in zip(beam, writings, scores, strict=True)
                    for step in one.steps(writing, row, len(words), count, answers)
                ]
                steps.sort(key=lambda step: -step.score)
                found += [
                    WrittenGoal(tuple(words), one.actions, math.exp(one.score)) for one in steps[:count] if one.ended
                ]
                beam = [one for one in steps[:count] if not one.ended]
                found = sorted(found, key=lambda goal: -goal.certainty)[:count]
                least = found[-1].certainty if len(found) == count else 0.0
                if not beam or math.exp(beam[0].score) <= least:
                    break
        return found

    def _states(self, words: list[str]) -> WordStates | None:
        """Return what the encoder makes of words; `None` for no words, or more than can be read."""
        if not words or len(words) > MOST_SAID:
            return None
        states = self._encoder.word_states([words], ENCODER_LAYER)
        return states if states.words.all() else None  # there may be more word pieces than the encoder takes


@dataclass(frozen=True)
class _Unfinished:
    """A goal that a beam search is writing.

    Attributes:
        writing: what the decoder knows of it before the last action.
        actions: so far.
        score: the logarithm of its certainty.
        ended: whether it is complete.
    """

    writing: Writing
    actions: tuple[Action, ...] = ()
    score: float = 0.0
    ended: bool = False

    def steps(self, writing: Writing, scores: np.ndarray, words: int, count: int, answers: bool) -> list[_Unfinished]:
        """Return it with each of the likeliest actions that may follow.

        Args:
            writing: what the decoder knows of it after the last action.
            scores: (keywords + 2 `words`,) of the actions that may follow.
            words: of the instruction.
            count: of actions at most.
            answers: whether an answer may be written in place of a goal.
        """
        steps = legal_actions(answers)
        legal = next(steps)
        for action in self.actions:
            legal = steps.send(action)
        shares = _shares(scores, legal, words)
        found = []
        for best in np.argsort(-shares)[:count]:
            if shares[best] > 0.0:
                action, score = _action(int(best), words), self.score + math.log(shares[best])
                ended = action == _END
                found.append(_Unfinished(writing, self.actions if ended else (*self.actions, action), score, ended))
        return found


def load_network(
    name: str,
    folder: Path,
    encoder: SentenceEncoder,
    made: Callable[[Mapping[str, Any], dict[str, np.ndarray]], Network],
) -> Network:
    """Load a network over the lower layers of the sentence encoder: the goal network, or the verifier.

    Args:
        name: of the network, for messages.
        folder: with `config.json` and `model.safetensors`.
        encoder: the sentence encoder.
        made: makes the network of the config and the arrays.

    Raises:
        GoalNetworkError: for files that are missing, or that do not fit this version or the encoder.
    """
    from safetensors import SafetensorError

    try:
        check_weights(folder / "model.safetensors")
        config = read_json(folder / "config.json")
        network = made(config, unpacked(load_file(folder / "model.safetensors"), base_of(config)))
        if config["encoder_sha256"] != encoder.checksum:
            raise GoalNetworkError(f"the {name} in {folder} was trained with another sentence encoder")
        return network
    except (OSError, ValueError, KeyError, TypeError, SafetensorError) as error:
        raise GoalNetworkError(f"the {name} in {folder} cannot be loaded: {error}") from error


def base_of(config: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the arrays from which the stored ones differ, by a network's config; none where all are stored.

    Raises:
        GoalNetworkError: if the parser's weights are others than those that were subtracted.
    """
    record = config.get("difference_to")
    if record is None:
        return {}
    if base_record() != record:
        raise GoalNetworkError(f"the network {record['network']!r} is another than the one that was trained further")
    return base_arrays()


def base_record() -> dict[str, str]:
    """Return what a config says of the network from which its own differs: the parser of the five slots."""
    return {"network": "embedding", "sha256": _parser_sha256()}


@cache
def _parser_sha256() -> str:
    """Return the checksum of the parser's weights, of which two networks are differences."""
    return hashlib.sha256(_PARSER.read_bytes()).hexdigest()


def base_arrays() -> dict[str, np.ndarray]:
    """Return the parser's upper layers, with the names that they have in the goal network and in the verifier."""
    return parser_layers(unpacked(load_file(_PARSER), {}))


def parser_layers(state: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the upper layers of the parser of five slots, with the names that they have in the goal network."""
    layers = 1 + max(int(name.split(".")[1]) for name in state if name.startswith("layers."))
    found = {}
    for name, array in state.items():
        if name.startswith("layers."):
            _, number, rest = name.split(".", 2)
            found[f"upper.{int(number) - (layers - UPPER)}.{rest}"] = array
    return found


def _shares(scores: np.ndarray, legal: Legal, words: int) -> np.ndarray:
    """Return the probabilities of the actions among the legal ones, in the order of `GoalDecoder.scores`."""
    allowed = np.zeros(len(scores), dtype=bool)
    allowed[list(legal.keywords)] = True
    starts, ends = len(KEYWORDS), len(KEYWORDS) + words
    allowed[starts:ends] = legal.start
    if legal.end_from is not None:
        allowed[ends + legal.end_from : ends + min(legal.end_from + MOST_WORDS, words)] = True
    scores = np.where(allowed, scores, -np.inf)
    shares = np.exp(scores - scores.max())
    return shares / shares.sum()


def _action(number: int, words: int) -> Action:
    """Return the action with a number in `GoalDecoder.scores`."""
    starts, ends = len(KEYWORDS), len(KEYWORDS) + words
    if number < starts:
        return Action(KEYWORD, number)
    return Action(START, number - starts) if number < ends else Action(END, number - ends)

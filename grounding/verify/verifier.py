"""Judge goals beside the words that they were read from: is everything held, and which words are lost?

The discriminator of language, as the paper has one for arrangements: the goal network proposes, this network rejects.
It reads what was said together with a goal in words, and answers with the logit that the goal is what was meant, and
for each word with the probability that the goal has lost it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grounding.goal_network.goal_rendition import BEFORE, NOW, rendition_of
from grounding.goal_network.writer import ENCODER_LAYER, load_network
from grounding.goals.goal import Goal
from grounding.linear_algebra import one_thread
from grounding.parsers.bert import EncoderLayer, Linear, gelu, under
from grounding.resolve.attributes import SceneObject
from grounding.resolve.tokens import words_of

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

WEIGHTS = Path(__file__).parents[1] / "weights" / "verifier"
HEADS = 12  # of the encoder's layers
INSTRUCTION, FOLLOW_UP = "instruction", "follow_up"  # what is judged, by whether there is a goal so far
GOAL = "=>"  # between what was said and the goal
MOST_WORDS = 150  # of both together


@dataclass(frozen=True)
class Judgement:
    """What the verifier says of one goal.

    Attributes:
        logit: of the probability that the goal is what was meant.
        lost: (words of the text,) float32: for each the probability that the goal has lost it.
    """

    logit: float
    lost: np.ndarray


@dataclass(frozen=True)
class Pair:
    """The words that the verifier reads.

    Attributes:
        words: the goal so far, if any, what was said, `GOAL`, and the goal that is judged.
        first, end: where what was said begins and ends among them.
    """

    words: tuple[str, ...]
    first: int
    end: int


def pair_of(text: str, goal: Goal, objects: Sequence[SceneObject], before: Goal = Goal()) -> Pair:
    """Return the words in which a goal is judged beside a text.

    Args:
        text: what was said.
        goal: its objects are indices.
        objects: of the scene.
        before: the goal so far; without parts for an instruction.
    """
    so_far = words_of(rendition_of(before, objects).text) if before.parts else []
    said = words_of(text)
    judged = words_of(rendition_of(goal, objects).text.removeprefix(BEFORE).removesuffix(NOW))
    room = MOST_WORDS - len(judged) - 1
    kept = [*so_far, *said][-room:] if room > 0 else []
    first = max(0, len(kept) - len(said))
    return Pair((*kept, GOAL, *judged[:MOST_WORDS]), first, len(kept))


class Verifier:
    """The verifier's network: layers over the lower ones of the sentence encoder, and two heads.

    Args:
        encoder: the sentence encoder.
        state: float32 arrays by their names in `grounding.training.verifier.VerifierNetwork`.
        weights: of `grounding.decide.features`, for `INSTRUCTION` and for `FOLLOW_UP`: the probability that a judged
            goal is what was meant. A few words about a goal are judged otherwise than a first instruction.

    Raises:
        KeyError: for an array that is missing.
    """

    def __init__(
        self, encoder: SentenceEncoder, state: Mapping[str, np.ndarray], weights: Mapping[str, Sequence[float]]
    ) -> None:
        self._encoder, self.weights = encoder, {kind: tuple(each) for kind, each in weights.items()}
        self.state = {name: array.astype(np.float32, copy=False) for name, array in state.items()}
        count = len({name.split(".")[1] for name in state if name.startswith("upper.")})
        self._upper = [EncoderLayer.of(under(self.state, f"upper.{number}."), HEADS) for number in range(count)]
        self._shared, self._right, self._lost = (self._linear(name) for name in ("shared", "right", "lost"))

    @classmethod
    def from_pretrained(cls, encoder: SentenceEncoder, folder: Path = WEIGHTS) -> Verifier:
        """Load the network of a folder with `config.json` and `model.safetensors`.

        Raises:
            GoalNetworkError: for files that are missing, or that do not fit this version or the encoder.
        """
        return load_network("verifier", folder, encoder, lambda config, state: cls(encoder, state, _weights(config)))

    def weights_of(self, before: Goal) -> Sequence[float]:
        """Return the weights for what is said about a goal; one without parts is that before an instruction."""
        return self.weights[FOLLOW_UP if before.parts else INSTRUCTION]

    def judge(self, pairs: Sequence[Pair]) -> list[Judgement]:
        """Judge goals, each beside its text."""
        if not pairs:
            return []
        said = self._encoder.word_states([list(pair.words) for pair in pairs], ENCODER_LAYER)
        with one_thread():
            states = said.hidden
            for layer in self._upper[:-1]:
                states = layer(states, said.pieces)
            # Only the beginning and the words of what was said are asked for.
            places = np.zeros((len(pairs), 1 + max(pair.end - pair.first for pair in pairs)), dtype=int)
            for number, pair in enumerate(pairs):
                places[number, 1 : 1 + pair.end - pair.first] = said.first[number, pair.first : pair.end]
            states = self._upper[-1].at(states, said.pieces, places)
            shared = gelu(self._shared(states.reshape(-1, states.shape[-1]))).reshape(*places.shape, -1)
            right = self._right(shared[:, 0])[:, 0]
            return [
                Judgement(float(one), _sigmoid(self._lost(own[1 : 1 + pair.end - pair.first])[:, 0]))
                for one, own, pair in zip(right, shared, pairs, strict=True)
            ]

    def _linear(self, name: str) -> Linear:
        return Linear(self.state[f"{name}.weight"], self.state[f"{name}.bias"])


def _weights(config: Mapping[str, Any]) -> Mapping[str, Sequence[float]]:
    """Return the weights of the probability of a config; none before they are fitted."""
    weights = config["weights"]
    if not isinstance(weights, Mapping) or (weights and set(weights) != {INSTRUCTION, FOLLOW_UP}):
        raise ValueError(f"'weights' in config.json must be an object with {INSTRUCTION!r} and {FOLLOW_UP!r}")
    return weights


def _sigmoid(values: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(-values))

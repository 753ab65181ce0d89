"""Run the embedding parser's network: the sentence encoder's upper layers, trained further, and a head per slot.

The encoder's own upper layers are made for the meaning of a whole sentence. Here they continue from
its lower layers' word states as a copy that learned which word is about which slot. Then every word
piece votes on every slot, and attention weighs the votes: so an answer can be traced to its words.

It is trained as `grounding.training.slot_network.SlotNetwork`; here it runs in numpy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from grounding.parse_result import REFUSALS
from grounding.parsers.bert import EncoderLayer, Linear, Normalisation, gelu, layer_sizes, softmax, under
from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SLOTS

HEADS = 12  # of the attention within a layer, as the encoder has them
REFUSE = "refuse"
QUESTIONS = (*SLOTS, REFUSE)


def answers_of(shapes: Sequence[str]) -> Mapping[str, tuple[str | None, ...]]:
    """List what a network that was taught these shapes can answer per question.

    The last answer is always "unspecified", or "build it".
    """
    values = {**LEGAL_VALUES, "shape": tuple(shapes)}
    return {slot: (*values[slot], None) for slot in SLOTS} | {REFUSE: (*REFUSALS, None)}


# Those that the training language teaches.
ANSWERS = answers_of(FIRST_SHAPES)


class SlotReader:
    """A trained network from word states of the sentence encoder to votes on every question.

    Args:
        state: its arrays, by their names in `grounding.training.slot_network.SlotNetwork`.
        layers: how many transformer layers it has of its own.
        width: of the encoder's states.
        hidden: of the layer that all questions share.
        shapes: those that it was taught, in the order of its answers.

    Attributes:
        answers: question -> what it can answer, in the order of its votes.
        state: its arrays in float32.
        layers, width, hidden, shapes: as given.

    Raises:
        ValueError: for arrays that are missing, unknown, or of another size.
    """

    def __init__(
        self,
        state: Mapping[str, np.ndarray],
        layers: int = 4,
        width: int = 384,
        hidden: int = 64,
        shapes: Sequence[str] = FIRST_SHAPES,
    ) -> None:
        self.layers, self.width, self.hidden, self.shapes = layers, width, hidden, tuple(shapes)
        self.answers = answers_of(shapes)
        self.state = {name: array.astype(np.float32, copy=False) for name, array in state.items()}
        counts = [len(self.answers[question]) for question in QUESTIONS]
        self._ends = np.cumsum(counts)[:-1]
        _check(self.state, _sizes(layers, width, hidden, sum(counts)))
        self._own = [EncoderLayer.of(under(self.state, f"layers.{i}."), HEADS) for i in range(layers)]
        self._normalise = Normalisation(*self._pair("normalise"), 1e-5)
        self._shared, self._attention = Linear(*self._pair("shared")), Linear(*self._pair("attention"))
        self._votes = Linear(*self._pair("votes"))

    def _pair(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        return self.state[f"{name}.weight"], self.state[f"{name}.bias"]

    def __call__(self, states: np.ndarray, mask: np.ndarray) -> list[np.ndarray]:
        """Compute what every word piece contributes to every answer.

        Args:
            states: (B, T, width) float32 hidden states.
            mask: (B, T) bool, false on padding.

        Returns:
            One array (B, T, answers) per question, in the order of `QUESTIONS`; its sum over T is the logits.
        """
        for layer in self._own:
            states = layer(states, mask)
        x = gelu(self._shared(self._normalise(states.reshape(-1, states.shape[-1]))))  # (B T, hidden)
        attention = self._attention(x).reshape(*mask.shape, -1)
        attention[~mask] = -np.inf
        weights = softmax(attention, axis=1)  # (B, T, questions)
        votes = np.split(self._votes(x).reshape(*mask.shape, -1), self._ends, axis=-1)
        return [weights[..., i : i + 1] * vote for i, vote in enumerate(votes)]


def _sizes(layers: int, width: int, hidden: int, answers: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of a reader."""
    weights = {
        "normalise": (width,),
        "shared": (hidden, width),
        "attention": (len(QUESTIONS), hidden),
        "votes": (answers, hidden),
    }
    biases = {f"{name}.bias": size[:1] for name, size in weights.items()}
    heads = {f"{name}.weight": size for name, size in weights.items()} | biases
    own = {f"layers.{i}.{name}": size for i in range(layers) for name, size in layer_sizes(width, 4 * width).items()}
    return heads | own


def _check(state: Mapping[str, np.ndarray], sizes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise `ValueError` unless a reader's arrays have these sizes."""
    if odd := sorted(state.keys() ^ sizes.keys()):
        raise ValueError(f"{odd[0]} is {'unknown' if odd[0] in state else 'missing'}")
    for name, size in sizes.items():
        if state[name].shape != size:
            raise ValueError(f"size mismatch for {name}: {state[name].shape} in the file, {size} by the config")

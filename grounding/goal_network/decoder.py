"""Run the goal network in numpy: a transformer decoder that points at the words of the instruction.

Torch trains it (`grounding.training.goal_network`); a test holds this arithmetic to torch's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS, NUMBER_OF, Action
from grounding.goal_network.word_presence import PRESENCES
from grounding.parsers.bert import EncoderLayer, Linear, Normalisation, gelu, layer_sizes, softmax, under

ENCODER_WIDTH, ENCODER_HEADS = 384, 12
WIDTH, HEADS, POSITIONS = 256, 4, 128
_EPSILON = 1e-5  # torch's default


@dataclass(frozen=True)
class _Attention:
    """An attention of rows (n, width) over memories (m, width)."""

    query: Linear
    key: Linear
    value: Linear
    join: Linear

    @classmethod
    def of(cls, state: Mapping[str, np.ndarray], name: str) -> _Attention:
        """Make it of torch's `MultiheadAttention` of this name."""
        weights = np.split(state[f"{name}.in_proj_weight"], 3)
        biases = np.split(state[f"{name}.in_proj_bias"], 3)
        query, key, value = (Linear(*pair) for pair in zip(weights, biases, strict=True))
        return cls(query, key, value, Linear(state[f"{name}.out_proj.weight"], state[f"{name}.out_proj.bias"]))

    def __call__(self, rows: np.ndarray, keys: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Attend from rows (n, width) to keys and values that `key` and `value` made: (n, m, width), each row to its
        own, or (1, m, width), all to the same.
        """
        each = WIDTH // HEADS
        query = self.query(rows).reshape(-1, HEADS, 1, each) * np.float32(each**-0.5)
        scores = query @ keys.reshape(*keys.shape[:2], HEADS, each).transpose(0, 2, 3, 1)  # (n, heads, 1, m)
        found = softmax(scores, axis=-1) @ values.reshape(*values.shape[:2], HEADS, each).transpose(0, 2, 1, 3)
        return self.join(found.reshape(-1, WIDTH))


@dataclass(frozen=True)
class _Layer:
    """A layer of the decoder: attention to what was written, to the instruction, and two linear maps."""

    own: _Attention
    said: _Attention
    widen: Linear
    narrow: Linear
    norms: tuple[Normalisation, Normalisation, Normalisation]


@dataclass
class Writing:
    """A goal that is being written.

    Attributes:
        memory: (W, width) float32, the instruction's words.
        pointed: keys of the words (W, width) for the scores of starts and of ends.
        said: keys and values of the words, of each layer.
        written: keys and values of what was written so far, of each layer.
        length: how many actions were written.
    """

    memory: np.ndarray
    pointed: tuple[np.ndarray, np.ndarray]
    said: Sequence[tuple[np.ndarray, np.ndarray]]
    written: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    length: int = 0

    def copy(self) -> Writing:
        """Return the same goal so far, to be continued in another way."""
        return Writing(self.memory, self.pointed, self.said, list(self.written), self.length)


class GoalDecoder:
    """The network: its own upper layers of the encoder, and the decoder.

    Args:
        state: the float32 arrays by their names in `grounding.training.goal_network.GoalNetwork`.

    Raises:
        KeyError: for an array that is missing.
        ValueError: for an array with another shape.
    """

    def __init__(self, state: Mapping[str, np.ndarray]) -> None:
        self.state = {name: array.astype(np.float32, copy=False) for name, array in state.items()}
        _check(self.state)
        self._upper = [
            EncoderLayer.of(under(self.state, f"upper.{i}."), ENCODER_HEADS) for i in range(_count(state, "upper"))
        ]
        self._remember, self._normalise = self._linear("remember"), self._norm("memory_norm")
        self._layers = [self._layer(f"layers.{i}") for i in range(_count(state, "layers"))]
        self._word, self._last = self._linear("word"), self._norm("norm")
        self._keyword = self._linear("keyword")
        self._start = self._linear("start_query"), self._linear("start_key")
        self._end = self._linear("end_query"), self._linear("end_key")

    def begin(self, states: np.ndarray, first: np.ndarray, presence: Sequence[int]) -> Writing:
        """Begin to write the goal of one instruction.

        Args:
            states: (1, T, 384) float32 states of its word pieces, from the encoder's lower layers.
            first: (W,) int: the first piece of each word.
            presence: (W,) whether each word names something in the scene, see `word_presence`.
        """
        mask = np.ones(states.shape[:2], dtype=bool)
        for layer in self._upper:
            states = layer(states, mask)
        memory = self._normalise(self._remember(states[0, first])) + self.state["presence.weight"][list(presence)]
        said = [(layer.said.key(memory), layer.said.value(memory)) for layer in self._layers]
        pointed = self._start[1](memory), self._end[1](memory)
        empty = np.zeros((0, WIDTH), dtype=np.float32)
        return Writing(memory, pointed, said, [(empty, empty) for _ in self._layers])

    def scores(self, writings: Sequence[Writing], last: Sequence[Action | None]) -> np.ndarray:
        """Take the last action of each goal and score its next: logits (goals, keywords + 2 W) float32, in each row the
        keywords, then starts, then ends.

        A weight is read once for all goals, which takes about as long as for one.

        Args:
            writings: goals of one instruction that are being written, with as many actions each; each is advanced by
                one.
            last: the action that was chosen for each; `None` at the beginning.
        """
        rows = np.stack([self._row(one, action) for one, action in zip(writings, last, strict=True)])
        said, pointed = writings[0].said, writings[0].pointed
        for number, layer in enumerate(self._layers):
            x = layer.norms[0](rows)
            for one, key, value in zip(writings, layer.own.key(x), layer.own.value(x), strict=True):
                keys, values = one.written[number]
                one.written[number] = np.concatenate([keys, key[None]]), np.concatenate([values, value[None]])
            keys, values = (np.stack([one.written[number][k] for one in writings]) for k in range(2))
            rows = rows + layer.own(x, keys, values)
            rows = rows + layer.said(layer.norms[1](rows), *(each[None] for each in said[number]))
            rows = rows + layer.narrow(gelu(layer.widen(layer.norms[2](rows))))
        for one in writings:
            one.length += 1
        rows = self._last(rows)
        scale = np.float32(WIDTH**-0.5)
        starts = self._start[0](rows) @ pointed[0].T * scale
        ends = self._end[0](rows) @ pointed[1].T * scale
        return np.concatenate([self._keyword(rows), starts, ends], axis=-1)

    def _row(self, writing: Writing, last: Action | None) -> np.ndarray:
        """Return what the last action of a goal gives the layers, (width,)."""
        state = self.state
        kind, value = last or Action(KEYWORD, NUMBER_OF["<start>"])
        row = state["keywords.weight"][value] if kind == KEYWORD else self._word(writing.memory[value : value + 1])[0]
        return row + state["kinds.weight"][kind] + state["positions.weight"][writing.length]

    def _linear(self, name: str) -> Linear:
        return Linear(self.state[f"{name}.weight"], self.state[f"{name}.bias"])

    def _norm(self, name: str) -> Normalisation:
        return Normalisation(self.state[f"{name}.weight"], self.state[f"{name}.bias"], _EPSILON)

    def _layer(self, name: str) -> _Layer:
        own, said = _Attention.of(self.state, f"{name}.self_attn"), _Attention.of(self.state, f"{name}.multihead_attn")
        norms = (self._norm(f"{name}.norm1"), self._norm(f"{name}.norm2"), self._norm(f"{name}.norm3"))
        return _Layer(own, said, self._linear(f"{name}.linear1"), self._linear(f"{name}.linear2"), norms)


def _count(state: Mapping[str, np.ndarray], name: str) -> int:
    return len({key.split(".")[1] for key in state if key.startswith(f"{name}.")})


def _sizes(upper: int, layers: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array."""
    linear = {
        "remember": (WIDTH, ENCODER_WIDTH), "memory_norm": (WIDTH,), "word": (WIDTH, WIDTH), "norm": (WIDTH,),
        "keyword": (len(KEYWORDS), WIDTH), "start_query": (WIDTH, WIDTH), "start_key": (WIDTH, WIDTH),
        "end_query": (WIDTH, WIDTH), "end_key": (WIDTH, WIDTH),
    }  # fmt: skip
    for i in range(layers):
        linear |= {f"layers.{i}.norm{number}": (WIDTH,) for number in (1, 2, 3)}
        linear |= {f"layers.{i}.linear1": (4 * WIDTH, WIDTH), f"layers.{i}.linear2": (WIDTH, 4 * WIDTH)}
        linear |= {f"layers.{i}.{name}.out_proj": (WIDTH, WIDTH) for name in ("self_attn", "multihead_attn")}
    sizes = {f"{name}.weight": size for name, size in linear.items()}
    sizes |= {f"{name}.bias": size[:1] for name, size in linear.items()}
    for i in range(layers):
        for name in ("self_attn", "multihead_attn"):
            sizes |= {f"layers.{i}.{name}.in_proj_weight": (3 * WIDTH, WIDTH)}
            sizes |= {f"layers.{i}.{name}.in_proj_bias": (3 * WIDTH,)}
    own = layer_sizes(ENCODER_WIDTH, 4 * ENCODER_WIDTH)
    sizes |= {f"upper.{i}.{name}": size for i in range(upper) for name, size in own.items()}
    return sizes | {
        "keywords.weight": (len(KEYWORDS), WIDTH), "kinds.weight": (3, WIDTH), "positions.weight": (POSITIONS, WIDTH),
        "presence.weight": (PRESENCES, WIDTH),
    }  # fmt: skip


def _check(state: Mapping[str, np.ndarray]) -> None:
    sizes = _sizes(_count(state, "upper"), _count(state, "layers"))
    if odd := sorted(state.keys() ^ sizes.keys()):
        raise KeyError(odd[0])
    for name, size in sizes.items():
        if state[name].shape != size:
            raise ValueError(f"{name} has the shape {state[name].shape}; it must have {size}")

"""Run the goal network in numpy: a transformer decoder that points at the words of the instruction.

Torch trains it (`grounding.training.goal_network`); a test holds this arithmetic to torch's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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

    def to_each(self, rows: np.ndarray, keys: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Attend from rows (n, width) to keys and values (n, m, width) that `key` and `value` made, each to its own."""
        return self.join(_attended(self._queries(rows)[:, None], keys, values)[:, 0])

    def to_shared(
        self, rows: np.ndarray, groups: Sequence[slice], memories: Sequence[tuple[np.ndarray, np.ndarray]]
    ) -> np.ndarray:
        """Attend from each group of rows (n, width) to keys and values (m, width) of its own."""
        queries = self._queries(rows)
        found = [
            _attended(queries[None, group], keys[None], values[None])[0]
            for group, (keys, values) in zip(groups, memories, strict=True)
        ]
        return self.join(np.concatenate(found))

    def _queries(self, rows: np.ndarray) -> np.ndarray:
        return self.query(rows) * np.float32((WIDTH // HEADS) ** -0.5)


def _attended(queries: np.ndarray, keys: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return what queries (b, n, width) find in keys and values (b, m, width), head by head: (b, n, width)."""
    query, key, value = (
        each.reshape(*each.shape[:2], HEADS, WIDTH // HEADS).swapaxes(1, 2) for each in (queries, keys, values)
    )
    found = softmax(query @ key.swapaxes(2, 3), axis=-1) @ value  # (b, heads, n, width / heads)
    return found.swapaxes(1, 2).reshape(queries.shape)


@dataclass(frozen=True)
class _Layer:
    """A layer of the decoder: attention to what was written, to the instruction, and two linear maps."""

    own: _Attention
    said: _Attention
    widen: Linear
    narrow: Linear
    norms: tuple[Normalisation, Normalisation, Normalisation]


@dataclass(frozen=True)
class Instruction:
    """What the decoder knows of an instruction.

    Attributes:
        memory: (W, width) float32, its words.
        pointed: keys of the words (W, width) for the scores of starts and of ends.
        said: keys and values of the words (W, width), of each layer.
    """

    memory: np.ndarray
    pointed: tuple[np.ndarray, np.ndarray]
    said: Sequence[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Writings:
    """Goals that are being written, all of as many actions.

    Attributes:
        instructions: of each goal; those of one instruction follow one another.
        written: keys and values (goals, actions, width) of what was written so far, of each layer; empty at the
            beginning.
        length: how many actions were written.
    """

    instructions: tuple[Instruction, ...]
    written: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    length: int = 0

    def chosen(self, rows: Sequence[int]) -> Writings:
        """Return some of the goals, in this order; one that is named twice goes on in two ways."""
        written = tuple((keys[rows], values[rows]) for keys, values in self.written)
        return Writings(tuple(self.instructions[row] for row in rows), written, self.length)

    @property
    def groups(self) -> list[slice]:
        """Return the goals of each instruction."""
        starts = [row for row, one in enumerate(self.instructions) if row == 0 or one is not self.instructions[row - 1]]
        return [slice(start, end) for start, end in zip(starts, [*starts[1:], len(self.instructions)], strict=True)]


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

    def begin(
        self, states: np.ndarray, pieces: np.ndarray, first: Sequence[np.ndarray], presence: Sequence[Sequence[int]]
    ) -> list[Instruction]:
        """Begin to write the goals of B instructions.

        Args:
            states: (B, T, 384) float32 states of their word pieces, from the encoder's lower layers.
            pieces: (B, T) bool, false on padding.
            first: of each (W,) int: the first piece of each word.
            presence: of each (W,): whether each word names something in the scene, see `word_presence`.
        """
        for layer in self._upper:
            states = layer(states, pieces)
        found = []
        for state, places, named in zip(states, first, presence, strict=True):
            memory = self._normalise(self._remember(state[places])) + self.state["presence.weight"][list(named)]
            said = [(layer.said.key(memory), layer.said.value(memory)) for layer in self._layers]
            found.append(Instruction(memory, (self._start[1](memory), self._end[1](memory)), said))
        return found

    def scores(self, writings: Writings, last: Sequence[Action | None]) -> tuple[Writings, list[np.ndarray]]:
        """Take the last action of each goal and score its next: the goals with that action, and of each the logits
        (keywords + 2 W,) float32: of keywords, of starts, of ends.

        A weight is read once for all goals: for sixty it takes four times as long as for one.

        Args:
            writings: the goals.
            last: the action that was chosen for each; `None` at the beginning.
        """
        actions = zip(writings.instructions, last, strict=True)
        rows = np.stack([self._row(one, action) for one, action in actions])
        rows += self.state["positions.weight"][writings.length]
        groups, written = writings.groups, []
        instructions = [writings.instructions[group.start] for group in groups]
        for number, layer in enumerate(self._layers):
            x = layer.norms[0](rows)
            new = layer.own.key(x)[:, None], layer.own.value(x)[:, None]
            so_far = writings.written[number] if writings.written else (new[0][:, :0], new[1][:, :0])
            keys, values = (np.concatenate(each, axis=1) for each in zip(so_far, new, strict=True))
            written.append((keys, values))
            rows = rows + layer.own.to_each(x, keys, values)
            rows = rows + layer.said.to_shared(layer.norms[1](rows), groups, [one.said[number] for one in instructions])
            rows = rows + layer.narrow(gelu(layer.widen(layer.norms[2](rows))))
        rows = self._last(rows)
        scale = np.float32(WIDTH**-0.5)
        keywords, starts, ends = self._keyword(rows), self._start[0](rows) * scale, self._end[0](rows) * scale
        found: list[np.ndarray] = []
        for one, group in zip(instructions, groups, strict=True):
            pointed = starts[group] @ one.pointed[0].T, ends[group] @ one.pointed[1].T
            found += list(np.concatenate([keywords[group], *pointed], axis=-1))
        return Writings(writings.instructions, tuple(written), writings.length + 1), found

    def _row(self, instruction: Instruction, last: Action | None) -> np.ndarray:
        """Return what the last action of a goal gives the layers, (width,), without its place."""
        state = self.state
        kind, value = last or Action(KEYWORD, NUMBER_OF["<start>"])
        memory = instruction.memory[value : value + 1]
        row = state["keywords.weight"][value] if kind == KEYWORD else self._word(memory)[0]
        return row + state["kinds.weight"][kind]

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

"""Run BERT (Devlin et al. 2019), the network of the sentence encoder, in numpy.

A command that reads one sentence should answer at once, and a library that trains networks takes seconds to import. The
arithmetic is that of torch's encoder layers in float32; tests hold it to torch and to the library that published the
encoder.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

# Weight and bias of each part of a layer, in the order of `EncoderLayer`, as in torch's `TransformerEncoderLayer`.
_TORCH_NAMES = (
    ("self_attn.in_proj_weight", "self_attn.in_proj_bias"),
    ("self_attn.out_proj.weight", "self_attn.out_proj.bias"),
    ("norm1.weight", "norm1.bias"),
    ("linear1.weight", "linear1.bias"),
    ("linear2.weight", "linear2.bias"),
    ("norm2.weight", "norm2.bias"),
)
EPSILON = 1e-12  # of BERT's normalisations

# erf(x) = 1 - (a1 t + ... + a5 t^5) exp(-x^2) with t = 1 / (1 + p x), for x >= 0, within 1.5e-7: Abramowitz and Stegun,
# Handbook of Mathematical Functions, 7.1.26. Here p / sqrt(2) and a5 / 2 to a1 / 2, for half of 1 - erf(x / sqrt(2)).
_ERF_P = np.float32(0.3275911 / 2**0.5)
_HALF_ERF_A = tuple(np.float32(a / 2) for a in (1.061405429, -1.453152027, 1.421413741, -0.284496736, 0.254829592))
# So many values pass through `gelu` at once: four arrays of them stay in the processor's cache, which makes it three
# times faster than on whole batches.
_GELU_BLOCK = 32_768
# Up to so many rows are multiplied two by two: BLAS copies a matrix before it multiplies three rows or more by it.
# Measured with OpenBLAS 0.3.31 for the maps of the decoder: four rows 1.4 -> 0.7 ms, five 1.6 -> 1.0, six 1.4 -> 1.1.
_FEW = 6


def gelu(x: np.ndarray) -> np.ndarray:
    """Return x times the normal distribution's share below x, elementwise; overwrites the contiguous float32 `x`."""
    flat = x.reshape(-1)
    rows = [np.empty(min(_GELU_BLOCK, flat.size), dtype=np.float32) for _ in range(3)]
    for start in range(0, flat.size, _GELU_BLOCK):
        part = flat[start : start + _GELU_BLOCK]
        size, t, above = (row[: part.size] for row in rows)
        np.abs(part, out=size)
        np.multiply(size, _ERF_P, out=t)
        t += np.float32(1.0)
        np.reciprocal(t, out=t)
        np.multiply(t, _HALF_ERF_A[0], out=above)
        for a in _HALF_ERF_A[1:]:
            above += a
            above *= t
        above *= size
        size *= size
        size *= np.float32(-0.5)
        above *= np.exp(size, out=size)  # |x| times the share beyond |x|
        np.maximum(part, 0.0, out=part)
        part -= above
    return x


def softmax(x: np.ndarray, axis: int) -> np.ndarray:
    """Return the exponentials of `x` divided by their sum along an axis; minus infinity becomes 0."""
    shares = np.exp(x - x.max(axis=axis, keepdims=True))
    shares /= shares.sum(axis=axis, keepdims=True)
    return shares


@dataclass(frozen=True)
class Linear:
    """A linear map of rows: weight (out, in) float32 and bias (out,) float32.

    A weight whose columns lie one after another (numpy's order "F") is read as it lies, which takes a fifth less time.
    """

    weight: np.ndarray
    bias: np.ndarray

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Map rows (n, in) to (n, out)."""
        if 2 < len(rows) <= _FEW:
            found = np.empty((len(rows), len(self.bias)), dtype=np.float32)
            for first in range(0, len(rows), 2):
                np.matmul(rows[first : first + 2], self.weight.T, out=found[first : first + 2])
        else:
            found = rows @ self.weight.T
        found += self.bias
        return found


@dataclass(frozen=True)
class Normalisation:
    """A layer normalisation: scale and bias (width,) float32."""

    weight: np.ndarray
    bias: np.ndarray
    epsilon: float = EPSILON

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Bring each of the rows (n, width) to mean 0 and variance 1, then scale and shift it."""
        # `mean` comes to the same, and takes twice as long for a row.
        found = rows - np.add.reduce(rows, axis=-1, keepdims=True) / np.float32(rows.shape[-1])
        variance = np.einsum("nw,nw->n", found, found) / np.float32(rows.shape[-1])
        found /= np.sqrt(variance + np.float32(self.epsilon))[:, None]
        found *= self.weight
        found += self.bias
        return found


@dataclass(frozen=True)
class EncoderLayer:
    """A layer of a BERT: attention, then two linear maps, each followed by its normalisation.

    Attributes:
        heads: of the attention.
        attend: rows to queries, keys and values, one after another (3 width, width).
        join: the heads' answers to rows.
        after_attention, after_linear: the normalisations.
        widen, narrow: the two linear maps.
    """

    heads: int
    attend: Linear
    join: Linear
    after_attention: Normalisation
    widen: Linear
    narrow: Linear
    after_linear: Normalisation

    @classmethod
    def of(cls, state: Mapping[str, np.ndarray], heads: int) -> EncoderLayer:
        """Make a layer of the float32 arrays of torch's `TransformerEncoderLayer`, by their names there.

        Raises:
            KeyError: for an array that is missing; the message is its name.
        """
        pairs = [(state[weight], state[bias]) for weight, bias in _TORCH_NAMES]
        attend, join, first, widen, narrow, second = pairs
        return cls(
            heads, Linear(*attend), Linear(*join), Normalisation(*first), Linear(*widen), Linear(*narrow),
            Normalisation(*second),
        )  # fmt: skip

    def state(self) -> dict[str, np.ndarray]:
        """Return the arrays by their names in torch's `TransformerEncoderLayer`."""
        parts: tuple[Linear | Normalisation, ...] = (
            self.attend, self.join, self.after_attention, self.widen, self.narrow, self.after_linear,
        )  # fmt: skip
        return {
            name: array
            for names, part in zip(_TORCH_NAMES, parts, strict=True)
            for name, array in zip(names, (part.weight, part.bias), strict=True)
        }

    def __call__(self, states: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Compute the next states (B, T, width) from states (B, T, width), where `mask` (B, T) bool is true."""
        rows = states.reshape(-1, states.shape[-1])
        rows = self.after_attention(rows + self._attended(rows, mask))
        rows = self.after_linear(rows + self.narrow(gelu(self.widen(rows))))
        return rows.reshape(states.shape)

    def at(self, states: np.ndarray, mask: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Compute the next states (B, N, width) of some places (B, N) int alone: what the last layer is asked for."""
        width = states.shape[-1]
        rows = np.take_along_axis(states, places[..., None], axis=1).reshape(-1, width)
        query = Linear(self.attend.weight[:width], self.attend.bias[:width])(rows)
        others = Linear(self.attend.weight[width:], self.attend.bias[width:])(states.reshape(-1, width))
        key, value = np.split(others.reshape(*mask.shape, 2 * width), 2, axis=-1)
        answers = self._answers(query.reshape(*places.shape, width), key, value, mask)
        rows = self.after_attention(rows + self.join(answers.reshape(-1, width)))
        rows = self.after_linear(rows + self.narrow(gelu(self.widen(rows))))
        return rows.reshape(*places.shape, width)

    def _attended(self, rows: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Compute what the attention adds to rows (B T, width)."""
        query, key, value = np.split(self.attend(rows).reshape(*mask.shape, 3 * rows.shape[-1]), 3, axis=-1)
        return self.join(self._answers(query, key, value, mask).reshape(rows.shape))

    def _answers(self, query: np.ndarray, key: np.ndarray, value: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Compute what queries (B, N, width) find in keys and values (B, T, width), head by head."""
        each = query.shape[-1] // self.heads
        query, key, value = (
            part.reshape(*part.shape[:2], self.heads, each).swapaxes(1, 2) for part in (query, key, value)
        )
        scores = (query * np.float32(each**-0.5)) @ key.swapaxes(-1, -2)  # (B, heads, N, T)
        np.copyto(scores, np.float32("-inf"), where=~mask[:, None, None, :])
        return (softmax(scores, axis=-1) @ value).swapaxes(1, 2)  # (B, N, heads, each)


def under(state: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays whose names begin with a prefix, by the rest of their names."""
    return {name.removeprefix(prefix): array for name, array in state.items() if name.startswith(prefix)}


def layer_sizes(width: int, inner: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each array of a layer by its name in torch's `TransformerEncoderLayer`.

    Args:
        width: of the states.
        inner: width between the two linear maps.
    """
    weights = ((3 * width, width), (width, width), (width,), (inner, width), (width, inner), (width,))
    return {
        name: size
        for names, weight in zip(_TORCH_NAMES, weights, strict=True)
        for name, size in zip(names, (weight, weight[:1]), strict=True)
    }


@dataclass(frozen=True)
class Bert:
    """A network from word pieces to hidden states.

    Attributes:
        words: (pieces, width) float32, a state of each word piece; of a file in float32, only what is used is read.
        positions: (longest, width) float32, added to the states by their place; with BERT's mark of the first sentence.
        normalise: the normalisation before the first layer.
        layers: in their order.
    """

    words: np.ndarray
    positions: np.ndarray
    normalise: Normalisation
    layers: Sequence[EncoderLayer]

    def __call__(self, ids: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Compute the hidden states (B, T, width) of word pieces `ids` (B, T) int where `mask` (B, T) bool is true."""
        states = self.words[ids] + self.positions[: ids.shape[1]]
        states = self.normalise(states.reshape(-1, states.shape[-1])).reshape(states.shape)
        for layer in self.layers:
            states = layer(states, mask)
        return states

    @classmethod
    def from_pretrained(cls, path: Path, config: Mapping[str, Any], layers: int | None = None) -> Bert:
        """Load the network of a checkpoint in safetensors format, in float32; only what is needed of it is read.

        Args:
            path: of the checkpoint.
            config: of the checkpoint: "hidden_size", "num_attention_heads", "intermediate_size", "vocab_size",
                "max_position_embeddings", "num_hidden_layers".
            layers: how many of its layers to load; `None` for all.

        Raises:
            KeyError: for a tensor that the checkpoint does not have; the message is its name.
            ValueError, OSError, SafetensorError: for a checkpoint that cannot be read or does not fit its config.
        """
        from safetensors import safe_open

        width, inner, heads = config["hidden_size"], config["intermediate_size"], config["num_attention_heads"]
        count = config["num_hidden_layers"] if layers is None else layers
        with safe_open(path, framework="np") as file:
            held = set(file.keys())

            def tensor(name: str, *shape: int) -> np.ndarray:
                if name not in held:
                    raise KeyError(name)
                found = file.get_tensor(name).astype(np.float32, copy=False)
                if found.shape != shape:
                    raise ValueError(f"{name} has the shape {found.shape}, and the config says {shape}")
                return found

            def pair(name: str, *shape: int) -> tuple[np.ndarray, np.ndarray]:
                return tensor(f"{name}.weight", *shape), tensor(f"{name}.bias", shape[0])

            def linear(name: str, *shape: int) -> Linear:
                weight, bias = pair(name, *shape)
                return Linear(np.asfortranarray(weight), bias)

            def layer(name: str) -> EncoderLayer:
                attention, output = f"{name}.attention", f"{name}.output"
                three = [pair(f"{attention}.self.{part}", width, width) for part in ("query", "key", "value")]
                weight, bias = (np.concatenate(arrays) for arrays in zip(*three, strict=True))
                return EncoderLayer(
                    heads,
                    Linear(np.asfortranarray(weight), bias),
                    linear(f"{attention}.output.dense", width, width),
                    Normalisation(*pair(f"{attention}.output.LayerNorm", width)),
                    linear(f"{name}.intermediate.dense", inner, width),
                    linear(f"{output}.dense", width, inner),
                    Normalisation(*pair(f"{output}.LayerNorm", width)),
                )

            name = "embeddings.word_embeddings.weight"
            words = _mapped(path, name, (config["vocab_size"], width))
            words = tensor(name, config["vocab_size"], width) if words is None else words
            positions = tensor("embeddings.position_embeddings.weight", config["max_position_embeddings"], width)
            first = tensor("embeddings.token_type_embeddings.weight", config.get("type_vocab_size", 2), width)[0]
            normalise = Normalisation(*pair("embeddings.LayerNorm", width))
            return cls(words, positions + first, normalise, [layer(f"encoder.layer.{i}") for i in range(count)])


def _mapped(path: Path, name: str, shape: tuple[int, ...]) -> np.ndarray | None:
    """Return a tensor of a checkpoint that safetensors has opened, read where it is used; `None` if it is not there as
    float32 in this shape.

    A sentence uses a few of thirty thousand rows, which take half of a small network's memory.
    """
    with path.open("rb") as file:
        length = int.from_bytes(file.read(8), "little")
        entry = json.loads(file.read(length)).get(name)
    if entry is None or entry["dtype"] != "F32" or tuple(entry["shape"]) != shape:
        return None
    start = 8 + length + entry["data_offsets"][0]
    return np.asarray(np.memmap(path, dtype="<f4", mode="r", offset=start, shape=shape))

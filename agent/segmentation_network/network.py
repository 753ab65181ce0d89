"""Run the segmentation network in numpy: a small U-Net that tells objects from table and room, and votes for centres.

Torch trains it (`agent.training.segmentation.network`); a test holds this arithmetic to torch's. Loading torch would
take longer than everything else that perception does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.segmentation_network import WEIGHTS
from agent.segmentation_network.features import CHANNELS
from grounding.untrusted_files import check_weights, read_json
from structdiffusion.limits import WEIGHTS_BYTES

KIND = "segmentation"
CLASSES = 3  # beside the table, table, object
OUTPUTS = CLASSES + 3 + 2  # classes, vote, logarithm of the votes' spread, seed
VOTE_UNIT = 0.1  # m of a vote of 1
SPREAD_UNIT = 0.03  # m of a logarithm of the spread of 0
_WIDEST_LOG = 4.0  # of the spread
_LEVELS = 4


@dataclass(frozen=True)
class Seen:
    """What the network says about every pixel.

    Attributes:
        classes: (3, H, W) the probabilities to be beside the table, the table, and an object.
        votes: (3, H, W) metres from the pixel's point to the centre of what is seen of its object.
        spread: (H, W) metres by which the votes of that object are apart.
        seeds: (H, W) how near to the object's mean vote the pixel's is: 1 at it, 0 where there is no object.
    """

    classes: np.ndarray
    votes: np.ndarray
    spread: np.ndarray
    seeds: np.ndarray


class SegmentationNetwork:
    """The network.

    Args:
        state: arrays by their names in `agent.training.segmentation.network.SegmentationNetwork`.

    Raises:
        KeyError: for an array that is missing.
        ValueError: for an array with another shape.
    """

    def __init__(self, state: Mapping[str, np.ndarray]) -> None:
        self.state = {name: array.astype(np.float32) for name, array in state.items()}
        self._check()

    @classmethod
    def from_pretrained(cls, folder: Path) -> SegmentationNetwork:
        """Load the network of a folder.

        Raises:
            BadInput: for files that are missing or are no such network.
        """
        from safetensors import SafetensorError
        from safetensors.numpy import load_file

        try:
            kind = read_json(folder / "config.json")["kind"]
            if kind != KIND:
                raise ValueError(f"its kind is {kind!r}; legal: {KIND}")
            check_weights(folder / "model.safetensors", WEIGHTS_BYTES)
            return cls(load_file(folder / "model.safetensors"))
        except (OSError, ValueError, KeyError, TypeError, SafetensorError) as error:
            raise BadInput(f"{str(folder)!r} holds no segmentation network: {error}") from error

    def __call__(self, maps: np.ndarray) -> Seen:
        """Return what the network says of its input (CHANNELS, H, W) float32; H and W are even."""
        out = self.outputs(maps)
        strange = np.exp(out[:CLASSES] - out[:CLASSES].max(axis=0))
        spread = SPREAD_UNIT * np.exp(np.clip(out[CLASSES + 3], -_WIDEST_LOG, _WIDEST_LOG))
        seeds = 1.0 / (1.0 + np.exp(-out[CLASSES + 4]))
        return Seen(strange / strange.sum(axis=0), VOTE_UNIT * out[CLASSES : CLASSES + 3], spread, seeds)

    def outputs(self, maps: np.ndarray) -> np.ndarray:
        """Return the last layer's outputs (OUTPUTS, H, W)."""
        channels, height, width = maps.shape
        halves = maps.reshape(channels, height // 2, 2, width // 2, 2).transpose(0, 2, 4, 1, 3)
        state = np.ascontiguousarray(halves).reshape(4 * channels, height // 2, width // 2)
        levels = []
        for level in range(_LEVELS):
            state = self._block(self._block(state, f"down.{level}.0", 1 if level == 0 else 2), f"down.{level}.1")
            levels.append(state)
        for number, beside in enumerate(levels[-2::-1]):
            larger = state.repeat(2, axis=1).repeat(2, axis=2)[:, : beside.shape[1], : beside.shape[2]]
            fused = self._block(np.concatenate((larger, beside)), f"up.{number}.0")
            state = self._block(fused, f"up.{number}.1")
        out = _convolved(state, self.state["head.weight"], self.state["head.bias"])
        quarters = out.reshape(OUTPUTS, 2, 2, height // 2, width // 2).transpose(0, 3, 1, 4, 2)
        return quarters.reshape(OUTPUTS, height, width)

    def _block(self, state: np.ndarray, name: str, stride: int = 1) -> np.ndarray:
        out = _convolved(state, self.state[f"{name}.weight"], self.state[f"{name}.bias"], stride)
        return np.maximum(out, 0.0, out=out)

    def _check(self) -> None:
        inner = 4 * CHANNELS
        names = [f"down.{level}.{number}" for level in range(_LEVELS) for number in (0, 1)]
        for name in names:
            inner = self._checked(name, inner, 3)
        widths = [len(self.state[f"down.{level}.1.bias"]) for level in range(_LEVELS)]
        for number in range(_LEVELS - 1):
            inner = self._checked(f"up.{number}.0", inner + widths[_LEVELS - 2 - number], 1)
            inner = self._checked(f"up.{number}.1", inner, 3)
        if self._checked("head", inner, 1) != 4 * OUTPUTS:
            raise ValueError(f"'head.bias' has another length than {4 * OUTPUTS}")

    def _checked(self, name: str, inner: int, size: int) -> int:
        """Check a convolution's arrays; return its output channels."""
        weight, bias = self.state[f"{name}.weight"], self.state[f"{name}.bias"]
        if weight.shape != (len(bias), inner, size, size):
            raise ValueError(f"'{name}.weight' has the shape {weight.shape}; expected {(len(bias), inner, size, size)}")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise ValueError(f"{name!r} has numbers that are not finite")
        return len(bias)


@cache
def shipped_network() -> SegmentationNetwork:
    """Return the network that is part of the package."""
    return SegmentationNetwork.from_pretrained(WEIGHTS)


def _convolved(state: np.ndarray, weight: np.ndarray, bias: np.ndarray, stride: int = 1) -> np.ndarray:
    """Return a convolution (outer, H', W') of (inner, H, W) with weights (outer, inner, k, k), zeros around."""
    outer, inner, size, _ = weight.shape
    if size == 1:
        out = weight.reshape(outer, inner) @ state.reshape(inner, -1)
        return out.reshape(outer, *state.shape[1:]) + bias[:, None, None]
    padded = np.pad(state, ((0, 0), (1, 1), (1, 1)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, (size, size), axis=(1, 2))[:, ::stride, ::stride]
    rows, columns = windows.shape[1:3]
    patches = np.ascontiguousarray(windows.transpose(0, 3, 4, 1, 2)).reshape(inner * size * size, rows * columns)
    return (weight.reshape(outer, -1) @ patches).reshape(outer, rows, columns) + bias[:, None, None]

"""Classify pictures with EfficientNet-Lite0 (ImageNet, 1000 classes) in NumPy: 0.1 s a picture, nothing to import."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

SIDE = 224  # pixels of the square that the network was trained on
_CENTRE, _SCALE = 127.0, 128.0  # of the pixels' values in training
_EPSILON = 1e-3  # of the batch normalisation in TensorFlow's EfficientNets
_CAP = 6.0  # of the activation, ReLU6
# Kernel, stride of the first, repeats; the widths are those of the weights.
_STAGES = ((3, 1, 1), (3, 2, 2), (5, 2, 2), (3, 2, 3), (5, 1, 3), (5, 2, 4), (3, 1, 1))


@dataclass(frozen=True)
class _Convolution:
    """A convolution with its batch normalisation folded in.

    Attributes:
        weights: (C, K) of a pointwise convolution; (k, k, C) of a depthwise one.
        bias: (K,) or (C,).
    """

    weights: np.ndarray
    bias: np.ndarray


@dataclass(frozen=True)
class _Block:
    """An inverted bottleneck: expansion, depthwise convolution, projection."""

    expand: _Convolution | None
    depthwise: _Convolution
    project: _Convolution
    stride: int


class EfficientNetLite:
    """The network.

    Args:
        tensors: the weights, under the names of the package `efficientnet_lite_pytorch`.
    """

    def __init__(self, tensors: Mapping[str, np.ndarray]) -> None:
        stem = _folded(tensors, "_conv_stem", "_bn0")
        self._stem = _Convolution(stem.weights.transpose(2, 3, 1, 0).reshape(-1, len(stem.bias)), stem.bias)
        strides = [stride if k == 0 else 1 for _, stride, repeats in _STAGES for k in range(repeats)]
        self._blocks = [_block(tensors, f"_blocks.{k}.", stride) for k, stride in enumerate(strides)]
        self._head = _pointwise(tensors, "_conv_head", "_bn1")
        self._classes = _Convolution(np.ascontiguousarray(tensors["_fc.weight"].T), tensors["_fc.bias"])

    def logits(self, picture: np.ndarray) -> np.ndarray:
        """Return the scores (1000,) of ImageNet's classes for one picture (224, 224, 3), RGB in [0, 255]."""
        values = (picture.astype(np.float32) - _CENTRE) / _SCALE
        values = _relu6(_at_each_pixel(_patches(values), self._stem))
        for block in self._blocks:
            values = _through(block, values)
        features = _relu6(_at_each_pixel(values, self._head)).mean(axis=(0, 1))
        return features @ self._classes.weights + self._classes.bias


def _block(tensors: Mapping[str, np.ndarray], prefix: str, stride: int) -> _Block:
    expands = f"{prefix}_expand_conv.weight" in tensors  # the first block does not
    depthwise = _folded(tensors, f"{prefix}_depthwise_conv", f"{prefix}_bn1")
    return _Block(
        _pointwise(tensors, f"{prefix}_expand_conv", f"{prefix}_bn0") if expands else None,
        _Convolution(np.ascontiguousarray(depthwise.weights[:, 0].transpose(1, 2, 0)), depthwise.bias),
        _pointwise(tensors, f"{prefix}_project_conv", f"{prefix}_bn2"),
        stride,
    )


def _folded(tensors: Mapping[str, np.ndarray], convolution: str, norm: str) -> _Convolution:
    """Return a convolution, its weights (K, C, k, k), that does what the batch normalisation behind it did."""
    scale = tensors[f"{norm}.weight"] / np.sqrt(tensors[f"{norm}.running_var"] + _EPSILON)
    weights = tensors[f"{convolution}.weight"] * scale[:, None, None, None]
    return _Convolution(weights, tensors[f"{norm}.bias"] - tensors[f"{norm}.running_mean"] * scale)


def _pointwise(tensors: Mapping[str, np.ndarray], convolution: str, norm: str) -> _Convolution:
    folded = _folded(tensors, convolution, norm)
    return _Convolution(np.ascontiguousarray(folded.weights[:, :, 0, 0].T), folded.bias)


def _through(block: _Block, values: np.ndarray) -> np.ndarray:
    """Return (H', W', K) of one block for (H, W, C)."""
    inner = values
    if block.expand is not None:
        inner = _relu6(_at_each_pixel(values, block.expand))
    inner = _relu6(_depthwise(inner, block.depthwise, block.stride))
    inner = _at_each_pixel(inner, block.project)
    return inner + values if inner.shape == values.shape and block.stride == 1 else inner


def _at_each_pixel(values: np.ndarray, convolution: _Convolution) -> np.ndarray:
    """Return the 1x1 convolution (H, W, K) of values (H, W, C), as one product of matrices.

    A product for each row of pixels takes ten times as long on a machine whose cores are busy.
    """
    height, width, channels = values.shape
    product = values.reshape(-1, channels) @ convolution.weights
    product += convolution.bias
    return product.reshape(height, width, -1)


def _relu6(values: np.ndarray) -> np.ndarray:
    return np.clip(values, 0.0, _CAP, out=values)


def _padded(values: np.ndarray, kernel: int, stride: int) -> tuple[np.ndarray, int]:
    """Return the values (H, W, C) with zeros around them as TensorFlow's "same" has it, and the output's side."""
    side = values.shape[0]
    out = -(-side // stride)
    total = max((out - 1) * stride + kernel - side, 0)
    before = total // 2
    padded = np.zeros((side + total, side + total, values.shape[2]), np.float32)
    padded[before : before + side, before : before + side] = values
    return padded, out


def _patches(values: np.ndarray) -> np.ndarray:
    """Return the 3x3 neighbourhoods (112, 112, 27) of every second pixel of a picture (224, 224, 3)."""
    padded, out = _padded(values, 3, 2)
    near = [padded[i : i + 2 * out - 1 : 2, j : j + 2 * out - 1 : 2] for i in range(3) for j in range(3)]
    return np.concatenate(near, axis=2)


def _depthwise(values: np.ndarray, convolution: _Convolution, stride: int) -> np.ndarray:
    """Return the depthwise convolution (H', W', C) of values (H, W, C)."""
    kernel = len(convolution.weights)
    padded, out = _padded(values, kernel, stride)
    reach = stride * (out - 1) + 1
    result = np.empty((out, out, values.shape[2]), np.float32)
    result[:] = convolution.bias
    part = np.empty_like(result)
    for i in range(kernel):
        for j in range(kernel):
            np.multiply(padded[i : i + reach : stride, j : j + reach : stride], convolution.weights[i, j], out=part)
            result += part
    return result

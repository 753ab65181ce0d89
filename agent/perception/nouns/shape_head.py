"""Tell kinds of shapes apart by their numbers: a small network, trained by `agent.evaluation.nouns.train_shapes`."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

WEIGHTS = Path(__file__).with_name("shape_head.npz")


class ShapeHead:
    """A network with one hidden layer.

    Args:
        path: its weights: "mean" and "scale" (F,) of the features, "hidden" (F, H), "hidden_bias" (H,), "out" (H, K),
            "out_bias" (K,), and "kinds", the K names.
    """

    def __init__(self, path: Path = WEIGHTS) -> None:
        with np.load(path) as weights:
            self._mean, self._scale = weights["mean"], weights["scale"]
            self._hidden, self._hidden_bias = weights["hidden"].astype(np.float32), weights["hidden_bias"]
            self._out, self._out_bias = weights["out"].astype(np.float32), weights["out_bias"]
            self.kinds = tuple(map(str, weights["kinds"]))

    def shares(self, features: np.ndarray) -> dict[str, float]:
        """Return kind of shape -> probability, for one object's features (F,)."""
        values = (features - self._mean) / self._scale
        values = np.maximum(values @ self._hidden + self._hidden_bias, 0.0) @ self._out + self._out_bias
        shares = np.exp(values - values.max())
        return dict(zip(self.kinds, (shares / shares.sum()).tolist(), strict=True))


@lru_cache(maxsize=1)
def shape_head() -> ShapeHead:
    """Return the head that comes along."""
    return ShapeHead()

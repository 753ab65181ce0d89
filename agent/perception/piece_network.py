"""Say how likely two pieces are of one object: a small network, trained by
`agent.evaluation.segmentation.train_pieces`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

WEIGHTS = Path(__file__).with_name("piece_network.npz")
FARTHEST = 5.0  # standard deviations from the mean that a feature counts
_CERTAIN = 30.0  # logit: exponentials of more overflow


class PieceNetwork:
    """Some networks with two hidden layers, whose answers are averaged.

    Args:
        path: their weights: "features", the names (F,); "mean" and "scale" (F,) of these; "hidden" (N, F, H),
            "hidden_bias" (N, H), "second" (N, H, H), "second_bias" (N, H), "out" (N, H), "out_bias" (N,).
    """

    def __init__(self, path: Path = WEIGHTS) -> None:
        with np.load(path) as weights:
            self._weights = {name: weights[name].astype(np.float32) for name in weights.files if name != "features"}
            self.features = tuple(map(str, weights["features"]))

    def __call__(self, pairs: Sequence[Mapping[str, float]]) -> np.ndarray:
        """Return the probability (N,) that each pair of pieces, given by its features, is of one object."""
        values = np.array([[pair[name] for name in self.features] for pair in pairs], dtype=np.float32)
        own = self._weights
        values = np.clip((values - own["mean"]) / own["scale"], -FARTHEST, FARTHEST)
        hidden = np.maximum(values @ own["hidden"] + own["hidden_bias"][:, None], 0.0)  # (networks, N, H)
        hidden = np.maximum(hidden @ own["second"] + own["second_bias"][:, None], 0.0)
        logits = (hidden * own["out"][:, None]).sum(axis=-1) + own["out_bias"][:, None]
        return (1.0 / (1.0 + np.exp(-np.clip(logits, -_CERTAIN, _CERTAIN)))).mean(axis=0)


@cache
def piece_network() -> PieceNetwork:
    """Return the network that is part of the package."""
    return PieceNetwork()

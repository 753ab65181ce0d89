"""Train the head that tells kinds of shapes apart: `python -m agent.evaluation.nouns.train_shapes --out FILE.npz`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import torch

from agent.evaluation.nouns.shape_examples import shape_examples

_HIDDEN = 96
_EPOCHS = 200
_RATE, _DECAY = 3e-3, 3e-3
_SMOOTHING = 0.05  # of the labels: a can can be a candle
_HELD_OUT = 0.15
_BLOCK = 50


def train_shapes(features: np.ndarray, classes: list[str], seed: int) -> dict[str, np.ndarray]:
    """Return the weights of a head trained on features (N, F) with the kind of each; see `ShapeHead`."""
    kinds = sorted(set(classes))
    labels = torch.tensor([kinds.index(name) for name in classes])
    mean, scale = features.mean(axis=0), features.std(axis=0) + 1e-3
    values = torch.tensor((features - mean) / scale)
    generator = torch.Generator().manual_seed(seed)
    count = features.shape[1]
    hidden = torch.randn(count, _HIDDEN, generator=generator) * (2.0 / count) ** 0.5
    out = torch.randn(_HIDDEN, len(kinds), generator=generator) * (1.0 / _HIDDEN) ** 0.5
    parameters = [each.requires_grad_() for each in (hidden, torch.zeros(_HIDDEN), out, torch.zeros(len(kinds)))]
    optimizer = torch.optim.AdamW(parameters, lr=_RATE, weight_decay=_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, _EPOCHS)
    for _ in range(_EPOCHS):
        for batch in torch.randperm(len(labels), generator=generator).split(256):
            noisy = values[batch] + 0.05 * torch.randn(len(batch), count, generator=generator)
            scores = torch.relu(noisy @ parameters[0] + parameters[1]) @ parameters[2] + parameters[3]
            loss = torch.nn.functional.cross_entropy(scores, labels[batch], label_smoothing=_SMOOTHING)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        schedule.step()
    trained = [each.detach().numpy() for each in parameters]
    return {
        "mean": mean, "scale": scale, "hidden": trained[0].astype(np.float16), "hidden_bias": trained[1],
        "out": trained[2].astype(np.float16), "out_bias": trained[3], "kinds": np.array(kinds),
    }  # fmt: skip


def main() -> None:
    """Draw examples, train on most of them, and say how many of the others are told right."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="weights to write (.npz)")
    arguments.add_argument("--examples", type=int, default=12000)
    arguments.add_argument("--seed", type=int, default=1)
    given = arguments.parse_args()
    torch.set_num_threads(1)
    features, classes = drawn_examples(given.examples)
    write_and_report(features, classes, given.seed, given.out)


def drawn_examples(count: int) -> tuple[np.ndarray, list[str]]:
    """Return `count` examples, a multiple of 50, in a random order: always the same for the same count."""
    blocks = range(count // _BLOCK)
    places = sorted((2 - block % 2, block // 2) for block in blocks)  # two halves, which two processes can draw
    drawn = [shape_examples(_BLOCK, place) for place in places]
    features, classes = np.concatenate([own for own, _ in drawn]), [name for _, names in drawn for name in names]
    order = np.random.default_rng(0).permutation(len(classes))
    return features[order], [classes[place] for place in order]


def write_and_report(features: np.ndarray, classes: list[str], seed: int, out: Path) -> None:
    """Train a head, write its weights, and print its accuracy on the examples that were held out."""
    from agent.perception.nouns.shape_head import ShapeHead

    kept = round(len(classes) * (1.0 - _HELD_OUT))
    weights: dict[str, Any] = {**train_shapes(features[:kept], classes[:kept], seed)}
    np.savez(out, **weights)
    head = ShapeHead(out)
    told = [max((shares := head.shares(one)), key=shares.__getitem__) for one in features[kept:]]
    right = sum(one == other for one, other in zip(told, classes[kept:], strict=True))
    print(f"{right} of {len(told)} shapes that were held out are told right; wrote {out}")


if __name__ == "__main__":
    main()

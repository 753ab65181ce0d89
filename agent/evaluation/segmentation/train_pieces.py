"""Train the network that merges pieces: `python -m agent.evaluation.segmentation.train_pieces --out FILE.npz`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from agent.evaluation.rows import collect
from agent.evaluation.segmentation.piece_examples import OBJECTS, Example, examples_at, places
from agent.perception.piece_network import FARTHEST, PieceNetwork
from structdiffusion.objects.libraries import load_objects
from structdiffusion.parallel import in_parallel

_NETWORKS, _HIDDEN = 3, 48
_STEPS, _BATCH = 1500, 256
_RATE, _DECAY = 3e-3, 1e-2
_NOISE, _DROPPED = 0.1, 0.1  # of the scaled features, and share of the hidden units
_HELD_OUT = 0.1  # of the recordings


def train_pieces(examples: Sequence[Example], seed: int) -> dict[str, np.ndarray]:
    """Return the weights of the networks; see `PieceNetwork`."""
    names = list(examples[0].features)
    features = np.array([[one.features[name] for name in names] for one in examples], dtype=np.float32)
    mean, scale = features.mean(axis=0), features.std(axis=0) + 1e-2
    values = torch.from_numpy(np.clip((features - mean) / scale, -FARTHEST, FARTHEST))
    truth = torch.tensor([float(one.one) for one in examples])
    weight = torch.tensor([one.weight for one in examples], dtype=torch.float32)
    trained = [
        _trained(values, truth, weight, torch.Generator().manual_seed(seed + number)) for number in range(_NETWORKS)
    ]
    stacked = {name: np.stack([one[name] for one in trained]).astype(np.float16) for name in trained[0]}
    return {"features": np.array(names), "mean": mean, "scale": scale, **stacked}


def _trained(
    values: torch.Tensor, truth: torch.Tensor, weight: torch.Tensor, generator: torch.Generator
) -> dict[str, np.ndarray]:
    """Train one network on features (E, F)."""
    count = values.shape[1]
    parameters = {
        "hidden": torch.randn(count, _HIDDEN, generator=generator) * (2.0 / count) ** 0.5,
        "hidden_bias": torch.zeros(_HIDDEN),
        "second": torch.randn(_HIDDEN, _HIDDEN, generator=generator) * (2.0 / _HIDDEN) ** 0.5,
        "second_bias": torch.zeros(_HIDDEN),
        "out": torch.randn(_HIDDEN, generator=generator) * (1.0 / _HIDDEN) ** 0.5,
        "out_bias": torch.zeros(()),
    }
    optimizer = torch.optim.AdamW([one.requires_grad_() for one in parameters.values()], _RATE, weight_decay=_DECAY)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, _RATE, total_steps=_STEPS + 1)

    def dropped(hidden: torch.Tensor) -> torch.Tensor:
        kept = torch.rand(hidden.shape, generator=generator) >= _DROPPED
        return hidden * kept / (1.0 - _DROPPED)

    for _ in range(_STEPS):
        batch = torch.randint(len(values), (_BATCH,), generator=generator)
        noisy = values[batch] + _NOISE * torch.randn((_BATCH, count), generator=generator)
        hidden = dropped(torch.relu(noisy @ parameters["hidden"] + parameters["hidden_bias"]))
        hidden = dropped(torch.relu(hidden @ parameters["second"] + parameters["second_bias"]))
        logits = hidden @ parameters["out"] + parameters["out_bias"]
        losses = torch.nn.functional.binary_cross_entropy_with_logits(logits, truth[batch], reduction="none")
        loss = (losses * weight[batch]).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
    return {name: one.detach().numpy() for name, one in parameters.items()}


def main() -> None:
    """Draw examples, train on most of them, and say how many of the others are told right."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="weights to write (.npz)")
    arguments.add_argument("--tables", type=int, default=24, help="synthetic tables of each class")
    arguments.add_argument("--recordings", type=int, default=40, help="hard recordings of each structure")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--workers", type=int, default=2, help="processes that draw")
    given = arguments.parse_args()
    torch.set_num_threads(1)
    # Tables and scenes of seeds that no evaluation has by default.
    jobs = places(given.tables, given.recordings, 7000 + given.seed)
    drawn, _ = collect(
        "recordings described", in_parallel(examples_at, load_objects, (OBJECTS,), jobs, given.workers), len(jobs)
    )
    write_and_report([one for one in drawn if one], given.seed, given.out)


def write_and_report(drawn: list[list[Example]], seed: int, out: Path) -> None:
    """Train the networks on most recordings, write their weights, and print their accuracy on the others."""
    order = np.random.default_rng(seed).permutation(len(drawn))
    kept = round(len(drawn) * (1.0 - _HELD_OUT))
    training, others = ([one for k in part for one in drawn[k]] for part in (order[:kept], order[kept:]))
    weights: dict[str, Any] = {**train_pieces(training, seed)}
    np.savez(out, **weights)
    likely = PieceNetwork(out)([one.features for one in others])
    right = sum((share > 0.5) == one.one for share, one in zip(likely, others, strict=True))
    print(f"{right} of {len(others)} pairs of recordings that were held out are told right; wrote {out}")


if __name__ == "__main__":
    main()

"""Optimisation by the cross-entropy method, and of sampled poses by it (paper section V.A, "Optimization").

The paper's baseline starts from the samples of StructFormer or the CVAE and raises the structure
discriminator's score of the objects' poses; the structure's frame stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from structdiffusion.models.backbone import PoseBackbone
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import StructureGoal
from structdiffusion.planners.guidance import StructureScore
from structdiffusion.planners.samples import EncodedScene, SampleBatch
from structdiffusion.rotations import yaw_matrices

# Chosen on validation: with deviations three times as large fewer arrangements stand, and with ten times as large fewer
# still, because poses that the discriminator prefers then often intersect other objects.
_DEVIATION = (0.0015, 0.0015, 0.0005, 0.015)


def maximise(
    score: Callable[[Tensor], Tensor],
    start: Tensor,
    deviation: Tensor,
    generator: torch.Generator,
    *,
    population: int = 32,
    elites: int = 6,
    rounds: int = 5,
) -> tuple[Tensor, Tensor]:
    """Return the best points that K searches side by side have met, (K, ...), and their scores (K,).

    Each search draws from independent Gaussians and fits them to the elites, round by round. Every search
    has Gaussians of its own: the mean of several arrangements is no arrangement.

    Args:
        score: of candidates (K, M, ...), as (K, M); larger is better.
        start: (K, ...) the first means, which are candidates too: the result is never worse.
        deviation: the first deviations; broadcasts over `start`.
        generator: the only source of randomness.
        population: the number of candidates per search and round.
        elites: the number of best candidates to which the next round is fitted.
        rounds: the number of rounds.
    """
    mean, spread = start, deviation.expand_as(start)
    best, best_score = start, score(start[:, None])[:, 0]
    rows = torch.arange(len(start))
    for _ in range(rounds):
        noise = torch.randn(len(start), population, *start.shape[1:], generator=generator)
        candidates = mean[:, None] + spread[:, None] * noise
        scores = score(candidates)  # (K, M)
        chosen = candidates[rows[:, None], scores.topk(elites, dim=1).indices]  # (K, elites, ...)
        top, index = scores.max(dim=1)
        better = top > best_score
        best = torch.where(better.view(-1, *[1] * (best.dim() - 1)), candidates[rows, index], best)
        best_score = torch.where(better, top, best_score)
        mean, spread = chosen.mean(dim=1), chosen.std(dim=1)
    return best, best_score


@dataclass(frozen=True)
class PoseSearch:
    """A search that raises the structure discriminator's score of sampled arrangements.

    Attributes:
        structure: the discriminator.
        share: the share of the samples, the best ones, that are improved; the others stay as they were sampled.
        deviation: initial deviations of an object from its sampled pose: m along x, y and z, and rad.
    """

    structure: StructureDiscriminator
    share: float = 0.25
    deviation: tuple[float, float, float, float] = _DEVIATION

    def improve(
        self,
        model: PoseBackbone,
        seen: EncodedScene,
        samples: SampleBatch,
        state: Tensor,
        goal: StructureGoal,
        generator: torch.Generator,
    ) -> tuple[SampleBatch, Tensor]:
        """Improve the samples and their states (K, 1 + N, 9); they come in the order of their scores, best first."""
        frame, position, turn = model.decode_state(state)
        score = StructureScore.of(self.structure, seen, samples, goal)
        scores = score(position, turn)
        first = scores.argsort(descending=True)[: max(1, round(self.share * len(state)))]

        def moved(offset: Tensor) -> tuple[Tensor, Tensor]:  # (K', M, N, 4)
            there = position[first][:, None] + offset[..., :3]
            return there, yaw_matrices(offset[..., 3]) @ turn[first][:, None]

        def of(offset: Tensor) -> Tensor:
            tried = score[first.repeat_interleave(offset.shape[1])]
            return tried(*(part.flatten(0, 1) for part in moved(offset))).view(offset.shape[:2])

        start = torch.zeros(len(first), position.shape[1], 4)
        offset, found = maximise(of, start, torch.tensor(self.deviation), generator)
        better_position, better_turn = (part[:, 0] for part in moved(offset[:, None]))
        position, turn, scores = position.clone(), turn.clone(), scores.clone()
        position[first], turn[first], scores[first] = better_position, better_turn, found
        order = scores.argsort(descending=True)
        return samples[order], model.encode_state(frame, position, turn)[order]

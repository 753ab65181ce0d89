"""The paper's baselines as planners: the CVAE and StructFormer, each with or without the cross-entropy method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch

from grounding.spec import SHAPES, SLOTS_OF_SHAPE
from structdiffusion.cem import PoseSearch
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.structformer import StructFormer
from structdiffusion.observation import Arrangement, Goal, Scene
from structdiffusion.proposing import Observed, begin, finish, observed
from structdiffusion.ranking import Ranker


class CVAEPlanner:
    """Draws latents from the prior; each stands for one arrangement.

    Args:
        model: the network.
        ranker: the discriminators, or `None` for the order of sampling.
        search: improves what was sampled before it is ranked, where given.
    """

    def __init__(self, model: PoseCVAE, ranker: Ranker | None, search: PoseSearch | None = None) -> None:
        self.model, self.ranker, self.search = model, ranker, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """`count` arrangements, best first; without a ranker, in the order of sampling or of the search's score.

        Raises:
            ValueError: when the scene has too many objects.
        """
        seen = observed(scene, goal, self.model, False, generator)
        motions, frames = self.sample(seen, goal, count, generator)
        return finish(seen, scene, goal, motions, frames, self.ranker, generator)

    @torch.no_grad()
    def sample(
        self, seen: Observed, goal: Goal, count: int, generator: torch.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sampled motions (count, N, 4, 4) and structure frames (count, 4, 4)."""
        return _sampled(self.model, self.search, seen, goal, count, generator)


class StructFormerPlanner:
    """Samples one pose after another, by the network for the shape that was asked for.

    Where the shape is open, every network whose shape can carry the other slots makes its share.

    Args:
        models: the network for each shape.
        ranker: the discriminators, or `None` for the order of sampling.
        search: improves what was sampled before it is ranked, where given.
    """

    def __init__(
        self, models: Mapping[str, StructFormer], ranker: Ranker | None, search: PoseSearch | None = None
    ) -> None:
        self.models, self.ranker, self.search = models, ranker, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """`count` arrangements, best first; without a ranker, in the order of sampling or of the search's score.

        Raises:
            ValueError: when the scene has too many objects.
        """
        seen = observed(scene, goal, next(iter(self.models.values())), False, generator)
        motions, frames = self.sample(seen, goal, count, generator)
        return finish(seen, scene, goal, motions, frames, self.ranker, generator)

    @torch.no_grad()
    def sample(
        self, seen: Observed, goal: Goal, count: int, generator: torch.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sampled motions (count, N, 4, 4) and structure frames (count, 4, 4)."""
        asked = {slot for slot, _ in goal.spec.tokens()}
        shapes = [goal.spec.shape] if goal.spec.shape else [s for s in SHAPES if asked <= set(SLOTS_OF_SHAPE[s])]
        motions, frames = [], []
        for number, shape in enumerate(shapes):
            share = len(range(number, count, len(shapes)))
            if not share:
                continue
            told = replace(goal, spec=replace(goal.spec, shape=shape))
            of_shape, with_frames = _sampled(self.models[shape], self.search, seen, told, share, generator)
            motions.append(of_shape)
            frames.append(with_frames)
        return np.concatenate(motions), np.concatenate(frames)


def _sampled(
    network: PoseCVAE | StructFormer,
    search: PoseSearch | None,
    seen: Observed,
    goal: Goal,
    count: int,
    generator: torch.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """What one network samples, improved where there is a search: motions (count, N, 4, 4), frames (count, 4, 4)."""
    samples = begin(network, seen, goal, False, count, generator)
    state = network.sample(samples.condition, generator)
    if search is not None:
        samples, state = search.improve(network, seen, samples, state, goal, generator)
    return samples.motions(network, state)

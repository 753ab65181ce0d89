"""The paper's baselines as planners: the CVAE and StructFormer, each with or without the cross-entropy method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import torch

from grounding.spec import SHAPES, SLOTS_OF_SHAPE
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.structformer import StructFormer
from structdiffusion.observation import Arrangement, Goal, Scene
from structdiffusion.planners.cem import PoseSearch
from structdiffusion.planners.generative import Finish, Observed, Sampled, begin, observed


class CVAEPlanner:
    """Draws latents from the prior; each stands for one arrangement.

    Args:
        model: the network.
        finish: what becomes of samples: how they are set down, refined and ranked.
        search: improves what was sampled before, where given.
    """

    def __init__(self, model: PoseCVAE, finish: Finish = Finish(), search: PoseSearch | None = None) -> None:
        self.model, self.finish, self.search = model, finish, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """`count` arrangements, best first; without a ranker, in the order of sampling or of the search's score.

        Raises:
            ValueError: when the scene has too many objects.
        """
        seen = observed(scene, goal, self.model, False, generator)
        return self.finish(seen, scene, goal, self.sample(seen, goal, count, generator), generator)

    @torch.no_grad()
    def sample(self, seen: Observed, goal: Goal, count: int, generator: torch.Generator) -> Sampled:
        """`count` samples as the network gives them."""
        return _sampled(self.model, self.search, seen, goal, count, generator)


class StructFormerPlanner:
    """Samples one pose after another, by the network for the shape that was asked for.

    Where the shape is open, every network whose shape can carry the other slots makes its share.

    Args:
        models: the network for each shape.
        finish: what becomes of samples: how they are set down, refined and ranked.
        search: improves what was sampled before, where given.
    """

    def __init__(
        self, models: Mapping[str, StructFormer], finish: Finish = Finish(), search: PoseSearch | None = None
    ) -> None:
        self.models, self.finish, self.search = models, finish, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: Goal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """`count` arrangements, best first; without a ranker, in the order of sampling or of the search's score.

        Raises:
            ValueError: when the scene has too many objects.
        """
        seen = observed(scene, goal, next(iter(self.models.values())), False, generator)
        return self.finish(seen, scene, goal, self.sample(seen, goal, count, generator), generator)

    @torch.no_grad()
    def sample(self, seen: Observed, goal: Goal, count: int, generator: torch.Generator) -> Sampled:
        """`count` samples as the network gives them."""
        asked = {slot for slot, _ in goal.spec.tokens()}
        shapes = [goal.spec.shape] if goal.spec.shape else [s for s in SHAPES if asked <= set(SLOTS_OF_SHAPE[s])]
        parts = []
        for number, shape in enumerate(shapes):
            share = len(range(number, count, len(shapes)))
            if not share:
                continue
            told = replace(goal, spec=replace(goal.spec, shape=shape))
            parts.append(_sampled(self.models[shape], self.search, seen, told, share, generator))
        return Sampled.joined(parts)


def _sampled(
    network: PoseCVAE | StructFormer,
    search: PoseSearch | None,
    seen: Observed,
    goal: Goal,
    count: int,
    generator: torch.Generator,
) -> Sampled:
    """What one network samples, improved where there is a search."""
    samples = begin(network, seen, goal, False, count, generator)
    state = network.sample(samples.condition, generator)
    if search is not None:
        samples, state = search.improve(network, seen, samples, state, goal, generator)
    return samples.sampled(network, state)

"""The paper's baselines as planners: the CVAE and StructFormer, each with or without the cross-entropy method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import torch

from structdiffusion.models import structformer_name
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.structformer import StructFormer
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.cem import PoseSearch
from structdiffusion.planners.post_processor import PostProcessor
from structdiffusion.planners.samples import EncodedScene, PoseSamples, encode_scene, prepare_samples
from structdiffusion.structures import structure_named
from structdiffusion.word_tokens import UnknownWordError


class CVAEPlanner:
    """Draw latents from the prior; each stands for one arrangement.

    Args:
        model: the network.
        post_process: what becomes of samples: how they are set down, refined and ranked.
        search: an optimiser of the samples, or `None`.
    """

    def __init__(
        self, model: PoseCVAE, post_process: PostProcessor = PostProcessor(), search: PoseSearch | None = None
    ) -> None:
        self.model, self.post_process, self.search = model, post_process, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose `count` arrangements, best first; without a ranker, in the order of sampling or of the search's
        score.

        Raises:
            ValueError: if the scene has too many objects.
        """
        seen = encode_scene(scene, goal, self.model, False, generator)
        return self.post_process(seen, scene, goal, self.sample(seen, goal, count, generator), generator)

    @torch.no_grad()
    def sample(self, seen: EncodedScene, goal: StructureGoal, count: int, generator: torch.Generator) -> PoseSamples:
        """Sample `count` arrangements, as the network gives them."""
        return _sample(self.model, self.search, seen, goal, count, generator)


class StructFormerPlanner:
    """Sample one pose after another, with the network for the requested shape.

    If the shape is open, every network whose shape allows the other slots samples a share.

    Args:
        models: the network for each shape.
        post_process: what becomes of samples: how they are set down, refined and ranked.
        search: an optimiser of the samples, or `None`.
    """

    def __init__(
        self,
        models: Mapping[str, StructFormer],
        post_process: PostProcessor = PostProcessor(),
        search: PoseSearch | None = None,
    ) -> None:
        self.models, self.post_process, self.search = models, post_process, search

    @torch.no_grad()
    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose `count` arrangements, best first; without a ranker, in the order of sampling or of the search's
        score.

        Raises:
            ValueError: if the scene has too many objects.
        """
        seen = encode_scene(scene, goal, next(iter(self.models.values())), False, generator)
        return self.post_process(seen, scene, goal, self.sample(seen, goal, count, generator), generator)

    @torch.no_grad()
    def sample(self, seen: EncodedScene, goal: StructureGoal, count: int, generator: torch.Generator) -> PoseSamples:
        """Sample `count` arrangements, as the networks give them.

        Raises:
            UnknownWordError: if there is no network for the requested shape.
        """
        able = [shape for shape in self.models if structure_named(shape).can_carry(goal.spec)]
        shapes = [goal.spec.shape] if goal.spec.shape else able
        if goal.spec.shape and goal.spec.shape not in self.models:
            raise UnknownWordError(
                f"there is no network {structformer_name(goal.spec.shape)!r}; legal shapes: {', '.join(self.models)}"
            )
        parts = []
        for number, shape in enumerate(shapes):
            share = len(range(number, count, len(shapes)))
            if not share:
                continue
            goal_of_shape = replace(goal, spec=replace(goal.spec, shape=shape))
            parts.append(_sample(self.models[shape], self.search, seen, goal_of_shape, share, generator))
        return PoseSamples.concatenate(parts)


def _sample(
    network: PoseCVAE | StructFormer,
    search: PoseSearch | None,
    seen: EncodedScene,
    goal: StructureGoal,
    count: int,
    generator: torch.Generator,
) -> PoseSamples:
    """Sample from one network, and improve the samples if there is a search."""
    samples = prepare_samples(network, seen, goal, False, count, generator)
    state = network.sample(samples.condition, generator)
    if search is not None:
        samples, state = search.improve(network, seen, samples, state, goal, generator)
    return samples.decode(network, state)

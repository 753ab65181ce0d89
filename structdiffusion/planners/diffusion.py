"""The diffusion planner: from a scene and a goal to ranked arrangements, sampled by the diffusion model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.scheduler import NoiseScheduler
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.planners.guidance import StructureScore, guided
from structdiffusion.planners.post_processor import PostProcessor
from structdiffusion.planners.samples import EncodedScene, PoseSamples, encode_scene, prepare_samples

# Called with the current estimate of the clean motions: (step, steps, motions (K, N, 4, 4)).
Preview = Callable[[int, int, np.ndarray], None]


class DiffusionPlanner:
    """StructDiffusion (paper section V): sample poses from the diffusion model and rank them.

    Args:
        model: the denoiser.
        post_process: what becomes of samples: how they are set down, refined and ranked.
        sentence: condition the model on the sentence's embedding rather than on word tokens.
        steps: denoising steps.
        sampler: "ddim", or "ddpm" as in the paper (with 200 steps).
        guide: the discriminator that guides the denoising (see `guidance`), with
        guidance: its weight; 0 disables guidance.
        candidates: a fixed number of proposals that overrides the requested number, or `None`.
    """

    def __init__(
        self,
        model: PoseDiffusion,
        post_process: PostProcessor = PostProcessor(),
        *,
        sentence: bool = True,
        steps: int = 10,
        sampler: str = "ddim",
        guide: StructureDiscriminator | None = None,
        guidance: float = 0.0,
        candidates: int | None = None,
    ) -> None:
        self.model, self.post_process, self.sentence, self.candidates = model, post_process, sentence, candidates
        self.guide, self.guidance = guide, guidance if guide is not None else 0.0
        self.scheduler = NoiseScheduler(model.config.steps, model.config.prediction_type)
        self.scheduler.set_timesteps(steps, sampler)

    @torch.no_grad()
    def propose(
        self,
        scene: Scene,
        goal: StructureGoal,
        *,
        count: int = 64,
        generator: torch.Generator,
        preview: Preview | None = None,
    ) -> list[Arrangement]:
        """Propose `count` arrangements, best first; without a ranker, in the order of sampling.

        Raises:
            ValueError: if the sentence model gets no embedding, or the scene has too many objects.
        """
        seen = encode_scene(scene, goal, self.model, self.sentence, generator)
        sampled = self.sample(seen, goal, self.candidates or count, generator, preview)
        return self.post_process(seen, scene, goal, sampled, generator)

    @torch.no_grad()
    def sample(
        self,
        seen: EncodedScene,
        goal: StructureGoal,
        count: int,
        generator: torch.Generator,
        preview: Preview | None = None,
    ) -> PoseSamples:
        """Sample `count` arrangements, as the model gives them."""
        samples = prepare_samples(self.model, seen, goal, self.sentence, count, generator)
        score = StructureScore.of(self.guide, seen, samples, goal) if self.guide is not None and self.guidance else None
        state = torch.randn(count, 1 + len(seen.objects), 9, generator=generator)
        timesteps = self.scheduler.timesteps
        for index, timestep in enumerate(timesteps):
            now = timestep.expand(count)
            prediction = self.model(state, now, samples.condition)
            if score is not None:
                clean = self.scheduler.predict_original_sample(prediction, now, state)
                clean = guided(clean, self.scheduler.noise_level(timestep), self.guidance, self.model, score)
                prediction = self.scheduler.prediction_of(clean, now, state)
            step = self.scheduler.step(prediction, index, state, generator)
            state = step.prev_sample
            if preview is not None:
                preview(index + 1, len(timesteps), samples.decode(self.model, step.pred_original_sample).motions)
        return samples.decode(self.model, state)

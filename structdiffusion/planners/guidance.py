"""Guidance of the denoising by the gradient of the structure discriminator's score (paper appendix).

Classifier guidance (Dhariwal and Nichol 2021) adds s_t grad log p(y | x_t) to the noise that a denoiser predicts. The
discriminator was trained on clean scenes only, so it scores the clean state that the denoiser predicts. With the
covariance of that prediction taken as sigma_t^2 (Song et al. 2023: exact for data of unit variance), the
guided prediction is clean + weight * sigma_t^2 * grad log p(y | clean), and no gradient goes through the denoiser.
The paper instead guides with a collision discriminator trained on noisy poses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from structdiffusion.models.backbone import PoseBackbone
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.observation import StructureGoal
from structdiffusion.planners.samples import EncodedScene, SampleBatch
from structdiffusion.word_tokens import require_known_words, word_ids

# Gradients longer than this, per object and in units of the state, are shortened: at high noise a predicted state is
# unlike the scenes that the discriminator was trained on, and its gradient there can have any size.
_STEEPEST = 1.0


@dataclass(frozen=True)
class StructureScore:
    """The logarithm of the structure discriminator's score as a function of the goal poses.

    Attributes:
        structure: the discriminator.
        clouds: (K, N, P, 3) each about its mean, place by place, as in its training.
        nouns: (K, N) noun ids.
        words: (K, 5) word ids.
    """

    structure: StructureDiscriminator
    clouds: Tensor
    nouns: Tensor
    words: Tensor

    @classmethod
    def of(
        cls, structure: StructureDiscriminator, seen: EncodedScene, samples: SampleBatch, goal: StructureGoal
    ) -> StructureScore:
        """Make the score of these samples."""
        clouds = (seen.clouds - seen.clouds.mean(dim=1, keepdim=True))[samples.order]
        require_known_words(goal.spec, structure.config.vocabulary, structure.kind)
        words = torch.tensor([word_ids(goal.spec)]).expand(len(clouds), -1)
        return cls(structure, clouds, seen.nouns[samples.order], words)

    def __call__(self, position: Tensor, turn: Tensor) -> Tensor:
        """Score (K,) goal means (K, N, 3), world frame, and rotations (K, N, 3, 3)."""
        at_goal = torch.einsum("knij,knpj->knpi", turn, self.clouds) + position[:, :, None]
        present = torch.ones(self.nouns.shape, dtype=torch.bool)
        return torch.nn.functional.logsigmoid(self.structure(at_goal, present, self.nouns, self.words))

    def __getitem__(self, rows: Tensor) -> StructureScore:
        """Select some of the K, in another order, or some more than once."""
        return StructureScore(self.structure, self.clouds[rows], self.nouns[rows], self.words[rows])


def guided(
    clean: Tensor, sigma: float, weight: float, model: PoseBackbone, score: Callable[[Tensor, Tensor], Tensor]
) -> Tensor:
    """Move a predicted clean state (K, 1 + N, 9) toward a higher score.

    The structure frame stays where it is: the discriminator does not know where on the table a structure stands.

    Args:
        clean: the denoiser's prediction.
        sigma: the noise level sqrt(1 - abar_t) that it was predicted at.
        weight: of the guidance.
        model: decodes states.
        score: of positions (K, N, 3) and turns (K, N, 3, 3), world frame (see `StructureScore`).
    """
    with torch.enable_grad():
        objects = clean[:, 1:].detach().requires_grad_()
        _, position, turn = model.decode_state(torch.cat((clean[:, :1].detach(), objects), dim=1))
        (slope,) = torch.autograd.grad(score(position, turn).sum(), objects)
    steep = slope.norm(dim=-1, keepdim=True)
    slope = slope * (_STEEPEST / steep.clamp(min=_STEEPEST))
    return torch.cat((clean[:, :1], clean[:, 1:] + weight * sigma**2 * slope), dim=1)

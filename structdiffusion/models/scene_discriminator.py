"""What the networks share that judge a whole scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from structdiffusion.models.checkpoint import Checkpointed
from structdiffusion.models.encoders import fake_scenes
from structdiffusion.word_tokens import VOCABULARY


@dataclass(frozen=True)
class SceneConfig:
    """How much of a scene the network can be told.

    Attributes:
        max_objects: largest number of objects.
        nouns: number of noun ids besides "unknown" (see `tableware.noun_ids`).
        vocabulary: number of known word ids, including 0.
    """

    max_objects: int = 12
    nouns: int = 7
    vocabulary: int = VOCABULARY


class SceneDiscriminator(Checkpointed):
    """A network from a proposed scene (clouds at their goals, present, nouns, words) to one logit, whose sigmoid is the
    score.
    """

    def forward(self, clouds: Tensor, present: Tensor, nouns: Tensor, words: Tensor) -> Tensor:
        """Return logits (B,) of the scenes.

        Args:
            clouds: (B, N, P, 3) points at their goals, world frame, metres.
            present: (B, N) bool, at least one per row, absent objects last.
            nouns: (B, N) noun ids.
            words: (B, 5) word ids.
        """
        raise NotImplementedError

    @classmethod
    def fake_input(cls, batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
        """Return random scenes as `forward` takes them (see `encoders.fake_scenes`); `clouds` are at their goals."""
        return fake_scenes(batch, objects, generator)

    def answer_shape(self, given: Mapping[str, Tensor]) -> tuple[int, ...]:
        """Return the shape of the result of `try_out` for a fake input: a logit for each scene, (B,)."""
        return (len(given["clouds"]),)

    @torch.no_grad()
    def try_out(self, given: Mapping[str, Tensor], generator: torch.Generator) -> Tensor:
        """Return the logits of a fake input; nothing is drawn at random."""
        return self(**given)

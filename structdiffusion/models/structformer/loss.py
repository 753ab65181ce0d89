"""The negative log-likelihood of demonstrated poses, each given the true poses before it (teacher forcing)."""

from __future__ import annotations

import torch
from torch import Tensor

from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.backbone import POSE
from structdiffusion.models.structformer.model import StructFormer


def structformer_loss(
    model: StructFormer,
    data: DemonstrationBatches,
    generator: torch.Generator,
    scenes: int = 48,
    autocast: bool = False,
) -> dict[str, Tensor]:
    """Return the mean negative log-likelihood, nats per number, over `scenes` scenes of the model's shape.

    The frame has as much weight as all objects together: its position and heading are most of what words specify.
    With `autocast` the transformer computes in bfloat16, as in the diffusion model's loss.
    """
    batch = data.draw(scenes, generator)
    state = model.encode_state(batch.world_from_structure, batch.position, batch.turn)
    nouns = data.noun_ids(batch.object_ids, model.config.nouns, generator)
    condition = model.condition(batch.clouds, batch.present, nouns, words=batch.words, sentence=batch.sentence)
    with torch.autocast(state.device.type, dtype=torch.bfloat16, enabled=autocast):
        poses = model(state, condition)
    surprise = -poses.log_prob(state) / POSE  # (B, 1 + N)
    frame, objects = surprise[:, 0].mean(), surprise[:, 1:][condition.present].mean()
    return {"loss": frame + objects, "frame": frame, "objects": objects}

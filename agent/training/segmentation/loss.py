"""Define the loss of the segmentation network: classes, votes for centres, and the overlap of the resulting objects.

The votes of an object gather about their mean; how closely, the network says itself. A pixel belongs to an object by
exp(-d^2 / (2 s^2)), d its vote's distance from the mean and s the spread; the Lovasz hinge of that membership is
the loss of overlap (Neven et al., "Instance segmentation by jointly optimizing spatial embeddings and clustering
bandwidth", CVPR 2019), here in three dimensions and metres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch.nn import functional

from agent.segmentation_network.network import CLASSES, SPREAD_UNIT, VOTE_UNIT
from agent.training.segmentation.batches import LEAST, Example

_MOST_PIXELS = 2500  # of objects, of each view: the overlap of more is no other
_OBJECT_WEIGHT = 1.5  # of the class, against those of table and room
# The centres show the way at first; where two objects have the same one, overlap has to overrule it.
_WEIGHTS = {"classes": 1.0, "centres": 0.1, "overlap": 2.0, "spread": 0.3, "seeds": 2.0}


def segmentation_loss(
    outputs: torch.Tensor, examples: Sequence[Example], generator: torch.Generator
) -> dict[str, torch.Tensor]:
    """Return the weighted parts of the loss of outputs (B, OUTPUTS, H, W), and their sum as "loss"."""
    device = outputs.device
    truth = torch.from_numpy(np.stack([one.truth for one in examples])).to(device).long()
    known = torch.from_numpy(np.stack([one.known for one in examples])).to(device)
    classes = torch.clamp(truth, max=2)
    weight = torch.tensor([1.0, 1.0, _OBJECT_WEIGHT], device=device)
    logits = outputs[:, :CLASSES]
    every = functional.cross_entropy(logits, classes, weight, reduction="none")
    parts = {"classes": (every * known).sum() / known.sum().clamp(min=1)}
    terms: dict[str, list[torch.Tensor]] = {"centres": [], "overlap": [], "spread": [], "seeds": []}
    for index, one in enumerate(examples):
        level = torch.from_numpy(one.level).to(device)
        for name, value in _of_view(outputs[index], level, truth[index], known[index], generator).items():
            terms[name].append(value)
    parts |= {name: torch.stack(values).mean() if values else outputs.sum() * 0.0 for name, values in terms.items()}
    weighted = {name: _WEIGHTS[name] * value for name, value in parts.items()}
    return weighted | {"loss": sum(weighted.values(), outputs.new_zeros(()))}


def _of_view(
    output: torch.Tensor, level: torch.Tensor, truth: torch.Tensor, known: torch.Tensor, generator: torch.Generator
) -> dict[str, torch.Tensor]:
    """Return the parts of the loss that concern single objects of a view; none where it has no object."""
    seed = torch.sigmoid(output[CLASSES + 4])
    numbers, counts = torch.unique(truth[known & (truth > 1)], return_counts=True)
    numbers = numbers[counts >= LEAST]
    elsewhere = seed[known & (truth < 2)]
    if not len(numbers):
        return {"seeds": elsewhere.square().mean()} if len(elsewhere) else {}
    inside = torch.nonzero((known & torch.isin(truth, numbers)).flatten()).squeeze(1)
    if len(inside) > _MOST_PIXELS:
        order = torch.randperm(len(inside), generator=generator, device=generator.device)
        inside = inside[order[:_MOST_PIXELS].to(inside.device)]
    flat = output.flatten(1)[:, inside]
    points, own = level.reshape(-1, 3)[inside], truth.flatten()[inside]
    belongs = own[None] == numbers[:, None]  # (K, F)
    belongs = belongs[belongs.any(dim=1)]
    share = belongs / belongs.sum(dim=1, keepdim=True)
    votes = points + VOTE_UNIT * flat[CLASSES : CLASSES + 3].T
    spread_log = flat[CLASSES + 3]
    true_centres = share @ points
    of_object = belongs.float().argmax(dim=0)
    off = functional.smooth_l1_loss(votes, true_centres[of_object], reduction="none", beta=0.01).sum(dim=1)
    means, mean_log = share @ votes, share @ spread_log
    spread = SPREAD_UNIT * torch.exp(mean_log.clamp(-4.0, 4.0))
    distance = ((votes[None] - means[:, None]) ** 2).sum(dim=-1)
    member = torch.exp(-distance / (2 * spread[:, None] ** 2))
    own_member = member.gather(0, of_object[None])[0]
    seeds = (share @ (seed.flatten()[inside] - own_member.detach()).square()).mean()
    return {
        "centres": (share @ off).mean() / 0.02,
        "overlap": lovasz_hinge(2 * member - 1, belongs).mean(),
        "spread": (share @ (spread_log - mean_log.detach()[of_object]).square()).mean(),
        "seeds": seeds + (elsewhere.square().mean() if len(elsewhere) else 0.0),
    }


def lovasz_hinge(logits: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
    """Return the Lovasz hinge (K,) of logits (K, F) against labels (K, F).

    It is a convex bound of 1 minus intersection over union. Berman et al., "The Lovasz-Softmax loss", CVPR 2018.
    """
    signs = 2.0 * labels - 1.0
    errors, order = torch.sort(1.0 - logits * signs, dim=1, descending=True)
    sorted_labels = labels.gather(1, order).float()
    total = sorted_labels.sum(dim=1, keepdim=True)
    intersection = total - sorted_labels.cumsum(dim=1)
    union = total + (1.0 - sorted_labels).cumsum(dim=1)
    jaccard = 1.0 - intersection / union
    gradient = torch.cat((jaccard[:, :1], jaccard[:, 1:] - jaccard[:, :-1]), dim=1)
    return (functional.relu(errors) * gradient).sum(dim=1)

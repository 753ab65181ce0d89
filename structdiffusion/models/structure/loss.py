"""Training data and loss of the structure discriminator: right and wrong scenes (paper section IV.E)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from grounding.spec import LEGAL_VALUES, SLOTS
from structdiffusion.data.batches import Batch, DemonstrationBatches
from structdiffusion.models.structure.model import LOCAL_SLOTS, StructureDiscriminator
from structdiffusion.tableware import NOUNS
from structdiffusion.word_tokens import FIRST_VOCABULARY, WORDS


def at_goal(batch: Batch) -> Tensor:
    """Move the clouds (B, N, P, 3) rigidly to their goals, world frame."""
    mean = batch.clouds.mean(dim=2, keepdim=True)
    return torch.einsum("bnij,bnpj->bnpi", batch.turn, batch.clouds - mean) + batch.position[:, :, None]


def perturbed(clouds: Tensor, present: Tensor, generator: torch.Generator) -> Tensor:
    """Move a random subset of the objects of each scene, at least one, out of place.

    Shifts have a scale of 1 to 12 cm, and half of the subset is rotated as well; a tenth of the scenes is stretched as
    a whole instead, by a factor of 0.5 to 2.
    """
    batch, count, _, _ = clouds.shape
    device = clouds.device

    def rand(*shape: int) -> Tensor:
        return torch.rand(shape, generator=generator, device=device)

    share = rand(batch, 1) * 0.8 + 0.1
    moved = (rand(batch, count) < share) & present
    moved[torch.arange(batch, device=device), (rand(batch) * present.sum(1)).long()] = True
    scale = 0.015 * 8 ** rand(batch, 1, 1)
    shift = torch.randn(batch, count, 3, generator=generator, device=device) * scale
    # Tens of millimetres sideways, less in height; at least 1.2 cm, so that the error is visible.
    shift[..., 2] *= 0.4 * (rand(batch, 1) < 0.5)
    length = shift.norm(dim=-1, keepdim=True)
    shift = shift / length * length.clamp(min=0.012)
    angle = (rand(batch, count) * 2 - 1) * torch.pi * (rand(batch, count) < 0.5)
    c, s = angle.cos()[..., None], angle.sin()[..., None]
    mean = clouds.mean(dim=2, keepdim=True)
    offset = clouds - mean
    x, y, z = offset.unbind(-1)
    turned = torch.stack((c * x - s * y, s * x + c * y, z), dim=-1)
    wrong = torch.where(moved[..., None, None], turned + mean + shift[:, :, None], clouds)

    centre = (mean * present[..., None, None]).sum(1, keepdim=True) / present.sum(1)[:, None, None, None]
    factor = torch.exp((rand(batch, 1, 1, 1) * 2 - 1) * 0.69)
    factor = torch.where((factor - 1).abs() < 0.2, factor + torch.sign(factor - 1) * 0.2, factor)
    away = (mean - centre) * (factor - 1)
    away[..., 2] = 0
    return torch.where((rand(batch) < 0.1)[:, None, None, None], clouds + away, wrong)


def other_words(words: Tensor, generator: torch.Generator, vocabulary: int = FIRST_VOCABULARY) -> Tensor:
    """Replace the value of one local slot in the words (B, 5) by another value of the same slot, of a vocabulary."""
    changed = words.clone()
    for row in range(len(words)):
        slots = [slot for slot in LOCAL_SLOTS if words[row, slot] > 0]
        if not slots:
            continue
        slot = slots[int(torch.randint(len(slots), (1,), generator=generator, device=words.device))]
        known = (WORDS[SLOTS[slot], value] for value in LEGAL_VALUES[SLOTS[slot]])
        ids = [word for word in known if word < vocabulary]
        step = int(torch.randint(1, len(ids), (1,), generator=generator, device=words.device))
        changed[row, slot] = ids[(ids.index(int(words[row, slot])) + step) % len(ids)]
    return changed


@dataclass(frozen=True)
class Examples:
    """E labelled scenes, right or wrong.

    Attributes:
        clouds: (E, N, P, 3) at their goals, world frame; present: (E, N); nouns: (E, N) ids; words: (E, 5) ids.
        right: (E,) float, 1 if the scene matches the words.
        kind: (E,) index in `KINDS`.
    """

    clouds: Tensor
    present: Tensor
    nouns: Tensor
    words: Tensor
    right: Tensor
    kind: Tensor


KINDS = ("as demonstrated", "something out of place", "asked for otherwise")


def draw_examples(
    data: DemonstrationBatches, generator: torch.Generator, scenes: int, vocabulary: int = FIRST_VOCABULARY
) -> Examples:
    """Draw `scenes` demonstrations, as many perturbed ones, and a third as many with a wrong word."""
    batch = data.draw(scenes, generator, sentences=0.0)
    goal = at_goal(batch)
    # Present objects first: absent ones would leave gaps in the assignment of points to objects.
    order = (~batch.present).long().argsort(dim=1, stable=True)
    rows = torch.arange(scenes, device=goal.device)[:, None]
    goal, present, ids = goal[rows, order], batch.present[rows, order], batch.object_ids[rows, order]
    nouns = data.noun_ids(ids, NOUNS, generator)
    wrong = perturbed(goal, present, generator)
    words_wrong = other_words(batch.words, generator, vocabulary)
    third = scenes // 3
    right = torch.cat((torch.ones(scenes), torch.zeros(scenes), torch.zeros(third))).to(goal.device)
    # A goal without local words cannot be made wrong by changing one.
    right[2 * scenes :] = (words_wrong[:third] == batch.words[:third]).all(dim=1).float()
    kind = torch.arange(len(KINDS)).repeat_interleave(torch.tensor([scenes, scenes, third])).to(goal.device)
    kind[2 * scenes :] *= right[2 * scenes :] == 0
    return Examples(
        torch.cat((goal, wrong, goal[:third])),
        torch.cat((present, present, present[:third])),
        torch.cat((nouns, nouns, nouns[:third])),
        torch.cat((batch.words, batch.words, words_wrong[:third])),
        right,
        kind,
    )


def structure_loss(
    model: StructureDiscriminator, data: DemonstrationBatches, generator: torch.Generator, scenes: int = 32
) -> dict[str, Tensor]:
    """Return the binary cross-entropy over demonstrations, perturbed ones, and ones with a wrong word."""
    drawn = draw_examples(data, generator, scenes, model.config.vocabulary)
    logits = model(drawn.clouds, drawn.present, drawn.nouns, drawn.words)
    loss = nn.functional.binary_cross_entropy_with_logits(logits, drawn.right)
    accuracy = ((logits > 0) == (drawn.right > 0.5)).float().mean()
    return {"loss": loss, "accuracy": accuracy}

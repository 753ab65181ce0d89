"""The embedding parser's network: every word piece votes on every slot, and attention weighs the votes."""

from __future__ import annotations

import torch
from torch import nn
from torch.nn import functional

from grounding.spec import LEGAL_VALUES, SLOTS

OTHER_SHAPE = "other"  # a shape that somebody asked for and nobody here can build
# What the network can answer per slot; the last answer is always "unspecified".
ANSWERS: dict[str, tuple[str | None, ...]] = {
    slot: (*LEGAL_VALUES[slot], *((OTHER_SHAPE,) if slot == "shape" else ()), None) for slot in SLOTS
}


class SlotReader(nn.Module):
    """Hidden states of the sentence encoder to logits per slot.

    Args:
        width: of the encoder's hidden states.
        hidden: of the layer that all slots share.
    """

    def __init__(self, width: int = 384, hidden: int = 64) -> None:
        super().__init__()
        self.normalise = nn.LayerNorm(width)
        self.shared = nn.Linear(width, hidden)
        self.dropout = nn.Dropout(0.2)
        self.attention = nn.Linear(hidden, len(SLOTS))
        self.votes = nn.Linear(hidden, sum(len(answers) for answers in ANSWERS.values()))

    def forward(self, states: torch.Tensor, mask: torch.Tensor) -> list[torch.Tensor]:
        """What every word piece contributes to every answer.

        Args:
            states: (B, T, width) float32 hidden states.
            mask: (B, T) bool, false on padding.

        Returns:
            One tensor (B, T, answers) per slot, in the order of `SLOTS`; its sum over T is the logits.
        """
        x = self.dropout(functional.gelu(self.shared(self.dropout(self.normalise(states)))))
        weights = self.attention(x).masked_fill(~mask[..., None], float("-inf")).softmax(dim=1)
        votes = self.votes(x).split([len(answers) for answers in ANSWERS.values()], dim=-1)
        return [weights[..., i : i + 1] * vote for i, vote in enumerate(votes)]

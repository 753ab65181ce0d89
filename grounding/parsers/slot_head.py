"""Define the embedding parser's network: the sentence encoder's upper layers, trained further, and a head per slot.

The encoder's own upper layers are made for the meaning of a whole sentence. Here they continue from
its lower layers' word states as a copy that learned which word is about which slot. Then every word
piece votes on every slot, and attention weighs the votes: so an answer can be traced to its words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import nn
from torch.nn import functional

from grounding.parse_result import REFUSALS
from grounding.parsers.bert import encoder_layer
from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SLOTS

REFUSE = "refuse"
QUESTIONS = (*SLOTS, REFUSE)


def answers_of(shapes: Sequence[str]) -> Mapping[str, tuple[str | None, ...]]:
    """List what a network that was taught these shapes can answer per question.

    The last answer is always "unspecified", or "build it".
    """
    values = {**LEGAL_VALUES, "shape": tuple(shapes)}
    return {slot: (*values[slot], None) for slot in SLOTS} | {REFUSE: (*REFUSALS, None)}


# Those that the training language teaches.
ANSWERS = answers_of(FIRST_SHAPES)


class SlotReader(nn.Module):
    """A network from word states of the sentence encoder to votes on every question.

    Args:
        layers: how many transformer layers it has of its own.
        width: of the encoder's states; with `heads` and `inner` as the encoder has them.
        heads: of the attention within a layer.
        inner: width between a layer's two linear maps.
        hidden: of the layer that all questions share.
        shapes: those that it is taught, in the order of its answers.

    Attributes:
        answers: question -> what it can answer, in the order of its votes.
    """

    def __init__(
        self,
        layers: int = 4,
        width: int = 384,
        heads: int = 12,
        inner: int = 1536,
        hidden: int = 64,
        shapes: Sequence[str] = FIRST_SHAPES,
    ) -> None:
        super().__init__()
        self.answers = answers_of(shapes)
        self._counts = [len(self.answers[question]) for question in QUESTIONS]
        self.layers = nn.ModuleList(encoder_layer(width, heads, inner) for _ in range(layers))
        self.normalise = nn.LayerNorm(width)
        self.shared = nn.Linear(width, hidden)
        self.dropout = nn.Dropout(0.1)
        self.attention = nn.Linear(hidden, len(QUESTIONS))
        self.votes = nn.Linear(hidden, sum(self._counts))

    def forward(self, states: torch.Tensor, mask: torch.Tensor) -> list[torch.Tensor]:
        """Compute what every word piece contributes to every answer.

        Args:
            states: (B, T, width) float32 hidden states.
            mask: (B, T) bool, false on padding.

        Returns:
            One tensor (B, T, answers) per question, in the order of `QUESTIONS`; its sum over T is the logits.
        """
        for layer in self.layers:
            states = layer(states, src_key_padding_mask=~mask)
        x = self.dropout(functional.gelu(self.shared(self.dropout(self.normalise(states)))))  # (B, T, hidden)
        weights = self.attention(x).masked_fill(~mask[..., None], float("-inf")).softmax(dim=1)  # (B, T, questions)
        return [weights[..., i : i + 1] * vote for i, vote in enumerate(self.votes(x).split(self._counts, dim=-1))]

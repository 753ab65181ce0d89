"""Define the embedding parser's network for training, in torch; `grounding.parsers.slot_head.SlotReader` runs it."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import nn
from torch.nn import functional

from grounding.parsers.bert import EPSILON
from grounding.parsers.slot_head import HEADS, QUESTIONS, SlotReader, answers_of
from grounding.spec import FIRST_SHAPES


def encoder_layer(width: int, heads: int, inner: int, dropout: float = 0.1) -> nn.TransformerEncoderLayer:
    """Make one layer of a BERT: attention, then two linear maps, each followed by its normalisation."""
    return nn.TransformerEncoderLayer(
        width, heads, inner, dropout=dropout, activation="gelu", layer_norm_eps=EPSILON, batch_first=True
    )


class SlotNetwork(nn.Module):
    """A network from word states of the sentence encoder to votes on every question.

    Args:
        layers: how many transformer layers it has of its own.
        width: of the encoder's states.
        hidden: of the layer that all questions share.
        shapes: those that it is taught, in the order of its answers.
    """

    def __init__(
        self, layers: int = 4, width: int = 384, hidden: int = 64, shapes: Sequence[str] = FIRST_SHAPES
    ) -> None:
        super().__init__()
        self._sizes = (layers, width, hidden, tuple(shapes))
        self._counts = [len(answers) for answers in answers_of(shapes).values()]
        self.layers = nn.ModuleList(encoder_layer(width, HEADS, 4 * width) for _ in range(layers))
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

    @classmethod
    def of(cls, reader: SlotReader) -> SlotNetwork:
        """Make the network of a trained reader, to train it further."""
        network = cls(reader.layers, reader.width, reader.hidden, reader.shapes)
        network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in reader.state.items()})
        return network

    def reader(self) -> SlotReader:
        """Return the network as it is now, to parse with; later training does not change it."""
        state = {name: tensor.detach().numpy().copy() for name, tensor in self.state_dict().items()}
        return SlotReader(state, *self._sizes)

"""Define the goal network for training, in torch; `grounding.goal_network.decoder.GoalDecoder` runs it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from grounding.goal_network.beam_search import MOST_SAID
from grounding.goal_network.decoder import ENCODER_HEADS, ENCODER_WIDTH, HEADS, POSITIONS, WIDTH, GoalDecoder
from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS, NUMBER_OF, START
from grounding.goal_network.word_presence import PRESENCES, UNKNOWN
from grounding.goal_network.writer import ENCODER_LAYER
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.training.goal_lines import LabelledGoal
from grounding.training.precision import quick_steps
from grounding.training.slot_network import encoder_layer

UPPER = 6 - ENCODER_LAYER
LAYERS = 4


class GoalNetwork(nn.Module):
    """A network from the lower states of the sentence encoder to the actions that write a goal.

    Args:
        dropout: of its layers.
    """

    def __init__(self, dropout: float = 0.1) -> None:
        super().__init__()
        self.upper = nn.ModuleList(
            encoder_layer(ENCODER_WIDTH, ENCODER_HEADS, 4 * ENCODER_WIDTH, dropout) for _ in range(UPPER)
        )
        self.remember, self.memory_norm = nn.Linear(ENCODER_WIDTH, WIDTH), nn.LayerNorm(WIDTH)
        self.keywords, self.kinds = nn.Embedding(len(KEYWORDS), WIDTH), nn.Embedding(3, WIDTH)
        self.positions = nn.Embedding(POSITIONS, WIDTH)
        self.presence = nn.Embedding(PRESENCES, WIDTH)
        self.word = nn.Linear(WIDTH, WIDTH)
        self.layers = nn.ModuleList(
            nn.TransformerDecoderLayer(
                WIDTH, HEADS, 4 * WIDTH, dropout=dropout, activation="gelu", batch_first=True, norm_first=True
            )
            for _ in range(LAYERS)
        )
        self.norm = nn.LayerNorm(WIDTH)
        self.keyword = nn.Linear(WIDTH, len(KEYWORDS))
        self.start_query, self.start_key = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, WIDTH)
        self.end_query, self.end_key = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, WIDTH)
        self.dropout = nn.Dropout(dropout)

    def remembered(
        self, states: torch.Tensor, pieces: torch.Tensor, first: torch.Tensor, presence: torch.Tensor
    ) -> torch.Tensor:
        """Compute what the decoder knows of each word: (B, W, width).

        Args:
            states: (B, T, 384) float32 from the encoder's lower layers.
            pieces: (B, T) bool, false on padding.
            first: (B, W) int64: the first piece of each word.
            presence: (B, W) int64: whether each word names something in the scene, see `word_presence`.
        """
        for layer in self.upper:
            states = layer(states, src_key_padding_mask=~pieces)
        rows = states.gather(1, first[..., None].expand(-1, -1, states.shape[-1]))
        return self.memory_norm(self.remember(rows)) + self.presence(presence)

    def forward(
        self, memory: torch.Tensor, words: torch.Tensor, kinds: torch.Tensor, values: torch.Tensor
    ) -> torch.Tensor:
        """Score the action after each of the given ones: logits (B, L, keywords + 2 W).

        Args:
            memory: (B, W, width), see `remembered`.
            words: (B, W) bool, false on padding.
            kinds, values: (B, L) int64: the actions so far, the first is the start.
        """
        length = kinds.shape[1]
        pointed = self.word(memory).gather(
            1, values.clamp(max=memory.shape[1] - 1)[..., None].expand(-1, -1, memory.shape[-1])
        )
        written = (kinds == KEYWORD)[..., None]
        x = torch.where(written, self.keywords(torch.where(kinds == KEYWORD, values, 0)), pointed)
        x = self.dropout(x + self.kinds(kinds) + self.positions.weight[:length])
        later = torch.triu(torch.ones(length, length, dtype=torch.bool, device=x.device), 1)
        for layer in self.layers:
            x = layer(x, memory, tgt_mask=later, memory_key_padding_mask=~words)
        x = self.norm(x)
        starts = self.start_query(x) @ self.start_key(memory).transpose(1, 2) * WIDTH**-0.5
        ends = self.end_query(x) @ self.end_key(memory).transpose(1, 2) * WIDTH**-0.5
        padding = ~words[:, None]
        return torch.cat([self.keyword(x), starts.masked_fill(padding, -1e4), ends.masked_fill(padding, -1e4)], -1)

    @classmethod
    def of(cls, decoder: GoalDecoder, dropout: float = 0.1) -> GoalNetwork:
        """Make the network of a trained decoder, to train it further."""
        network = cls(dropout)
        network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in decoder.state.items()})
        return network

    def decoder(self) -> GoalDecoder:
        """Return the network as it is now, to read with; later training does not change it."""
        return GoalDecoder({name: tensor.detach().numpy().copy() for name, tensor in self.state_dict().items()})


@dataclass(frozen=True)
class GoalBatch:
    """Labelled instructions as tensors: B of them, T word pieces, W words and L actions in the longest.

    Attributes:
        states: (B, T, 384) float32.
        pieces: (B, T) bool.
        first: (B, W) int64.
        words: (B, W) bool.
        presence: (B, W) int64.
        kinds, values: (B, L) int64: the start and the actions before the last.
        right: (B, L, keywords + 2 W) bool: the right next actions, several where words stand in several places.
        asked: (B, L) bool, false on padding.
    """

    states: torch.Tensor
    pieces: torch.Tensor
    first: torch.Tensor
    words: torch.Tensor
    presence: torch.Tensor
    kinds: torch.Tensor
    values: torch.Tensor
    right: torch.Tensor
    asked: torch.Tensor

    @classmethod
    def of(cls, encoder: SentenceEncoder, rows: Sequence[LabelledGoal]) -> GoalBatch:
        """Encode labelled instructions of at most `MOST_SAID` words."""
        said = encoder.word_states([list(row.words[:MOST_SAID]) for row in rows], ENCODER_LAYER)
        count, width = said.first.shape
        length = max(len(row.steps) for row in rows)
        kinds, values = np.zeros((count, length), dtype=int), np.zeros((count, length), dtype=int)
        values[:, 0] = NUMBER_OF["<start>"]
        right = np.zeros((count, length, len(KEYWORDS) + 2 * width), dtype=bool)
        asked = np.zeros((count, length), dtype=bool)
        presence = np.full((count, width), UNKNOWN)
        for b, row in enumerate(rows):
            asked[b, : len(row.steps)] = True
            presence[b, : len(row.presence)] = row.presence[:MOST_SAID]
            for place, (kind, options) in enumerate(row.steps):
                offset = 0 if kind == KEYWORD else len(KEYWORDS) + (0 if kind == START else width)
                right[b, place, [offset + option for option in options]] = True
                if place + 1 < length:
                    kinds[b, place + 1], values[b, place + 1] = kind, options[0]
        arrays = (said.hidden, said.pieces, said.first, said.words, presence, kinds, values, right, asked)
        return cls(*(torch.from_numpy(array) for array in arrays))

    def loss(self, network: GoalNetwork) -> torch.Tensor:
        """Return the mean negative log-likelihood of an action; of several right ones any will do."""
        return self._losses(network).mean()

    def row_losses(self, network: GoalNetwork) -> torch.Tensor:
        """Return the mean loss of the actions of each instruction: (B,)."""
        rows = self.asked.nonzero()[:, 0]
        total = torch.zeros(len(self.asked)).index_add(0, rows, self._losses(network))
        return total / self.asked.sum(1)

    def _losses(self, network: GoalNetwork) -> torch.Tensor:
        """Return the loss of each action that is asked for, those of an instruction one after another."""
        with quick_steps():
            memory = network.remembered(self.states, self.pieces, self.first, self.presence)
            logits = network(memory, self.words, self.kinds, self.values)
        logits, right = logits.float()[self.asked], self.right[self.asked]
        likely = logits.masked_fill(~right, -1e9).logsumexp(-1)
        # A single hopeless word, such as a phrase that no longer stands there, must not lead a whole step.
        return (logits.logsumexp(-1) - likely).clamp(max=30.0)

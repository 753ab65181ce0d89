"""Low-rank weights beside a frozen network (Hu et al. 2021), and attention to a prompt that a batch shares."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn
from transformers import AttentionInterface

RANK, SCALE = 8, 2.0


class LowRank(nn.Module):
    """A linear layer with low-rank weights beside it: x W' + SCALE x A' B'."""

    def __init__(self, layer: nn.Linear) -> None:
        super().__init__()
        outputs, inputs = layer.weight.shape
        self.layer = layer
        self.a = nn.Parameter(torch.randn(RANK, inputs) / inputs**0.5)
        self.b = nn.Parameter(torch.zeros(outputs, RANK))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(..., inputs) to (..., outputs)."""
        return self.layer(x) + SCALE * (x @ self.a.to(x.dtype).T @ self.b.to(x.dtype).T)


class Prefix:
    """Attention to a prompt whose keys and values are shared by all texts of a batch, and to the text itself.

    The library's own attention would copy the prompt's keys and values for every text, which takes
    longer than the rest of a training step.
    """

    name = "shared_prefix"

    def __init__(self) -> None:
        self.seen: Any = None
        # (B, 1, T, T): 0 where a token sees another, else a large negative number.
        self.hidden = torch.empty(0)
        AttentionInterface.register(self.name, self._attend)

    def _attend(
        self, module: nn.Module, query: torch.Tensor, key: torch.Tensor, value: torch.Tensor, _mask: object,
        scaling: float, **_: object,
    ) -> tuple[torch.Tensor, None]:  # fmt: skip
        batch, heads, length, width = query.shape
        groups = key.shape[1]
        shared = heads // groups  # query heads that share one key head
        query = (query * scaling).reshape(batch, groups, shared * length, width)
        own = (query @ key.transpose(-1, -2)).reshape(batch, groups, shared, length, length)
        own = (own + self.hidden[:, :, None]).reshape(batch, groups, shared * length, length)
        layer = self.seen.layers[module.layer_idx]
        keys, values = layer.keys[0], layer.values[0]  # (groups, P, width)
        flat = query.transpose(0, 1).reshape(groups, -1, width)
        before = (flat @ keys.transpose(-1, -2)).reshape(groups, batch, shared * length, -1).transpose(0, 1)
        weights = torch.cat([before, own], dim=-1).softmax(dim=-1)
        on_prompt, on_own = weights.split([keys.shape[1], length], dim=-1)
        flat = on_prompt.transpose(0, 1).reshape(groups, batch * shared * length, -1)
        mixed = (flat @ values).reshape(groups, batch, shared * length, width).transpose(0, 1)
        mixed = mixed + on_own @ value
        return mixed.reshape(batch, heads, length, width).transpose(1, 2).contiguous(), None

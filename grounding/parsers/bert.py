"""Run BERT (Devlin et al. 2019) in torch's own layers, the network of the sentence encoder.

The transformers library runs it as well, and takes seconds to import; a command that reads one
sentence should not. A test holds this one to the library that published the encoder.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

# Where a tensor of torch's encoder layer stands in a BERT checkpoint; queries, keys and values are apart there.
_NAMES = {
    "self_attn.out_proj": "attention.output.dense",
    "norm1": "attention.output.LayerNorm",
    "linear1": "intermediate.dense",
    "linear2": "output.dense",
    "norm2": "output.LayerNorm",
}


def encoder_layer(width: int, heads: int, inner: int, dropout: float = 0.1) -> nn.TransformerEncoderLayer:
    """Make one layer of a BERT: attention, then two linear maps, each followed by its normalisation."""
    return nn.TransformerEncoderLayer(
        width, heads, inner, dropout=dropout, activation="gelu", layer_norm_eps=1e-12, batch_first=True
    )


class Bert(nn.Module):
    """Word pieces to hidden states.

    Args:
        config: of the checkpoint: "hidden_size", "num_attention_heads", "intermediate_size",
            "vocab_size", "max_position_embeddings", "num_hidden_layers".
        layers: how many of its layers to have; `None` for all.
    """

    def __init__(self, config: Mapping[str, Any], layers: int | None = None) -> None:
        super().__init__()
        width = config["hidden_size"]
        self.words = nn.Embedding(config["vocab_size"], width)
        self.positions = nn.Embedding(config["max_position_embeddings"], width)
        self.normalise = nn.LayerNorm(width, eps=1e-12)
        self.sentence = nn.Parameter(torch.zeros(width))  # BERT's mark of the first of two sentences
        self.layers = nn.ModuleList(
            encoder_layer(width, config["num_attention_heads"], config["intermediate_size"])
            for _ in range(config["num_hidden_layers"] if layers is None else layers)
        )

    def forward(self, ids: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """Compute the hidden states (B, T, width) of word pieces `ids` (B, T) int64 where `mask` (B, T) bool is true."""
        states = self.words(ids) + self.positions.weight[: ids.shape[1]] + self.sentence
        states = self.normalise(states)
        for layer in self.layers:
            states = layer(states, src_key_padding_mask=~mask)
        return states

    @classmethod
    def from_pretrained(cls, path: Path, config: Mapping[str, Any], layers: int | None = None) -> Bert:
        """Load the network of a checkpoint in safetensors format, in float32; only what is needed of it is read.

        Raises:
            KeyError: for a tensor that the checkpoint does not have; the message is its name.
            RuntimeError, OSError, SafetensorError: for a checkpoint that cannot be read or does not fit.
        """
        from safetensors import safe_open

        bert = cls(config, layers)
        with safe_open(path, framework="pt") as file:
            held = set(file.keys())

            def tensor(name: str) -> torch.Tensor:
                if name not in held:
                    raise KeyError(name)
                return file.get_tensor(name).float()

            state = {
                "words.weight": tensor("embeddings.word_embeddings.weight"),
                "positions.weight": tensor("embeddings.position_embeddings.weight"),
                "sentence": tensor("embeddings.token_type_embeddings.weight")[0],
            }
            for kind in ("weight", "bias"):
                state[f"normalise.{kind}"] = tensor(f"embeddings.LayerNorm.{kind}")
                for number in range(len(bert.layers)):
                    source = f"encoder.layer.{number}"
                    parts = [tensor(f"{source}.attention.self.{part}.{kind}") for part in ("query", "key", "value")]
                    state[f"layers.{number}.self_attn.in_proj_{kind}"] = torch.cat(parts)
                    for name, there in _NAMES.items():
                        state[f"layers.{number}.{name}.{kind}"] = tensor(f"{source}.{there}.{kind}")
        bert.load_state_dict(state)
        return bert.eval()

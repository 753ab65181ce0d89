"""Load any sentence encoder that a user names with the sentence-transformers library, for the embedding parser.

The encoder gives the same as `SentenceEncoder`: embeddings of sentences, and states of their word pieces. An encoder
without word states (a bag of words, a static table) has one state for each text: the embedding of the whole.
"""

from __future__ import annotations

import hashlib
import json
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from grounding.parsers.model_files import ModelFilesError, check_files, fetch, first_line, names_code
from grounding.parsers.sentence_encoder import (
    DEFAULT_MODEL,
    DEFAULT_SHA256,
    MAX_TOKENS,
    EncoderError,
    SentenceEncoder,
    TokenStates,
)

_FILES = ("*.json", "*.safetensors", "*.txt", "*.model")  # of the hub's; no pickled weights


def open_encoder(source: str | None) -> SentenceEncoder | NamedEncoder:
    """Open the encoder that a user names; all-MiniLM-L6-v2, wherever it lies, is the built-in one.

    Args:
        source: `None` or a name of all-MiniLM-L6-v2 for the built-in encoder, another folder, or a name on the
            Hugging Face hub.

    Raises:
        EncoderError: for an encoder that is not there or cannot be loaded.
    """
    if source in (None, DEFAULT_MODEL, DEFAULT_MODEL.partition("/")[2]):
        return SentenceEncoder()
    weights = Path(source) / "model.safetensors"
    if weights.is_file() and hashlib.sha256(weights.read_bytes()).hexdigest() == DEFAULT_SHA256:
        return SentenceEncoder(source)
    return NamedEncoder(source)


class NamedEncoder:
    """A sentence-transformers model, in float32 on the CPU.

    No code that comes with a model is run, and its weights are read as safetensors alone: it may come from anybody.

    Args:
        source: a folder, or a name on the Hugging Face hub.

    Raises:
        EncoderError: for a folder that is not there, and for a model that cannot be fetched or loaded.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.folder = _find_folder(source)
        self._model = _load(self.folder)

    def encode(self, texts: list[str], batch_size: int = 64) -> np.ndarray:
        """Embed sentences: (n, width) float32, at unit norm."""
        return self._model.encode(
            texts, batch_size=batch_size, show_progress_bar=False, normalize_embeddings=True, convert_to_numpy=True
        ).astype(np.float32)

    @cached_property
    def checksum(self) -> str:
        """Return the SHA-256 checksum of all weights and their names, in hexadecimal."""
        digest = hashlib.sha256()
        for name, tensor in sorted(self._model.state_dict().items()):
            digest.update(name.encode())
            digest.update(tensor.contiguous().numpy().tobytes())
        return digest.hexdigest()

    @cached_property
    def state_width(self) -> int:
        """Return the width of the states that `token_states` gives."""
        return self.token_states(["a"]).hidden.shape[-1]

    def token_states(self, texts: list[str], layer: int | None = None) -> TokenStates:
        """Compute the last hidden states of one batch of texts; of whole texts where the encoder has none of words.

        Args:
            texts: B texts.
            layer: must be `None`: of a named encoder only the last layer's states can be had.
        """
        if layer is not None:
            raise ValueError(f"of a named encoder only the last layer's states can be had, not those of layer {layer}")
        if not self._has_word_states:
            hidden = self.encode(texts)[:, None]
            return TokenStates(hidden, np.ones((len(texts), 1), dtype=bool), [[(0, len(text))] for text in texts])
        pieces = self._model.tokenizer(
            texts, padding=True, truncation=True, max_length=self._longest, return_tensors="pt",
            return_offsets_mapping=True
        )
        spans = [[(int(first), int(last)) for first, last in row] for row in pieces.pop("offset_mapping")]
        import torch

        with torch.inference_mode():
            hidden = self._model[0](dict(pieces))["token_embeddings"].float().numpy()
        return TokenStates(hidden, pieces["attention_mask"].bool().numpy(), spans)

    def overflowing(self, texts: list[str]) -> list[bool]:
        """Return for each text whether it has more word pieces than the network can take; runs no network."""
        if not texts or not self._has_word_states:
            return [False] * len(texts)
        return [len(pieces) > self._longest for pieces in self._model.tokenizer(texts, truncation=False)["input_ids"]]

    @property
    def whole_words(self) -> frozenset[str]:
        """Return the correctly spelled words: those of the built-in encoder, whatever the pieces of this one."""
        return _built_in().whole_words

    @cached_property
    def _longest(self) -> int:
        return min(MAX_TOKENS, self._model.max_seq_length or MAX_TOKENS)

    @cached_property
    def _has_word_states(self) -> bool:
        """Return whether the first module is a transformer whose tokenizer gives the place of each piece in the
        text.
        """
        import torch

        tokenizer = getattr(self._model, "tokenizer", None)
        if not getattr(tokenizer, "is_fast", False):
            return False
        pieces = tokenizer(["a word"], return_tensors="pt")
        with torch.inference_mode():
            states = self._model[0](dict(pieces)).get("token_embeddings")
        return states is not None and states.shape[:2] == pieces["input_ids"].shape


@lru_cache(maxsize=1)
def _built_in() -> SentenceEncoder:
    return SentenceEncoder()


def _find_folder(source: str) -> Path:
    path = Path(source).expanduser()
    if path.is_dir():
        return path
    if path.is_absolute() or source.startswith((".", "~")) or source.count("/") > 1:
        raise EncoderError(f"no sentence encoder at {source!r}: there is no such folder")
    try:
        return fetch(source if "/" in source else f"sentence-transformers/{source}", _FILES)
    except ModelFilesError as error:
        raise EncoderError(str(error)) from error


def _load(folder: Path) -> Any:
    try:
        if _brings_code(folder):
            raise ModelFilesError("it needs code of its own, which is never run")
        from sentence_transformers import SentenceTransformer
        from transformers.utils import logging

        logging.set_verbosity_error()
        logging.disable_progress_bar()
        model = SentenceTransformer(
            str(folder),
            device="cpu",
            trust_remote_code=False,
            local_files_only=True,
            model_kwargs={"use_safetensors": True},
        )
    except Exception as error:  # the library raises many kinds
        raise EncoderError(f"the sentence encoder in {folder} cannot be loaded: {first_line(error)}") from error
    return model.float().eval()


def _brings_code(folder: Path) -> bool:
    """Return whether any file of the model names code outside the libraries.

    Raises:
        ModelFilesError: for files that are missing or cannot be read.
    """
    configs, modules = sorted(folder.rglob("config.json")), folder / "modules.json"
    if not modules.is_file() and not (folder / "config.json").is_file():
        raise ModelFilesError("it has neither modules.json nor config.json")
    for path in configs:
        check_files(path.parent)
    if any(names_code(path.parent) for path in configs):
        return True
    if not modules.is_file():
        return False
    try:
        listed = json.loads(modules.read_text(encoding="utf-8"))
        return not all(str(module["type"]).startswith("sentence_transformers.") for module in listed)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise ModelFilesError("modules.json is no list of modules with their types") from error

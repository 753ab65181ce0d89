"""Compute the language half of the training data: every corpus sentence, its embedding and its word tokens.

It is here because the networks import neither the corpus nor the encoder.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from grounding.corpus.grammar import CORPUS_SHAPES, OBJECT_WORDS, all_sentences
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.spec import SHAPES
from structdiffusion.data.npz_files import save_arrays
from structdiffusion.word_tokens import word_ids

# Users name the objects where the corpus says "objects"; each noun shifts the embedding a little.
_NOUNS = ("cups", "mugs", "bowls", "plates", "cans", "boxes", "bottles", "blocks", "jars", "dishes", "candles", "toys")


def write_language(folder: str | Path, encoder: SentenceEncoder, seed: int = 0) -> int:
    """Write `language.npz`: embeddings (L, 384) float16 and word ids (L, 5) int8; returns L.

    Every sentence of the grammar is written, those of the shapes that the parsers' corpus lacks included; those about
    objects once more with a household noun.
    """
    rng = np.random.default_rng(seed)
    texts, words = [], []
    later = [shape for shape in SHAPES if shape not in CORPUS_SHAPES]
    for text, spec in all_sentences((*CORPUS_SHAPES, *later)):
        texts.append(text)
        words.append(word_ids(spec))
        general = next((word for word in OBJECT_WORDS if f" {word}" in text), None)
        if general is not None:
            texts.append(text.replace(f" {general}", f" {rng.choice(_NOUNS)}", 1))
            words.append(word_ids(spec))
    folder = Path(folder)
    arrays: dict[str, np.ndarray] = {
        "embeddings": encoder.encode(texts).astype(np.float16), "words": np.array(words, dtype=np.int8),
    }  # fmt: skip
    save_arrays(folder / "language.npz", arrays)
    return len(texts)

"""Embed the nouns that an unknown noun is compared with; those of the lexicon are stored, because all of them at once
take as long as the rest of a sentence.

`python -m grounding.training.noun_embeddings` writes the stored ones anew after a change of the lexicon. A noun that is
not among them is embedded when it is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

STORED = Path(__file__).parent / "data" / "noun_embeddings.npz"


def embed_nouns(nouns: Sequence[str], encoder: SentenceEncoder) -> np.ndarray:
    """Return the embeddings (N, 384) float32 of nouns, from the stored ones where they are of this encoder."""
    checksum, known = stored_embeddings()
    if checksum != encoder.checksum:
        known = {}
    rest = [noun for noun in nouns if noun not in known]
    found = {**known, **dict(zip(rest, encoder.encode(rest), strict=True))}
    return np.array([found[noun] for noun in nouns], dtype=np.float32)


@cache
def stored_embeddings() -> tuple[str, dict[str, np.ndarray]]:
    """Load the checksum of the encoder that made the stored embeddings, and the embedding (384,) of each noun."""
    with np.load(STORED, allow_pickle=False) as stored:
        return str(stored["encoder_sha256"]), dict(zip(stored["nouns"].tolist(), stored["embeddings"], strict=True))

"""Write the stored embeddings of the lexicon's nouns: `python -m grounding.training.noun_embeddings`."""

from __future__ import annotations

import numpy as np

from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.resolve.object_names import KNOWN_NOUNS, STORED


def main() -> None:
    """Embed all known nouns with the built-in encoder, and store them in float16."""
    encoder, nouns = SentenceEncoder(), list(KNOWN_NOUNS)
    STORED.parent.mkdir(exist_ok=True)
    embeddings = encoder.encode(nouns).astype(np.float16)
    np.savez_compressed(STORED, encoder_sha256=encoder.checksum, nouns=np.array(nouns), embeddings=embeddings)


if __name__ == "__main__":
    main()

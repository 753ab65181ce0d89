"""Draw sentences with five slots, and fit temperatures: what the trainings of the two parsers share."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from grounding.corpus.grammar import all_sentences, split_of
from grounding.corpus.paraphrases import LabelledText, paraphrase
from grounding.corpus.templates import all_frames

TEMPERATURES = tuple(np.geomspace(0.25, 8.0, 61).tolist())
_MOST_MISFIT = 14.0  # of a row: one that is hopeless must not decide


def draw_sentences(rng: np.random.Generator, grammar: float, refused: float = 0.0) -> Iterator[LabelledText]:
    """Draw labelled sentences without end.

    Args:
        rng: draws.
        grammar: share of the sentences of the grammar; its held-out splits are never drawn.
        refused: share of those that must be refused, besides what the others have of them.
    """
    sentences = [(text, spec) for text, spec in all_sentences() if split_of(text) == "seen"]
    frames = [frame for each in all_frames().values() for frame in each if frame.refuse]
    while True:
        kind = rng.random()
        if kind < grammar:
            text, spec = sentences[rng.integers(len(sentences))]
            yield LabelledText(text, spec.to_dict())
        elif kind < grammar + refused:
            yield paraphrase(rng, frames[rng.integers(len(frames))])
        else:
            yield paraphrase(rng)


def misfit(logits: np.ndarray, right: np.ndarray) -> float:
    """Return the negative log-likelihood of right answers.

    Args:
        logits: (rows, answers) float.
        right: (rows, answers) bool; several answers may be right.
    """
    likely = np.logaddexp.reduce(np.where(right, logits, -np.inf), axis=1)
    return float(np.minimum(np.logaddexp.reduce(logits, axis=1) - likely, _MOST_MISFIT).sum())


def temperature(logits: np.ndarray, right: np.ndarray) -> float:
    """Return the temperature that makes right answers the likeliest; see `misfit`."""
    return min(TEMPERATURES, key=lambda value: misfit(logits / value, right))

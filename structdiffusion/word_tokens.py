"""Word tokens: an id for every value of every slot."""

from __future__ import annotations

from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SHAPES, SLOTS, StructureSpec

# Ids are part of checkpoints: the words of later shapes come after all others, so that adding a shape changes no id.
# A network knows as many words as there were when it was trained; every network knows `FIRST_SHAPES`.
_WORDS = [(slot, value) for slot in SLOTS for value in LEGAL_VALUES[slot]]
_LATER = [("shape", shape) for shape in SHAPES if shape not in FIRST_SHAPES]

# 0 is "not specified", then every value of every slot has an id of its own.
WORDS = {word: i + 1 for i, word in enumerate([word for word in _WORDS if word not in _LATER] + _LATER)}
VOCABULARY = len(WORDS) + 1
FIRST_VOCABULARY = VOCABULARY - len(_LATER)
WORD_TOKENS = len(SLOTS)


class UnknownWordError(ValueError):
    """Raised if a network is asked for something that it was not trained on; the message names both."""


def word_ids(spec: StructureSpec) -> list[int]:
    """Return the five word-token ids of a spec, slot by slot; 0 where unspecified, and for a figure."""
    return [WORDS.get((slot, value or ""), 0) for slot, value in spec.to_dict().items()]


def are_known_words(spec: StructureSpec, vocabulary: int) -> bool:
    """Return whether a network with so many word ids, 0 included, was trained on every value of a spec."""
    return all(WORDS.get(word, vocabulary) < vocabulary for word in spec.tokens())


def require_known_words(spec: StructureSpec, vocabulary: int, network: str) -> None:
    """Refuse a spec with values that the network does not know.

    Args:
        spec: the requested structure.
        vocabulary: of the network: how many ids it has, 0 included.
        network: its name.

    Raises:
        UnknownWordError: for a value that it was not trained on.
    """
    for slot, value in spec.tokens():
        if WORDS.get((slot, value), vocabulary) >= vocabulary:  # figures have no words
            raise UnknownWordError(
                f"the network {network!r} was not trained on the {slot} {value!r}: train it on scenes that have it, or "
                "use the model 'geometric', which needs no training"
            )

"""Word tokens: an id for every value of every slot."""

from __future__ import annotations

from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec

# Word tokens: 0 is "not specified", then every value of every slot has an id of its own.
WORDS = {word: i + 1 for i, word in enumerate((slot, value) for slot in SLOTS for value in LEGAL_VALUES[slot])}
VOCABULARY = len(WORDS) + 1
WORD_TOKENS = len(SLOTS)


def word_ids(spec: StructureSpec) -> list[int]:
    """The five word-token ids of a spec, slot by slot; 0 where unspecified."""
    return [WORDS.get((slot, value), 0) for slot, value in spec.to_dict().items()]

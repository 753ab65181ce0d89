"""Draw sentences of the training language of the five slots, as tasks of the goal network.

They are what labelled instructions have few of: short and plain wishes for one structure, and its sizes, sides and
headings in many words.
"""

from __future__ import annotations

import re

import numpy as np

from grounding.corpus.grammar import OBJECT_WORDS, all_sentences, split_of
from grounding.corpus.paraphrases import paraphrase
from grounding.spec import SLOTS_OF_SHAPE
from grounding.training.goal_lines import LabelError, LabelledGoal, labelled

GRAMMAR = 0.2  # share of the sentences of the grammar; its held-out splits are never drawn
# Words that leave open which objects are meant, or leave some out: no label follows from the slots alone.
_OPEN = re.compile(
    r"\b(?:some|most|few|couple|several|any|half|bunch|each|every|two|three|four|five|six|other|remaining|rest|first|last|but|"
    r"except|apart|same|favou?rite|rn)\b",
    re.IGNORECASE,
)
_EXCEPTED = re.compile(
    r"\b(?:except|excluding|apart|besides|minus|without|leav\w+|spouts?|handles?|labels?)\b", re.IGNORECASE
)
_GENERAL = re.compile("|".join(rf"\b(?:all )?(?:the )?{word}\b" for word in OBJECT_WORDS))


class SlotSentences:
    """Sentences that are drawn.

    Args:
        rng: draws.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self._grammar = [pair for pair in all_sentences() if split_of(pair[0]) == "seen"]

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            text, slots, objects = self._sentence()
            if _EXCEPTED.search(text) or (objects is not None and _OPEN.search(objects)):
                continue
            try:
                return labelled(text, _line(slots, objects))
            except LabelError:  # as of a tower with a size
                continue

    def _sentence(self) -> tuple[str, dict[str, str | None], str | None]:
        """Draw a text, its slots and its words for the objects; `None` where it has none."""
        if self.rng.random() < GRAMMAR:
            text, spec = self._grammar[int(self.rng.integers(len(self._grammar)))]
            found = _GENERAL.search(text)
            return text, spec.to_dict(), found.group() if found else None
        while True:
            drawn = paraphrase(self.rng)
            if drawn.refuse is None and drawn.objects is not None and any(drawn.labels.values()):
                return drawn.text, dict(drawn.labels), drawn.objects


def _line(slots: dict[str, str | None], objects: str | None) -> str:
    """Return the label of a structure."""
    shape = slots["shape"]
    legal = SLOTS_OF_SHAPE[shape]
    values = [f"facing {value}" if slot == "rotation" else value for slot, value in slots.items()
              if slot != "shape" and value is not None and slot in legal]  # fmt: skip
    head = f"{shape or 'structure'} of {objects or '(all)'}"
    return f"{', '.join([head, *values])}."

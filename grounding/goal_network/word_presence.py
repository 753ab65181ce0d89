"""Say for each word of an instruction whether something in the scene is called so, or has that colour.

The goal network writes a goal before its phrases are looked up in the scene. What is there tells it what an instruction
only mentions: in "the lamp is on the left, so stack the cans" there is a can and no lamp.
"""

from __future__ import annotations

from collections.abc import Sequence

from grounding.resolve.adjectives import colours_of
from grounding.resolve.attributes import SceneObject
from grounding.resolve.lexicon import GENERAL
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import singular

# What a word can be: of an unknown scene, no name; a noun of something that is there, or of nothing that is there; a
# colour of something, or of nothing; a noun that says nothing, such as "things".
UNKNOWN, NO_NAME, NOUN_HERE, NOUN_ABSENT, COLOUR_HERE, COLOUR_ABSENT, GENERAL_NOUN = range(7)
PRESENCES = 7


def word_presence(words: Sequence[str], objects: Sequence[SceneObject] | None) -> tuple[int, ...]:
    """Say for each word whether it names something in the scene.

    Args:
        words: of an instruction, in small letters.
        objects: that are there; `None` where no scene is known.

    Returns:
        One of the constants of this module for each word.
    """
    if objects is None:
        return (UNKNOWN,) * len(words)
    said = _SceneWords(objects)
    return tuple(said.presence(word) for word in words)


class _SceneWords:
    """The words of one scene."""

    def __init__(self, objects: Sequence[SceneObject]) -> None:
        self._nouns = Referents(objects)
        self._colours = {colour for each in objects if each.attributes is not None for colour in each.attributes.colors}

    def presence(self, word: str) -> int:
        """Say whether a word names something here."""
        if word in GENERAL or singular(word) in GENERAL:
            return GENERAL_NOUN
        if self._nouns.named(word) or (self._nouns.is_noun(word) and self._nouns.meanings(word)):
            return NOUN_HERE
        colours = colours_of(word) or colours_of(singular(word))
        if colours is not None:
            return COLOUR_HERE if self._colours & set(colours) else COLOUR_ABSENT
        return NOUN_ABSENT if self._nouns.is_noun(word) else NO_NAME

"""Find what a text says of a figure besides its name, and no goal holds: "city" of "a city gate"."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from grounding.propose.figure_mentions import (
    HARMLESS,
    WORDS,
    Mention,
    figures_read_otherwise,
    names_in,
    shapes_without_size,
)
from grounding.resolve.attributes import SceneObject
from grounding.resolve.function_words import DETERMINERS, FUNCTION_WORDS
from grounding.resolve.word_forms import singular

# Where the words before a noun begin: at function words, and at verbs that are none.
_STOPS = FUNCTION_WORDS | DETERMINERS | frozenset(
    "create construct erect design draw paint sketch produce raise do give show try write spell".split()
)  # fmt: skip
_SIZES = "big bigger large larger huge small smaller tiny little mini"
_BUT_SIZE = re.compile(rf"\bbut (?:a bit |a little |much )?({'|'.join(_SIZES.split())})\b", re.IGNORECASE)


@dataclass(frozen=True)
class Qualified:
    """What a text says of a structure besides its name.

    Attributes:
        words: that tell it from others of its name, as they are written.
        noun: as it is written.
        shape: the figure or shape that the noun is read as.
        size: a word of size, or "": upright figures have none.
    """

    words: tuple[str, ...]
    noun: str
    shape: str
    size: str = ""


def qualified(text: str, objects: Sequence[SceneObject] | None, mentions: Sequence[Mention]) -> tuple[Qualified, ...]:
    """Find what qualifies the names of figures, also of those that are read as another shape: "a Gothic arch".

    What stands for a name, such as "the same", has a size alone, and so has a shape that is no figure: "a large tower".

    Args:
        text: any string.
        objects: of the scene; `None` where it is not known.
        mentions: of figures in the text.
    """
    things = set(map(str.lower, names_in(objects)))
    read = {(first, end): shape for first, end, shape in figures_read_otherwise(text)}
    read |= {(one.first, one.end): one.name for one in mentions}
    plain = {(first, end): shape for first, end, shape in shapes_without_size(text) if (first, end) not in read}
    bare = {(one.first, one.end) for one in mentions if one.lead} | plain.keys()
    read |= plain
    after, found = _BUT_SIZE.search(text), list[Qualified]()
    for (first, end), shape in sorted(read.items()):
        words, size = _before(text[:first], things)
        found.append(
            Qualified(
                () if (first, end) in bare else words, text[first:end], shape, size or (after[1] if after else "")
            )
        )
    return tuple(one for one in found if one.words or one.size)


def _before(text: str, things: Collection[str]) -> tuple[tuple[str, ...], str]:
    """Return the words before a noun that say which of its kind it is: not sizes, places and praise, and not the names
    of the scene's objects; and the word of size among them, or "".

    Args:
        text: up to the noun.
        things: the words of the objects' names, in small letters.
    """
    found, size = list[str](), ""
    for word in reversed(WORDS.findall(text)):
        small = word.lower()
        size = small if small in _SIZES.split() else size
        if small == "-" or small in HARMLESS or {small, singular(small)} & set(things):
            continue
        if not word[0].isalpha() or small in _STOPS:
            break
        found.insert(0, word)
    return tuple(found), size

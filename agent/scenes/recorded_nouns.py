"""Tell where an instruction relies on nouns that were read from a picture, and ask where they leave doubt."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from PIL import Image

from agent.perception.nouns.recognition import HOW_TO_GET, nouns_available
from agent.perception.report import taken_for
from agent.perception.segments import Segment
from agent.rendering.text import with_indefinite_article
from agent.runtime.output_ownership import OwnFolder
from grounding.resolve.lexicon import meanings

_PICTURE = "objects.png"


def taken_nouns(found: Sequence[Segment], called: Mapping[str, str]) -> list[str]:
    """Say what each object is taken for that has its noun from the picture, a sentence each.

    Args:
        found: the objects.
        called: name of an object -> the noun that the user gave it.
    """
    return [taken_for(each) for each in found if each.noun and each.name not in called]


def doubts(
    found: Sequence[Segment],
    called: Mapping[str, str],
    nouns: Sequence[str],
    chosen: Collection[int],
    changes: Callable[[int, str], bool],
) -> dict[str, str]:
    """Say which objects may have one of the nouns that an instruction chooses by, and would be meant then.

    Returns: the name of each such object -> a sentence about it.

    Args:
        found, called: as for `taken_nouns`.
        nouns: that choose or leave out objects; adjectives may stand before them.
        chosen: the indices of the chosen objects.
        changes: whether other objects would be meant if the object of an index had a noun: "cup 2" and "the red cup"
            stay what they are where object 3, which is green, may be a cup.
    """
    asked = {word for noun in nouns for kinds in meanings(noun.split()[-1]) for word in kinds}
    doubtful = {}
    for index, each in enumerate(found):
        if each.name in called or index in chosen:
            continue
        noun = max((noun for noun in each.nouns if noun.split()[-1] in asked), key=each.nouns.__getitem__, default="")
        if noun and changes(index, noun):
            doubtful[each.name] = f"{each.name} may be {with_indefinite_article(noun)} too ({each.nouns[noun]:.2f})"
    return doubtful


def how_to_name(found: Sequence[Segment], unnamed: str, picture: np.ndarray, place: OwnFolder | None = None) -> str:
    """Say what unnamed objects may be, where a picture (H, W, 3) of all with their numbers lies, and what to do.

    Args:
        found: the objects whose nouns may help.
        unnamed: the name of one whose noun is not known.
        picture: with the numbers of all.
        place: where the picture is written; `None` for the temporary folder.
    """
    likely = [
        f"{each.name} may be {with_indefinite_article(noun)} ({share:.2f})"
        for each in found
        if not each.noun
        for noun, share in list(each.nouns.items())[:1]
    ]
    how = f"--call '{unnamed}=cup' says what an object is"
    advice = () if nouns_available() else (HOW_TO_GET.split(";")[0],)
    return "; ".join((*likely, f"the objects are numbered in {_written(picture, place)}", *advice, how))


def _written(picture: np.ndarray, place: OwnFolder | None) -> str:
    """Write a picture where it stays after the process has ended; return its path."""
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "png")
    if place is None:
        with tempfile.NamedTemporaryFile(prefix="structagent-objects-", suffix=".png", delete=False) as file:
            file.write(content.getvalue())
        return file.name
    return str(place.write(_PICTURE, content.getvalue()))
